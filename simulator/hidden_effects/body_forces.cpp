#include "simulator/hidden_effects/body_forces.h"

#include <algorithm>

#include "models/machine/linkage.h"

namespace sparflow::simulator {
namespace {

// Central differences of functions that vary by 1 over 1 rad or 1 m: relative truncation 1e-9, rounding 1e-11.
constexpr double kStep = 1e-4;
constexpr double kSlack = 1e-3;  // [rad] or [m]

Eigen::Vector3d towards(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double distance) {
  return from + (to - from).normalized() * distance;
}

}  // namespace

BodyForces::BodyForces(const Machine& machine) : machine_(machine) {
  for (const Link& link : machine_.links) {
    int spin = link.joint;
    while (spin >= 0 &&
           machine_.joints[static_cast<std::size_t>(spin)].type != JointType::kRevolute)
      --spin;
    bodies_.push_back(
        {link.joint, link.mass, link.cog, link.slides_with, link.fraction, link.inertia, spin});
  }
  bodies_.push_back({machine_.tip.joint, 0.0, machine_.tip.xyz, -1, 0.0, 0.0, -1});  // payload
  linkage_begin_ = bodies_.size();
  for (const Cylinder& c : machine_.cylinders) {
    if (std::holds_alternative<RackLinkage>(c.linkage)) continue;
    const auto* f = std::get_if<FourBarLinkage>(&c.linkage);
    for (const double mass :
         {c.barrel_mass, c.rod_mass, f ? f->rocker_mass : 0.0, f ? f->coupler_mass : 0.0})
      bodies_.push_back({c.joint - 1, mass, Eigen::Vector3d::Zero(), -1, 0.0, 0.0, -1});
  }
  const auto joints = static_cast<std::size_t>(machine_.joint_count());
  rotation_.resize(joints);
  origin_.resize(joints);
  for (auto* p : {&ahead_, &behind_, &here_, &acceleration_}) p->resize(bodies_.size());
  shifted_.resize(joints);
  spin_ahead_.resize(bodies_.size());
  spin_behind_.resize(bodies_.size());
}

void BodyForces::place(const double* q, std::vector<Eigen::Vector3d>& positions) {
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < machine_.joints.size(); ++k) {
    const Joint& joint = machine_.joints[k];
    p += r * joint.origin.translation();
    r = r * joint.origin.linear();
    if (joint.type == JointType::kPrismatic) {
      p += r * joint.axis * q[k];
    } else {
      r = r * Eigen::AngleAxisd(q[k], joint.axis).toRotationMatrix();
    }
    rotation_[k] = r;
    origin_[k] = p;
  }
  const auto in_base = [&](int joint, const Eigen::Vector3d& local) -> Eigen::Vector3d {
    if (joint < 0) return local;
    const auto k = static_cast<std::size_t>(joint);
    return origin_[k] + rotation_[k] * local;
  };
  for (std::size_t b = 0; b < linkage_begin_; ++b) {
    const Body& body = bodies_[b];
    positions[b] = in_base(body.joint, body.cog);
    if (body.slides_with >= 0) {
      // The stage moves along the prismatic joint's axis, which is fixed in that joint's frame.
      const auto s = static_cast<std::size_t>(body.slides_with);
      positions[b] += rotation_[s] * machine_.joints[s].axis * (body.fraction * q[s]);
    }
  }
  std::size_t b = linkage_begin_;
  for (int i = 0; i < machine_.cylinder_count(); ++i) {
    const Cylinder& c = machine_.cylinders[static_cast<std::size_t>(i)];
    if (std::holds_alternative<RackLinkage>(c.linkage)) continue;
    const auto* f = std::get_if<FourBarLinkage>(&c.linkage);
    const bool massless = bodies_[b].mass == 0.0 && bodies_[b + 1].mass == 0.0 &&
                          bodies_[b + 2].mass == 0.0 && bodies_[b + 3].mass == 0.0;
    if (!massless) {
      const Joint& joint = machine_.joints[static_cast<std::size_t>(c.joint)];
      // A posture deflected under load may lie outside the range in which a four-bar closes.
      const double reached =
          std::clamp(q[c.joint], joint.position.lo - kSlack, joint.position.hi + kSlack);
      const auto pins = linkage_pins<double>(machine_, i, reached);
      // A direct cylinder lies along its joint's axis, also at zero stroke, where its pins coincide.
      const Eigen::Vector3d along = std::holds_alternative<DirectLinkage>(c.linkage)
                                        ? Eigen::Vector3d(joint.origin.linear() * joint.axis)
                                        : Eigen::Vector3d((pins.rod - pins.barrel).normalized());
      positions[b] = in_base(c.joint - 1, pins.barrel + along * c.barrel_cog);
      positions[b + 1] = in_base(c.joint - 1, pins.rod - along * c.rod_cog);
      positions[b + 2] = positions[b + 3] = positions[b];
      if (f) {
        positions[b + 2] = in_base(c.joint - 1, towards(pins.rocker, pins.rod, f->rocker_cog));
        positions[b + 3] = in_base(c.joint - 1, towards(pins.coupler, pins.rod, f->coupler_cog));
      }
    } else {
      for (std::size_t m = 0; m < 4; ++m) positions[b + m].setZero();
    }
    b += 4;
  }
}

double BodyForces::potential_energy(const double* q, double payload) {
  bodies_[linkage_begin_ - 1].mass = payload;
  place(q, here_);
  double energy = 0.0;
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    energy -= bodies_[b].mass * machine_.gravity.dot(here_[b]);
  return energy;
}

void BodyForces::gravity(const double* q, double payload, JointLoads& loads) {
  bodies_[linkage_begin_ - 1].mass = payload;
  const std::size_t n = shifted_.size();
  loads.gravity.assign(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) shifted_[k] = q[k];
  for (std::size_t k = 0; k < n; ++k) {
    shifted_[k] = q[k] + kStep;
    place(shifted_.data(), ahead_);
    shifted_[k] = q[k] - kStep;
    place(shifted_.data(), behind_);
    shifted_[k] = q[k];
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      loads.gravity[k] -=
          bodies_[b].mass * machine_.gravity.dot(ahead_[b] - behind_[b]) / (2.0 * kStep);
    }
  }
}

void BodyForces::spin_rates(const double* q, const double* qd, std::vector<double>& rates) {
  place(q, here_);
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    rates[b] = 0.0;
    if (bodies_[b].spin_joint < 0) continue;
    omega.setZero();
    for (std::size_t k = 0; k <= static_cast<std::size_t>(bodies_[b].joint); ++k) {
      if (machine_.joints[k].type == JointType::kRevolute)
        omega += rotation_[k] * machine_.joints[k].axis * qd[k];
    }
    const auto s = static_cast<std::size_t>(bodies_[b].spin_joint);
    rates[b] = omega.dot(rotation_[s] * machine_.joints[s].axis);
  }
}

double BodyForces::kinetic_energy(const double* q, const double* qd, double payload) {
  bodies_[linkage_begin_ - 1].mass = payload;
  const std::size_t n = shifted_.size();
  for (std::size_t k = 0; k < n; ++k) shifted_[k] = q[k] + kStep * qd[k];
  place(shifted_.data(), ahead_);
  for (std::size_t k = 0; k < n; ++k) shifted_[k] = q[k] - kStep * qd[k];
  place(shifted_.data(), behind_);
  spin_rates(q, qd, spin_ahead_);
  double energy = 0.0;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Eigen::Vector3d v = (ahead_[b] - behind_[b]) / (2.0 * kStep);
    energy += 0.5 * bodies_[b].mass * v.squaredNorm() +
              0.5 * bodies_[b].inertia * spin_ahead_[b] * spin_ahead_[b];
  }
  return energy;
}

void BodyForces::dynamic(const double* q, const double* qd, const double* qdd, double payload,
                         JointLoads& loads) {
  bodies_[linkage_begin_ - 1].mass = payload;
  const std::size_t n = shifted_.size();
  loads.inertia.assign(n, 0.0);
  // Positions a short time later and earlier along the motion.
  constexpr double kMoment =
      1e-3;  // [s] second difference: rounding 1e-9 m/s^2, truncation below 1e-6
  const auto along = [&](double t, std::vector<Eigen::Vector3d>& positions) {
    for (std::size_t k = 0; k < n; ++k) shifted_[k] = q[k] + t * qd[k] + 0.5 * t * t * qdd[k];
    place(shifted_.data(), positions);
  };
  along(kMoment, ahead_);
  along(-kMoment, behind_);
  place(q, here_);
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    acceleration_[b] = (ahead_[b] - 2.0 * here_[b] + behind_[b]) / (kMoment * kMoment);
  const auto spin_along = [&](double t, std::vector<double>& rates) {
    std::vector<double>& rate_now = loads.gravity;  // used as scratch memory, overwritten below
    rate_now.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      shifted_[k] = q[k] + t * qd[k] + 0.5 * t * t * qdd[k];
      rate_now[k] = qd[k] + t * qdd[k];
    }
    spin_rates(shifted_.data(), rate_now.data(), rates);
  };
  spin_along(kMoment, spin_ahead_);
  spin_along(-kMoment, spin_behind_);
  loads.gravity.assign(n, 0.0);
  place(q, here_);
  // The axes at q are taken before the shifts below overwrite the frames.
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (bodies_[b].spin_joint < 0 || bodies_[b].inertia == 0.0) continue;
    const auto s = static_cast<std::size_t>(bodies_[b].spin_joint);
    const Eigen::Vector3d axis = rotation_[s] * machine_.joints[s].axis;
    const double spin_up = (spin_ahead_[b] - spin_behind_[b]) / (2.0 * kMoment);
    for (std::size_t k = 0; k <= static_cast<std::size_t>(bodies_[b].joint); ++k) {
      if (machine_.joints[k].type != JointType::kRevolute) continue;
      loads.inertia[k] +=
          bodies_[b].inertia * spin_up * axis.dot(rotation_[k] * machine_.joints[k].axis);
    }
  }
  for (std::size_t k = 0; k < n; ++k) shifted_[k] = q[k];
  for (std::size_t k = 0; k < n; ++k) {
    shifted_[k] = q[k] + kStep;
    place(shifted_.data(), ahead_);
    shifted_[k] = q[k] - kStep;
    place(shifted_.data(), behind_);
    shifted_[k] = q[k];
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const Eigen::Vector3d slope = (ahead_[b] - behind_[b]) / (2.0 * kStep);
      loads.gravity[k] -= bodies_[b].mass * machine_.gravity.dot(slope);
      loads.inertia[k] += bodies_[b].mass * acceleration_[b].dot(slope);
    }
  }
}

double BodyForces::bending_moment(const double* q, double payload, int joint) {
  bodies_[linkage_begin_ - 1].mass = payload;
  place(q, here_);
  int hinge = joint - 1;
  while (hinge >= 0 &&
         machine_.joints[static_cast<std::size_t>(hinge)].type != JointType::kRevolute)
    --hinge;
  if (hinge < 0) return 0.0;
  const auto j = static_cast<std::size_t>(joint), h = static_cast<std::size_t>(hinge);
  const Eigen::Vector3d axis = rotation_[h] * machine_.joints[h].axis;
  // The guide is at the origin of the joint's frame at zero travel.
  const Eigen::Vector3d guide = origin_[j] - rotation_[j] * machine_.joints[j].axis * q[j];
  double moment = 0.0;
  for (std::size_t b = 0; b < linkage_begin_; ++b) {
    if (bodies_[b].joint < joint && bodies_[b].slides_with != joint) continue;
    moment += bodies_[b].mass * (here_[b] - guide).cross(machine_.gravity).dot(axis);
  }
  return moment;
}

}  // namespace sparflow::simulator
