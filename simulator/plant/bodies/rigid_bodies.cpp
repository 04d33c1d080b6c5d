#include "simulator/plant/bodies/rigid_bodies.h"

#include <cmath>
#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <optional>
#include <stdexcept>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "models/machine/static_force.h"
#include "models/math/error.h"
#include "models/math/taylor.h"

namespace sparflow::plant {
namespace {

using Series =
    TaylorSeries<2>;  // place along the motion: position, velocity, half the acceleration

constexpr double kSteepest =
    0.087;  // cosine of the second angle at which the pendulum's angles become singular

KDL::Vector kdl_vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

KDL::Rotation kdl_rotation(const Eigen::Matrix3d& r) {
  return {r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)};
}

/// inertia * z z^T, the inertia about one axis alone, as the machine file gives it.
KDL::RotationalInertia about_axis(double inertia, const Eigen::Vector3d& z) {
  const Eigen::Matrix3d i = inertia * z * z.transpose();
  return KDL::RotationalInertia(i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2), i(1, 2));
}

/// Axis about which a link of this joint turns, in the joint's link frame: its own, or, behind prismatic joints, that of the
/// last revolute joint. Empty: it never turns.
std::optional<Eigen::Vector3d> turning_axis(const Machine& machine, int joint) {
  Eigen::Matrix3d frame =
      Eigen::Matrix3d::Identity();  // from the searched joint's frame to `joint`'s
  for (int k = joint; k >= 0; --k) {
    const Joint& j = machine.joints[static_cast<std::size_t>(k)];
    if (j.type == JointType::kRevolute) return Eigen::Vector3d(frame.transpose() * j.axis);
    frame = (j.origin.linear() * frame).eval();
  }
  return std::nullopt;
}

Eigen::Vector3d values(const Vector3<Series>& v) { return {plain(v[0]), plain(v[1]), plain(v[2])}; }
Eigen::Vector3d accelerations(const Vector3<Series>& v) {
  return {v[0].derivative(2), v[1].derivative(2), v[2].derivative(2)};
}

}  // namespace

struct RigidBodies::Kdl {
  KDL::Chain chain;
  std::unique_ptr<KDL::ChainDynParam> parameters;
  std::unique_ptr<KDL::ChainIdSolver_RNE> newton_euler;
  KDL::JntArray q, qd, still, torque;
  KDL::JntSpaceInertiaMatrix mass;
  KDL::Wrenches none;
  std::unique_ptr<ChainGeometry> geometry;
};

RigidBodies::RigidBodies(const Machine& machine, const PendulumParameters& pendulum, double payload)
    : machine_(machine),
      pendulum_(pendulum),
      payload_(payload),
      joints_(machine.joint_count()),
      hanging_(pendulum.rope_length > 0.0 && machine.gravity.norm() > 0.0 &&
               machine.tip.joint >= 0) {
  if (hanging_) {
    down_ = machine.gravity.normalized();
    Eigen::Vector3d::Index least = 0;
    down_.cwiseAbs().minCoeff(&least);
    east_ = (Eigen::Vector3d::Unit(least) - down_ * down_[least]).normalized();
    north_ = down_.cross(east_);
  }
  mass_.setZero(size(), size());
  bias_.setZero(size());
  jacobian_.setZero(3, size());
  build_chain();
}

RigidBodies::~RigidBodies() = default;

void RigidBodies::set_payload(double payload) {
  payload_ = payload;
  build_chain();
}

double RigidBodies::load_mass() const {
  const double told = machine_.tip.payload_scale * payload_;
  return hanging_ ? std::max(told, pendulum_.hook_mass) : told;
}

void RigidBodies::build_chain() {
  kdl_ = std::make_unique<Kdl>();
  last_y_.resize(0);
  for (int k = 0; k < joints_; ++k) {
    const Joint& joint = machine_.joints[static_cast<std::size_t>(k)];
    KDL::RigidBodyInertia body = KDL::RigidBodyInertia::Zero();
    const std::optional<Eigen::Vector3d> turning = turning_axis(machine_, k);
    for (const Link& link : machine_.links) {
      if (link.joint != k) continue;
      const KDL::RotationalInertia spin = turning && link.inertia > 0.0
                                              ? about_axis(link.inertia, *turning)
                                              : KDL::RotationalInertia::Zero();
      // A sliding stage turns with this link; its mass is a point of its own.
      const double mass = link.slides_with >= 0 ? 0.0 : link.mass;
      const Eigen::Vector3d cog = mass > 0.0 ? link.cog : Eigen::Vector3d(Eigen::Vector3d::Zero());
      body = body + KDL::RigidBodyInertia(mass, kdl_vector(cog), spin);
    }
    if (!hanging_ && machine_.tip.joint == k)
      body = body + KDL::RigidBodyInertia(load_mass(), kdl_vector(machine_.tip.xyz));
    const KDL::Frame origin(kdl_rotation(joint.origin.linear()),
                            kdl_vector(joint.origin.translation()));
    kdl_->chain.addSegment(
        KDL::Segment(joint.name,
                     KDL::Joint(joint.name, origin.p, origin.M * kdl_vector(joint.axis),
                                joint.type == JointType::kRevolute ? KDL::Joint::RotAxis
                                                                   : KDL::Joint::TransAxis),
                     origin, body));
  }
  const auto n = static_cast<unsigned>(joints_);
  const KDL::Vector gravity = kdl_vector(machine_.gravity);
  kdl_->parameters = std::make_unique<KDL::ChainDynParam>(kdl_->chain, gravity);
  kdl_->newton_euler = std::make_unique<KDL::ChainIdSolver_RNE>(kdl_->chain, gravity);
  for (KDL::JntArray* a : {&kdl_->q, &kdl_->qd, &kdl_->still, &kdl_->torque}) a->resize(n);
  kdl_->mass.resize(n);
  kdl_->none.assign(kdl_->chain.getNrOfSegments(), KDL::Wrench::Zero());
  kdl_->geometry = std::make_unique<ChainGeometry>(machine_);
}

void RigidBodies::update(const double* y, const double* yd) {
  const Eigen::Map<const Eigen::VectorXd> at(y, size()), rate(yd, size());
  if (last_y_.size() == size() && last_y_ == at && last_yd_ == rate) return;
  mass_.setZero();
  bias_.setZero();
  kdl_->q.data = at.head(joints_);
  kdl_->qd.data = rate.head(joints_);
  const bool done =
      kdl_->parameters->JntToMass(kdl_->q, kdl_->mass) == 0 &&
      kdl_->newton_euler->CartToJnt(kdl_->q, kdl_->qd, kdl_->still, kdl_->none, kdl_->torque) == 0;
  SPARFLOW_CHECK(done, "KDL refused a chain of the right size");
  mass_.topLeftCorner(joints_, joints_) = kdl_->mass.data;
  bias_.head(joints_) = kdl_->torque.data;
  kdl_->geometry->update(machine_, y);
  add_points(y, yd);
  last_y_ = at;
  last_yd_ = rate;
}

/// Columns of d p / d q for a point fixed to link `joint`.
void RigidBodies::position_columns(int joint, const Eigen::Vector3d& at) {
  jacobian_.setZero();
  for (int k = 0; k <= joint; ++k) jacobian_.col(k) = point_jacobian(*kdl_->geometry, joint, at, k);
}

void RigidBodies::add_point(double mass, const Eigen::Vector3d& acceleration) {
  mass_.noalias() += mass * jacobian_.transpose() * jacobian_;
  bias_.noalias() += mass * jacobian_.transpose() * (acceleration - machine_.gravity);
}

void RigidBodies::add_points(const double* y, const double* yd) {
  Eigen::Matrix<Series, Eigen::Dynamic, 1> path(joints_);
  for (int k = 0; k < joints_; ++k) {
    path[k] = Series(y[k]);
    path[k].coefficient[1] = yd[k];
  }
  const std::vector<Frame<Series>> frames = forward_kinematics<Series>(machine_, path);
  const ChainGeometry& geometry = *kdl_->geometry;
  for (const Link& link : machine_.links) {
    if (link.slides_with < 0 || link.mass <= 0.0) continue;
    const auto s = static_cast<std::size_t>(link.slides_with);
    const Vector3<Series> axis = frames[s].rotation * machine_.joints[s].axis.cast<Series>();
    Vector3<Series> p = point_in_base(frames, link.joint, link.cog);
    for (int i = 0; i < 3; ++i) p[i] += Series(link.fraction) * path[link.slides_with] * axis[i];
    position_columns(link.joint, values(p));
    // Joints beyond the link's own, up to the sliding one, turn the direction of the slide only.
    const Eigen::Vector3d slide = link.fraction * y[link.slides_with] * geometry.axis[s];
    for (int k = link.joint + 1; k < link.slides_with; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (geometry.revolute[i]) jacobian_.col(k) = geometry.axis[i].cross(slide);
    }
    jacobian_.col(link.slides_with) += link.fraction * geometry.axis[s];
    add_point(link.mass, accelerations(p));
  }
  std::vector<LinkageMass<Series>> masses;  // over the joint's own position, not yet over time
  for (int c = 0; c < machine_.cylinder_count(); ++c) {
    const int j = machine_.cylinders[static_cast<std::size_t>(c)].joint;
    masses.clear();
    append_linkage_masses(machine_, c, Series::variable(y[j]), masses);
    for (const LinkageMass<Series>& m : masses) {
      Vector3<Series> local;
      Eigen::Vector3d slope;
      for (int i = 0; i < 3; ++i) {
        const Series& x = m.position[i];
        local[i] = Series(x.value());
        local[i].coefficient[1] = x.coefficient[1] * yd[j];
        local[i].coefficient[2] = x.coefficient[2] * yd[j] * yd[j];
        slope[i] = x.coefficient[1];
      }
      if (j > 0) {
        const Frame<Series>& parent = frames[static_cast<std::size_t>(j - 1)];
        local = (parent.position + parent.rotation * local).eval();
        slope = (geometry.rotation[static_cast<std::size_t>(j - 1)] * slope).eval();
      }
      position_columns(j - 1, values(local));
      jacobian_.col(j) = slope;
      add_point(m.mass, accelerations(local));
    }
  }
  if (!hanging_) return;
  Series a(y[joints_]), b(y[joints_ + 1]);
  a.coefficient[1] = yd[joints_];
  b.coefficient[1] = yd[joints_ + 1];
  Series sa, ca, sb, cb;
  Series::sin_cos(a, sa, ca);
  Series::sin_cos(b, sb, cb);
  if (plain(cb) < kSteepest) throw std::domain_error("the rope is nearly horizontal");
  Vector3<Series> p = point_in_base(frames, machine_.tip.joint, machine_.tip.xyz);
  position_columns(machine_.tip.joint, values(p));
  const double l = pendulum_.rope_length;
  for (int i = 0; i < 3; ++i)
    p[i] += Series(l) *
            (Series(down_[i]) * ca * cb + Series(east_[i]) * sa * cb + Series(north_[i]) * sb);
  const double s1 = plain(sa), c1 = plain(ca), s2 = plain(sb), c2 = plain(cb);
  jacobian_.col(joints_) = l * c2 * (east_ * c1 - down_ * s1);
  jacobian_.col(joints_ + 1) = l * (north_ * c2 - s2 * (down_ * c1 + east_ * s1));
  add_point(load_mass(), accelerations(p));
}

double RigidBodies::swing_moment() const {
  return load_mass() * machine_.gravity.norm() * pendulum_.rope_length;
}

double RigidBodies::swing_damping() const {
  const double l = pendulum_.rope_length;
  return 2.0 * pendulum_.damping_ratio * load_mass() * l * l *
         std::sqrt(machine_.gravity.norm() / l);
}

double RigidBodies::kinetic_energy(const double* yd) const {
  const Eigen::Map<const Eigen::VectorXd> rate(yd, size());
  return 0.5 * rate.dot(mass_ * rate);
}

Eigen::Vector3d RigidBodies::payload_place(const double* y) const {
  const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(y, joints_);
  Eigen::Vector3d p = tip_position<double>(machine_, q);
  if (!hanging_) return p;
  const double a = y[joints_], b = y[joints_ + 1];
  return p + pendulum_.rope_length * (down_ * std::cos(a) * std::cos(b) +
                                      east_ * std::sin(a) * std::cos(b) + north_ * std::sin(b));
}

double RigidBodies::potential_energy(const double* y) const {
  const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(y, joints_);
  return sparflow::potential_energy(machine_, q, 0.0) -
         load_mass() * machine_.gravity.dot(payload_place(y));
}

}  // namespace sparflow::plant
