#pragma once
/// Static load of every joint and cylinder by virtual work (paper eqs. 5-8), with exact first and second
/// derivatives for any serial chain.
///
/// With U(q) the potential energy, tau_k = dU/dq_k. For a point carried by links 0..b the derivatives of
/// its position follow from the joint axes alone: for i <= j <= k (revolute z_i, z_j)
///   dp/dq_k = J_k,  d2p/dq_j dq_k = z_j x J_k,  d3p/dq_i dq_j dq_k = z_i x (z_j x J_k),
/// and a prismatic joint before k contributes nothing. So gradient and Hessian of all torques need one
/// vector for each joint (its first mass moment) and cross products, whatever the number of masses.
#include <tuple>
#include <vector>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"

namespace sparflow {

/// Templated virtual work, tau_k = -sum m g . dp/dq_k, one mass at a time. It is the second
/// code path that checks `StaticForce`, and it accepts dual numbers.
/// @param q joint coordinates  @param payload [kg] at the tip
/// @return tau [N m] or [N], positive where the actuator must push towards +q to hold the load
template <class T>
Eigen::Matrix<T, Eigen::Dynamic, 1> static_torque(const Machine& machine,
                                                  const Eigen::Matrix<T, Eigen::Dynamic, 1>& q,
                                                  double payload);

/// Static force on each cylinder, F = tau / (dx/dq), templated: the second code path of `StaticForce`.
/// @return [N], positive when the load pushes the rod in
template <class T>
Eigen::Matrix<T, Eigen::Dynamic, 1> static_force(const Machine& machine,
                                                 const Eigen::Matrix<T, Eigen::Dynamic, 1>& q,
                                                 double payload) {
  Eigen::Matrix<T, Eigen::Dynamic, 1> force = static_torque<T>(machine, q, payload);
  Eigen::Matrix<T, Eigen::Dynamic, 1> result(machine.cylinder_count());
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const int j = machine.cylinders[static_cast<std::size_t>(i)].joint;
    // The chain rule carries the Taylor derivatives of dx/dq through T.
    const Taylor3 x = linkage_rates(machine, i, plain(q[j]));
    if constexpr (std::is_same_v<T, double>) {
      result[i] = force[j] / x.d1;
    } else {
      result[i] = force[j] / q[j].chain(x.d1, x.d2, x.d3);
    }
  }
  return result;
}

/// Potential energy [J] of all masses and the payload, zero at the base's origin.
double potential_energy(const Machine& machine, const Eigen::VectorXd& q, double payload);

/// Static torques and cylinder forces with derivatives. Each thread needs its own object; nothing is allocated after
/// construction.
class StaticForce {
 public:
  explicit StaticForce(const Machine& machine);

  /// Evaluates everything at q. @param payload [kg] at the tip @param order 0 values, 1 + gradients, 2 + Hessians
  /// @throws std::domain_error when a four-bar cannot close at q
  void update(const double* q, double payload, int order);

  const Eigen::VectorXd& torque() const { return torque_; }  ///< [N m] or [N], by joint
  const Eigen::VectorXd& force() const { return force_; }    ///< [N], by cylinder
  /// d force_i / d q (row i). [cylinders x joints]
  const Eigen::MatrixXd& force_jacobian() const { return force_jacobian_; }
  /// d2 force_i / dq dq, symmetric. [joints x joints]
  const Eigen::MatrixXd& force_hessian(int cylinder) const {
    return force_hessian_[static_cast<std::size_t>(cylinder)];
  }
  /// d torque / d q, symmetric (the Hessian of the potential energy).
  const Eigen::MatrixXd& torque_jacobian() const { return torque_jacobian_; }
  /// d2 torque_joint / dq dq, symmetric. [joints x joints]
  const Eigen::MatrixXd& torque_hessian(int joint) const {
    return torque_hessian_[static_cast<std::size_t>(joint)];
  }
  /// Cylinder length and its three derivatives at q.
  const Taylor3& length(int cylinder) const { return lengths_[static_cast<std::size_t>(cylinder)]; }
  const ChainGeometry& chain() const { return chain_; }

 private:
  void add_rigid(double mass, int joint, const Eigen::Vector3d& p);
  /// The masses of the linkages, with as many derivatives of their positions as an order of `update` needs.
  template <int derivatives>
  void add_linkage_masses(const double* q);
  void accumulate_moments(const double* q, double payload, int order);
  double torque_third(int i, int j, int k) const;

  const Machine* machine_;
  ChainGeometry chain_;
  Eigen::VectorXd torque_, force_;
  Eigen::MatrixXd torque_jacobian_, force_jacobian_;
  std::vector<Eigen::MatrixXd> torque_hessian_, force_hessian_;
  std::vector<Taylor3> lengths_;
  std::tuple<std::vector<LinkageMass<TaylorSeries<1>>>, std::vector<LinkageMass<TaylorSeries<2>>>,
             std::vector<LinkageMass<TaylorSeries<3>>>>
      linkage_masses_;  // by derivatives of the positions
  // by joint: mass-weighted position derivatives d/dq_k, d2/dq_k2, d3/dq_k3 of all masses behind it
  std::vector<Eigen::Vector3d> first_, second_, third_;
  std::vector<Eigen::Vector3d> rigid_moment_;  // sum m p of what is fixed to link k or beyond
  std::vector<double> rigid_mass_;
};

}  // namespace sparflow
