#pragma once
/// Joint loads of a machine as a sum over its bodies, by numeric differentiation of their positions: a path of its
/// own, so that a generated log does not inherit a mistake of models/static_force. SI throughout.
#include <vector>

#include "models/machine/machine.h"

namespace sparflow::simulator {

/// Loads an actuator must carry at one instant, by joint. [N m] or [N]
struct JointLoads {
  std::vector<double> gravity;  ///< dU/dq, U the potential energy
  std::vector<double> inertia;  ///< d'Alembert: sum over bodies of m a . dp/dq + I dw/dt . dw/dqd
};

/// One a thread; no allocation after construction.
class BodyForces {
 public:
  explicit BodyForces(const Machine& machine);

  /// dU/dq at q. @param payload [kg] at the tip
  /// @throws std::domain_error when a four-bar cannot close at q
  void gravity(const double* q, double payload, JointLoads& loads);
  /// Gravity, and what acceleration adds along the motion (q, qd, qdd).
  void dynamic(const double* q, const double* qd, const double* qdd, double payload,
               JointLoads& loads);
  double potential_energy(const double* q, double payload);                  ///< [J]
  double kinetic_energy(const double* q, const double* qd, double payload);  ///< [J]
  /// Moment [N m] that the weight of what `joint` (prismatic) carries, telescope stages and payload included,
  /// exerts on its guide, about the axis of the nearest revolute joint before it; 0 when there is none.
  double bending_moment(const double* q, double payload, int joint);

 private:
  struct Body {
    int joint;  ///< frame, -1 = base
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
  std::size_t linkage_begin_ = 0;  ///< bodies from here on are masses of the linkages
};

}  // namespace sparflow::simulator
