#include "models/machine/static_force.h"

#include "models/math/jet.h"

namespace sparflow {
namespace {

/// Value (and derivatives, where T has them) of a function of one joint coordinate with derivatives f0, f1, f2.
template <class T>
T lifted(const T& q, double f0, double f1, double f2) {
  if constexpr (std::is_same_v<T, double>) {
    return f0;
  } else {
    return q.chain(f0, f1, f2);
  }
}

}  // namespace

template <class T>
Eigen::Matrix<T, Eigen::Dynamic, 1> static_torque(const Machine& machine,
                                                  const Eigen::Matrix<T, Eigen::Dynamic, 1>& q,
                                                  double payload) {
  const int n = machine.joint_count();
  const std::vector<Frame<T>> frames = forward_kinematics(machine, q);
  Eigen::Matrix<T, Eigen::Dynamic, 1> torque(n);
  for (int k = 0; k < n; ++k) torque[k] = T(0.0);
  const Vector3<T> gravity = machine.gravity.cast<T>();

  std::vector<Vector3<T>> axes;
  for (int k = 0; k < n; ++k) {
    const Eigen::Vector3d& local = machine.joints[static_cast<std::size_t>(k)].axis;
    axes.push_back(frames[static_cast<std::size_t>(k)].rotation * local.cast<T>());
  }
  const auto add_rigid = [&](double mass, int joint, const Vector3<T>& p) {
    for (int k = 0; k <= joint; ++k) {
      const auto i = static_cast<std::size_t>(k);
      Vector3<T> column = axes[i];
      if (machine.joints[i].type == JointType::kRevolute) {
        column = axes[i].cross((p - frames[i].position).eval()).eval();
      }
      torque[k] -= T(mass) * gravity.dot(column);
    }
  };
  for (const Link& link : machine.links) {
    Vector3<T> p = point_in_base(frames, link.joint, link.cog);
    if (link.slides_with >= 0) {
      const auto s = static_cast<std::size_t>(link.slides_with);
      for (int i = 0; i < 3; ++i) p[i] += T(link.fraction) * q[link.slides_with] * axes[s][i];
      torque[link.slides_with] -= T(link.mass * link.fraction) * gravity.dot(axes[s]);
    }
    add_rigid(link.mass, link.joint, p);
  }
  if (payload > 0.0) {
    add_rigid(machine.tip.payload_scale * payload, machine.tip.joint,
              point_in_base(frames, machine.tip.joint, machine.tip.xyz));
  }
  std::vector<LinkageMass<TaylorSeries<3>>> masses;
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const int j = machine.cylinders[static_cast<std::size_t>(c)].joint;
    masses.clear();
    append_linkage_masses(machine, c, TaylorSeries<3>::variable(plain(q[j])), masses);
    for (const LinkageMass<TaylorSeries<3>>& m : masses) {
      Vector3<T> local, rate;
      for (int i = 0; i < 3; ++i) {
        const Taylor3 x = m.position[i];
        local[i] = lifted(q[j], x.value, x.d1, x.d2);
        rate[i] = lifted(q[j], x.d1, x.d2, x.d3);
      }
      if (j > 0) {
        const Frame<T>& parent = frames[static_cast<std::size_t>(j - 1)];
        local = (parent.position + parent.rotation * local).eval();
        rate = (parent.rotation * rate).eval();
      }
      torque[j] -= T(m.mass) * gravity.dot(rate);
      add_rigid(m.mass, j - 1, local);
    }
  }
  return torque;
}

template Eigen::Matrix<double, Eigen::Dynamic, 1> static_torque<double>(
    const Machine&, const Eigen::Matrix<double, Eigen::Dynamic, 1>&, double);
template Eigen::Matrix<Jet, Eigen::Dynamic, 1> static_torque<Jet>(
    const Machine&, const Eigen::Matrix<Jet, Eigen::Dynamic, 1>&, double);

double potential_energy(const Machine& machine, const Eigen::VectorXd& q, double payload) {
  const std::vector<Frame<double>> frames = forward_kinematics<double>(machine, q);
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const Link& link : machine.links) {
    Eigen::Vector3d p = point_in_base(frames, link.joint, link.cog);
    if (link.slides_with >= 0) {
      const auto s = static_cast<std::size_t>(link.slides_with);
      p += link.fraction * q[link.slides_with] * (frames[s].rotation * machine.joints[s].axis);
    }
    moment += link.mass * p;
  }
  moment += machine.tip.payload_scale * payload *
            point_in_base(frames, machine.tip.joint, machine.tip.xyz);
  std::vector<LinkageMass<double>> masses;
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const int j = machine.cylinders[static_cast<std::size_t>(c)].joint;
    masses.clear();
    append_linkage_masses(machine, c, q[j], masses);
    for (const LinkageMass<double>& m : masses) {
      moment += m.mass * point_in_base(frames, j - 1, m.position);
    }
  }
  return -machine.gravity.dot(moment);
}

StaticForce::StaticForce(const Machine& machine) : machine_(&machine), chain_(machine) {
  const Eigen::Index n = machine.joint_count();
  const auto joints = static_cast<std::size_t>(n);
  const auto cylinders = machine.cylinders.size();
  torque_.setZero(n);
  force_.setZero(machine.cylinder_count());
  torque_jacobian_.setZero(n, n);
  force_jacobian_.setZero(machine.cylinder_count(), n);
  torque_hessian_.assign(joints, Eigen::MatrixXd::Zero(n, n));
  force_hessian_.assign(cylinders, Eigen::MatrixXd::Zero(n, n));
  lengths_.resize(cylinders);
  std::apply([](auto&... masses) { (masses.reserve(4), ...); }, linkage_masses_);
  first_.resize(joints);
  second_.resize(joints);
  third_.resize(joints);
  rigid_moment_.resize(joints);
  rigid_mass_.resize(joints);
}

void StaticForce::add_rigid(double mass, int joint, const Eigen::Vector3d& p) {
  if (joint < 0) return;
  rigid_mass_[static_cast<std::size_t>(joint)] += mass;
  rigid_moment_[static_cast<std::size_t>(joint)] += mass * p;
}

template <int derivatives>
void StaticForce::add_linkage_masses(const double* q) {
  using Series = TaylorSeries<derivatives>;
  auto& masses = std::get<derivatives - 1>(linkage_masses_);
  for (int c = 0; c < machine_->cylinder_count(); ++c) {
    const int j = machine_->cylinders[static_cast<std::size_t>(c)].joint;
    masses.clear();
    append_linkage_masses(*machine_, c, Series::variable(q[j]), masses);
    for (const LinkageMass<Series>& m : masses) {
      const auto part = [&](int order) {
        return Eigen::Vector3d(m.position[0].derivative(order), m.position[1].derivative(order),
                               m.position[2].derivative(order));
      };
      const Eigen::Matrix3d turn = j > 0 ? chain_.rotation[static_cast<std::size_t>(j - 1)]
                                         : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
      const auto k = static_cast<std::size_t>(j);
      first_[k] += m.mass * (turn * part(1));
      if constexpr (derivatives >= 2) second_[k] += m.mass * (turn * part(2));
      if constexpr (derivatives >= 3) third_[k] += m.mass * (turn * part(3));
      add_rigid(m.mass, j - 1, chain_.point(j - 1, part(0)));
    }
  }
}

void StaticForce::accumulate_moments(const double* q, double payload, int order) {
  const int n = machine_->joint_count();
  for (std::size_t k = 0; k < first_.size(); ++k) {
    first_[k].setZero();
    second_[k].setZero();
    third_[k].setZero();
    rigid_moment_[k].setZero();
    rigid_mass_[k] = 0.0;
  }
  for (const Link& link : machine_->links) {
    Eigen::Vector3d p = chain_.point(link.joint, link.cog);
    if (link.slides_with >= 0) {
      const auto s = static_cast<std::size_t>(link.slides_with);
      p += link.fraction * q[link.slides_with] * chain_.axis[s];
      first_[s] += link.mass * link.fraction * chain_.axis[s];
    }
    add_rigid(link.mass, link.joint, p);
  }
  if (payload > 0.0) {
    add_rigid(machine_->tip.payload_scale * payload, machine_->tip.joint,
              chain_.point(machine_->tip.joint, machine_->tip.xyz));
  }
  if (order <= 0) {
    add_linkage_masses<1>(q);
  } else if (order == 1) {
    add_linkage_masses<2>(q);
  } else {
    add_linkage_masses<3>(q);
  }
  // Everything fixed to link k or beyond moves as one body with joint k.
  double mass = 0.0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (int joint = n - 1; joint >= 0; --joint) {
    const auto k = static_cast<std::size_t>(joint);
    mass += rigid_mass_[k];
    moment += rigid_moment_[k];
    if (!chain_.revolute[k]) {
      first_[k] += mass * chain_.axis[k];
      continue;
    }
    const Eigen::Vector3d column = chain_.axis[k].cross(moment - mass * chain_.origin[k]);
    const Eigen::Vector3d turned = chain_.axis[k].cross(column);
    first_[k] += column;
    second_[k] += turned;
    third_[k] += chain_.axis[k].cross(turned);
  }
}

/// d2 tau_k / dq_i dq_j for i <= j <= k.
double StaticForce::torque_third(int i, int j, int k) const {
  const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j),
             c = static_cast<std::size_t>(k);
  Eigen::Vector3d v;
  if (i == k) {
    v = third_[c];
  } else if (j == k) {
    v = point_hessian(chain_, static_cast<int>(a), second_[c]);
  } else {
    v = point_hessian(chain_, static_cast<int>(a),
                      point_hessian(chain_, static_cast<int>(b), first_[c]));
  }
  return -machine_->gravity.dot(v);
}

void StaticForce::update(const double* q, double payload, int order) {
  const int n = machine_->joint_count();
  chain_.update(*machine_, q);
  accumulate_moments(q, payload, order);
  const Eigen::Vector3d& g = machine_->gravity;
  for (int k = 0; k < n; ++k) torque_[k] = -g.dot(first_[static_cast<std::size_t>(k)]);
  if (order >= 1) {
    for (int k = 0; k < n; ++k) {
      const auto c = static_cast<std::size_t>(k);
      torque_jacobian_(k, k) = -g.dot(second_[c]);
      for (int i = 0; i < k; ++i) {
        torque_jacobian_(i, k) = torque_jacobian_(k, i) =
            -g.dot(point_hessian(chain_, i, first_[c]));
      }
    }
  }
  if (order >= 2) {
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j <= k; ++j) {
        for (int i = 0; i <= j; ++i) {
          const double t = torque_third(i, j, k);
          const auto set = [&](int a, int b, int c) {
            torque_hessian_[static_cast<std::size_t>(a)](b, c) = t;
            torque_hessian_[static_cast<std::size_t>(a)](c, b) = t;
          };
          set(i, j, k);
          set(j, i, k);
          set(k, i, j);
        }
      }
    }
  }
  for (int i = 0; i < machine_->cylinder_count(); ++i) {
    const auto c = static_cast<std::size_t>(i);
    const int j = machine_->cylinders[c].joint;
    const Taylor3 x = lengths_[c] = linkage_rates(*machine_, i, q[j]);
    const double r = 1.0 / x.d1;  // F = tau r(q_j)
    force_[i] = torque_[j] * r;
    if (order < 1) continue;
    const double r1 = -x.d2 * r * r;
    force_jacobian_.row(i) = r * torque_jacobian_.row(j);
    force_jacobian_(i, j) += torque_[j] * r1;
    if (order < 2) continue;
    const double r2 = -x.d3 * r * r + 2.0 * x.d2 * x.d2 * r * r * r;
    Eigen::MatrixXd& h = force_hessian_[c];
    h = r * torque_hessian_[static_cast<std::size_t>(j)];
    for (int k = 0; k < n; ++k) {
      h(k, j) += r1 * torque_jacobian_(j, k);
      h(j, k) += r1 * torque_jacobian_(j, k);
    }
    h(j, j) += torque_[j] * r2;
  }
}

}  // namespace sparflow
