#pragma once
/// Motions a user would compare an energy-optimal one with, each from rest to rest within all limits: one
/// cylinder after another, all joints in proportion, all cylinders in proportion, the tip on a straight line. Energies are
/// those of the exact law and limits are looked at between the knots, as for the optimum (optimizer/crane/exact_energy.h).
#include <memory>
#include <string>
#include <vector>

#include "optimizer/crane/exact_energy.h"
#include "optimizer/solve/optimize.h"

namespace sparflow {

/// Kinds of baseline, the keys of `strategies`' JSON.
inline constexpr const char* kSequential = "sequential";
inline constexpr const char* kJointLine = "simultaneous";  ///< to the end posture that costs least
inline constexpr const char* kNearestJointLine =
    "simultaneous_nearest";  ///< to the end posture nearest in time
inline constexpr const char* kActuatorLine =
    "actuator_line";  ///< strokes in proportion; Jensen, Ebbesen and Hansen
inline constexpr const char* kTipLine = "tip_line";  ///< pseudo-inverse, least weighted joint speed
inline constexpr const char* kBestTipLine =
    "tip_line_best";  ///< redundancy of least energy; Nurmi and Mattila (optimizer/baselines/path_redundancy.h)

/// A baseline at one duration.
struct BaselineMotion {
  std::string kind;       ///< one of the keys above
  std::string detail;     ///< order of the joints, or the end posture
  Trajectory motion;      ///< keeps all limits; empty when there is none at this duration
  double duration = 0.0;  ///< [s]
  double shortest = 0.0;  ///< [s] of this kind; 0 = at no duration
  std::string why;        ///< why there is no motion
  MotionEnergy energy;
  bool found() const { return motion.size() > 1; }
};

struct BaselineOptions {
  int intervals = 100;
  int polished_orders =
      4;  ///< orders whose segments are optimised (optimize_with_modes), cheapest first
  int most_orders = 24;      ///< orders considered at all, cheapest first
  int tip_speed_levels = 2;  ///< time laws tried for the tip line of best redundancy
  double limit_tolerance = 1e-5;
  OptimizeOptions optimize;  ///< of the segments
};

/// One way of moving along a fixed path, at its fastest; any longer time keeps the same limits of speed.
struct DrivenPath {
  std::string detail;
  std::vector<Trajectory>
      legs;                 ///< each rest to rest, at its fastest; one unless cylinders take turns
  std::vector<int> joints;  ///< that move in the legs of a sequential motion, else empty
  double shortest = 0.0;    ///< [s] of all legs
};

/// Path of straight cylinder strokes from one posture to another (joints without cylinder move in proportion).
/// @return waypoints x joints
Eigen::MatrixXd actuator_line(const Machine& machine, const Eigen::VectorXd& from,
                              const Eigen::VectorXd& to, int pieces = 40);

/// Joint path with the tip on the straight line from its place at `from` to `goal`: steps of least
/// sum (dq_j / v_j)^2 with v the speed limits (Whitney 1969), joints at a limit of their range held there.
/// @param share of the line that was reached, 1 = all of it
/// @return waypoints x joints
Eigen::MatrixXd pseudo_inverse_line(const Machine& machine, const MotionProblem& problem,
                                    const Eigen::Vector3d& goal, double* share, int pieces = 80);

/// All baselines of a problem. Holds references to model and problem.
class BaselineSet {
 public:
  /// @param end_postures with the tip at the goal, e.g. those of the seeds; more are found from them. The first is
  /// taken as the nearest.
  BaselineSet(const CraneModel& model, const MotionProblem& problem,
              const std::vector<Eigen::VectorXd>& end_postures, BaselineOptions options = {});

  static const std::vector<std::string>& kinds();

  /// The cheapest of its kind in exactly this time.
  BaselineMotion at(const std::string& kind, double duration) const;
  /// Every order in which joints may move one after another, the cheapest end posture of each, cheapest first; the
  /// first `polished_orders` with their segments optimised.
  std::vector<BaselineMotion> orders_at(double duration) const;
  /// The duration at which energy + idle power x time is least, and the motion then; without idle power the
  /// fastest motion of its kind.
  BaselineMotion at_own_best(const std::string& kind, double idle_power) const;
  /// Shortest duration in which a motion of this kind keeps all limits [s]; 0 = at none. The pump's
  /// pressure is looked at up to six times the duration that flows and speeds allow.
  double shortest(const std::string& kind) const;
  /// Postures at the goal that were looked at.
  const std::vector<Eigen::VectorXd>& end_postures() const { return ends_; }

 private:
  BaselineMotion timed(const std::string& kind, const DrivenPath& path, double duration) const;
  BaselineMotion cheapest(const std::string& kind, double duration, bool polish) const;
  const std::vector<DrivenPath>& paths(const std::string& kind) const;
  const std::string& refusal(const std::string& kind) const;
  /// @param only_best limits of those dearer than the first that keeps them are not looked at
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

/// Legs of a motion driven one after the other, each stretched to its share of `duration` such that the sum of
/// their energies is least: dynamic programming over the time that is left beyond the shortest.
/// @return one duration a leg [s]
std::vector<double> shared_time(const CraneModel& model, double payload,
                                const std::vector<Trajectory>& legs, double duration);

/// Motions appended to each other.
Trajectory joined(const std::vector<Trajectory>& legs);

}  // namespace sparflow
