#pragma once
/// Baselines: motions with which the energy-optimal one is compared, each from rest to rest within all limits: sequential,
/// all joints in proportion, all cylinders in proportion, the tip on a straight line. Energies are by the exact law and
/// limits are checked between the knots, as for the optimum (optimizer/crane/exact_energy.h).
#include <memory>
#include <string>
#include <vector>

#include "optimizer/crane/exact_energy.h"
#include "optimizer/solve/optimize.h"

namespace sparflow {

/// Kinds of baseline, the keys of `strategies`' JSON.
inline constexpr const char* kSequential = "sequential";
inline constexpr const char* kJointLine =
    "simultaneous";  ///< to the goal configuration that costs least
inline constexpr const char* kNearestJointLine =
    "simultaneous_nearest";  ///< to the goal configuration nearest in time
inline constexpr const char* kActuatorLine =
    "actuator_line";  ///< strokes in proportion; Jensen, Ebbesen and Hansen
inline constexpr const char* kTipLine = "tip_line";  ///< pseudo-inverse, least weighted joint speed
inline constexpr const char* kBestTipLine =
    "tip_line_best";  ///< redundancy of least energy; Nurmi and Mattila (optimizer/baselines/path_redundancy.h)

/// A baseline at one duration.
struct BaselineMotion {
  std::string kind;       ///< one of the keys above
  std::string detail;     ///< order of the joints, or the goal configuration
  Trajectory motion;      ///< keeps all limits; empty when there is none at this duration
  double duration = 0.0;  ///< [s]
  double shortest = 0.0;  ///< shortest duration of this kind [s]; 0 = there is none
  std::string why;        ///< why there is no motion
  MotionEnergy energy;
  bool found() const { return motion.size() > 1; }
};

struct BaselineOptions {
  /// Of the motions' mesh.
  /// @threshold [intervals] 10..1000; chosen: that of the optimum, so that both have the same mesh error
  int intervals = OptimizeOptions{}.intervals;
  /// Number of orders whose legs are optimised (optimize_with_modes), cheapest first.
  /// @threshold [1] 0..1000; chosen: time grows with it; estimates rank the orders well enough
  int polished_orders = 4;
  /// Largest number of orders considered, cheapest first.
  /// @threshold [1] 1..1000; chosen: all orders of four joints
  int most_orders = 24;
  /// Number of trapezoidal time laws tried for the tip line of best redundancy.
  /// @threshold [1] 1..20; chosen: the ends of the range of usual trapezoids, 1.12 and 2 times the mean speed
  int tip_speed_levels = 2;
  /// Relative overshoot that still counts as kept.
  /// @threshold [1] 0..1e-2; chosen: that of the optimum, so that both may do the same
  double limit_tolerance = OptimizeOptions{}.limit_tolerance;
  OptimizeOptions optimize;  ///< for the legs
};

/// A motion along a fixed path at its fastest; driven slower, it keeps the limits of speed and flow, too.
struct DrivenPath {
  std::string detail;
  std::vector<Trajectory>
      legs;  ///< each rest to rest, at its fastest; a single one unless the motion is sequential
  std::vector<int> joints;  ///< joint that moves in each leg of a sequential motion, else empty
  double shortest = 0.0;    ///< sum of the legs' durations [s]
};

/// Path of straight cylinder strokes from one posture to another (joints without cylinder move in proportion).
/// @return waypoints x joints
Eigen::MatrixXd actuator_line(const Machine& machine, const Eigen::VectorXd& from,
                              const Eigen::VectorXd& to, int pieces = 40);

/// Joint path with the tip on the straight line from its place at `from` to `goal`: steps of least
/// sum (dq_j / v_j)^2 with v the speed limits (Whitney 1969), joints at a limit of their range held there.
/// @param share set to the share of the line that was reached, 1 = all of it
/// @return waypoints x joints
Eigen::MatrixXd pseudo_inverse_line(const Machine& machine, const MotionProblem& problem,
                                    const Eigen::Vector3d& goal, double* share, int pieces = 80);

/// All baselines of a problem. Holds references to model and problem.
class BaselineSet {
 public:
  /// @param end_postures goal configurations, e.g. those of the seeds, from which more are found; the first must be the
  /// nearest
  BaselineSet(const CraneModel& model, const MotionProblem& problem,
              const std::vector<Eigen::VectorXd>& end_postures, BaselineOptions options = {});

  static const std::vector<std::string>& kinds();

  /// The cheapest motion of a kind in exactly this duration [s].
  BaselineMotion at(const std::string& kind, double duration) const;
  /// Sequential motions in every order of the joints, each to its cheapest goal configuration, cheapest first; the legs of
  /// the first `polished_orders` are optimised.
  std::vector<BaselineMotion> orders_at(double duration) const;
  /// The motion of the duration at which energy + idle power x time is least; without idle power the fastest motion of its
  /// kind. @param idle_power [W]
  BaselineMotion at_own_best(const std::string& kind, double idle_power) const;
  /// Shortest duration in which a motion of this kind keeps all limits [s]; 0 = none does. For the limit of the pump's
  /// pressure, durations up to six times the one that flows and speeds allow are tried.
  double shortest(const std::string& kind) const;
  /// The goal configurations that are tried.
  const std::vector<Eigen::VectorXd>& end_postures() const { return ends_; }

 private:
  BaselineMotion timed(const std::string& kind, const DrivenPath& path, double duration) const;
  BaselineMotion cheapest(const std::string& kind, double duration, bool polish) const;
  const std::vector<DrivenPath>& paths(const std::string& kind) const;
  const std::string& refusal(const std::string& kind) const;
  /// @param only_best limits are not checked for motions that cost more than the first one that keeps them
  std::vector<BaselineMotion> sequences_at(double duration, int polished, bool only_best) const;
  void find_end_postures(const std::vector<Eigen::VectorXd>& given);
  void make_sequences();
  void make_lines();
  void make_best_tip_lines();
  BaselineMotion best_tip_line(double duration) const;
  BaselineMotion polished(const BaselineMotion& from, const DrivenPath& path) const;

  const CraneModel& model_;
  const MotionProblem& problem_;
  BaselineOptions options_;
  std::vector<Eigen::VectorXd> ends_;
  std::vector<DrivenPath> sequences_, joint_lines_, nearest_line_, actuator_lines_, tip_lines_,
      best_tip_lines_;
  std::string no_sequence_, no_line_, no_nearest_, no_actuator_, no_tip_, no_best_tip_;
};

/// Durations of consecutive legs that sum to `duration` with the least sum of energies, by dynamic programming over the
/// time beyond the shortest. @param payload [kg]  @param legs each at its fastest
/// @return one duration for each leg [s]
std::vector<double> shared_time(const CraneModel& model, double payload,
                                const std::vector<Trajectory>& legs, double duration);

/// The legs as one motion.
Trajectory joined(const std::vector<Trajectory>& legs);

}  // namespace sparflow
