#pragma once
/// Equations of motion of the whole machine, M(y) ydd + h(y, yd) = Q, for the joints and the two angles of a hanging
/// payload. The serial chain with its links and a payload fixed to the tip is Orocos KDL's (composite rigid body and
/// recursive Newton-Euler). Masses whose place is a given function of the coordinates (telescope stages that move by a
/// share of a joint, barrels, rods, rockers, couplers, the hanging payload) enter as points by their Jacobians,
///   M += m J^T J,   h += m J^T (d2p/dt2 at ydd = 0 - g),
/// where J and the acceleration are derivatives of the place along the motion. That is no recursion over bodies.
/// Source: Featherstone (2008), Rigid Body Dynamics Algorithms, ch. 5-6 (what KDL implements); for points Kane, Levinson
/// (1985), Dynamics.
#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <memory>

#include "models/machine/machine.h"

namespace sparflow::plant {

/// A payload that hangs on a rope: deflections phi1, phi2 from the vertical, in a frame that does not turn with the
/// machine: direction = g cos(phi1) cos(phi2) + e1 sin(phi1) cos(phi2) + e2 sin(phi2) with unit vectors.
struct PendulumParameters {
  double rope_length = 0.0;     ///< [m], 0: the payload is fixed to the tip
  double damping_ratio = 0.02;  ///< [-] of the free swing
  double hook_mass = 10.0;  ///< [kg] least mass on the rope; part of the payload where that is more
};

/// Not thread-safe, not even for const calls: KDL's chains keep buffers. One object for each thread.
class RigidBodies {
 public:
  /// @param payload [kg] at the tip; the tip's scale applies
  RigidBodies(const Machine& machine, const PendulumParameters& pendulum, double payload);
  ~RigidBodies();
  RigidBodies(const RigidBodies&) = delete;
  RigidBodies& operator=(const RigidBodies&) = delete;

  void set_payload(double payload);
  int joints() const { return joints_; }
  bool hanging() const { return hanging_; }
  int size() const { return joints_ + (hanging_ ? 2 : 0); }

  /// Evaluates M and h. @param y positions: joints, phi1, phi2 @param yd their rates; both of length size()
  /// Nothing is computed again for the same y and yd.
  /// @throws std::domain_error when a four-bar cannot close, or the rope is within 5 degrees of horizontal sideways
  void update(const double* y, const double* yd);
  const Eigen::MatrixXd& mass() const {
    return mass_;
  }  ///< [size x size], symmetric, positive definite
  const Eigen::VectorXd& bias() const {
    return bias_;
  }  ///< h, gravity included: what holds the machine at rest
  /// Largest moment of a weight on the rope about the tip, m g L: scale of the pendulum's stiffness. [N m]
  double swing_moment() const;
  /// Generalised damping of each pendulum angle. [N m s]
  double swing_damping() const;

  double kinetic_energy(const double* yd) const;   ///< [J] at the last update
  double potential_energy(const double* y) const;  ///< [J]
  Eigen::Vector3d payload_place(
      const double* y) const;  ///< [m] of the hanging or fixed payload, base frame

 private:
  struct Kdl;
  void build_chain();
  void add_points(const double* y, const double* yd);
  void add_point(double mass, const Eigen::Vector3d& acceleration);
  void position_columns(int joint, const Eigen::Vector3d& at);
  double load_mass() const;

  const Machine& machine_;
  PendulumParameters pendulum_;
  double payload_ = 0.0;
  int joints_ = 0;
  bool hanging_ = false;
  Eigen::Vector3d down_, east_, north_;  // unit vectors of the pendulum's frame
  std::unique_ptr<Kdl> kdl_;
  Eigen::VectorXd last_y_, last_yd_;
  Eigen::MatrixXd mass_;
  Eigen::VectorXd bias_;
  Eigen::Matrix3Xd jacobian_;
};

}  // namespace sparflow::plant
