#pragma once
/// Joint loads of a machine as a sum over its bodies, by numeric differentiation of their positions. It shares no code
/// with models/machine/static_force, so that a generated log does not inherit its mistakes. SI throughout.
#include <vector>

#include "models/machine/machine.h"

namespace sparflow::simulator {

/// Generalised loads that the actuators carry at one instant, by joint. [N m] or [N]
struct JointLoads {
  std::vector<double> gravity;  ///< dU/dq, U the potential energy
  std::vector<double> inertia;  ///< d'Alembert: sum over bodies of m a . dp/dq + I dw/dt . dw/dqd
};

/// Each thread needs its own object. Allocates nothing after construction.
class BodyForces {
 public:
  explicit BodyForces(const Machine& machine);

  /// Sets loads.gravity at q. @param payload [kg] at the tip
  /// @throws std::domain_error when a four-bar cannot close at q
  void gravity(const double* q, double payload, JointLoads& loads);
  /// Sets loads.gravity and loads.inertia at the state (q, qd, qdd).
  void dynamic(const double* q, const double* qd, const double* qdd, double payload,
               JointLoads& loads);
  double potential_energy(const double* q, double payload);                  ///< [J]
  double kinetic_energy(const double* q, const double* qd, double payload);  ///< [J]
  /// Moment [N m] on the guide of `joint` (prismatic) by the weight that it carries, telescope stages and payload
  /// included, about the axis of the nearest revolute joint before it; 0 when there is none.
  double bending_moment(const double* q, double payload, int joint);

 private:
  struct Body {
    int joint;  ///< whose frame the body moves with, -1 = base
    double mass;
    Eigen::Vector3d cog;
    int slides_with;
    double fraction;
    double inertia;
    int spin_joint;  ///< revolute joint whose axis the inertia refers to, -1 = none
  };
  void place(const double* q, std::vector<Eigen::Vector3d>& positions);
  void spin_rates(const double* q, const double* qd, std::vector<double>& rates);

  Machine machine_;
  std::vector<Body> bodies_;
  std::vector<Eigen::Matrix3d> rotation_;
  std::vector<Eigen::Vector3d> origin_;
  std::vector<Eigen::Vector3d> ahead_, behind_, here_, acceleration_;
  std::vector<double> shifted_, spin_ahead_, spin_behind_;
  std::size_t linkage_begin_ = 0;  ///< index of the first body that is a mass of a linkage
};

}  // namespace sparflow::simulator
