#pragma once
/// A motion to be planned: from `start` to `goal`, from rest to rest unless velocities are given there. Plain data, SI, base frame; read from
/// YAML by problems/problem_file.h, used by planners and optimizer.
#include <Eigen/Dense>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "models/machine/machine.h"

namespace sparflow {

/// Goal position of the tip; the goal configuration is free. [m], base frame.
struct TipGoal {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();
  double tolerance =
      0.0;  ///< of a stop of a cycle: the tip may rest anywhere in a ball of this radius [m]
};

/// Goal configuration, in the machine's joint order. [rad] or [m]
struct JointGoal {
  Eigen::VectorXd q;
  Eigen::VectorXd tolerance =
      {};  ///< of a stop of a cycle: each joint may be so far away; empty = 0
};

using Goal = std::variant<TipGoal, JointGoal>;

/// Allowed duration of the motion: fixed (min = max), a range, or free (min = 0, max = infinity).
struct Duration {
  double min = 0.0;  ///< [s]
  double max = 0.0;  ///< [s]
  bool fixed() const { return min == max; }
  bool free() const;
};

struct Box {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();        ///< [m]
  Eigen::Vector3d size = Eigen::Vector3d::Zero();          ///< full edge lengths [m]
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< box axes in the base frame
};

struct Sphere {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< [m]
  double radius = 0.0;                               ///< [m]
};

/// All points x with normal . (x - point) < 0 are solid: `normal` points into the free side.
struct HalfSpace {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit
};

struct Obstacle {
  std::string name;  ///< as given, or "box 1" and so on
  std::variant<Box, Sphere, HalfSpace> shape;
};

/// The machine's limits with the problem's overrides applied; joint, pump and cylinder order of the machine.
struct MotionLimits {
  std::vector<Range> position;            ///< [rad] or [m]
  std::vector<Range> velocity;            ///< [rad/s] or [m/s]
  std::vector<Range> acceleration;        ///< [rad/s^2] or [m/s^2]
  std::vector<double> pump_max_flow;      ///< [m^3/s]
  std::vector<double> pump_max_pressure;  ///< [Pa]
  double valve_fraction = 1.0;            ///< share of each valve's full flow that may be used [-]
  /// Trust region: largest standard deviation of a predicted working pressure [Pa]; 0 = none.
  double pressure_std = 0.0;
  /// Share of each valve's full flow below which the valve cannot be opened steadily, so that its cylinder counts as standing.
  /// @threshold [1] 0..0.05; chosen: spools of mobile valves resolve about half a percent of their full flow
  double valve_least_fraction = 0.005;
};

/// The tip shall follow the straight line from its start to its goal.
struct TipLine {
  double tolerance = 0.0;  ///< largest distance of the tip from the line [m]
};

/// A place of a cycle where the machine comes to rest, before the next one.
struct Stop {
  std::string name;  ///< as given, or "stop 1" and so on
  Goal goal;
  std::optional<double> payload;  ///< [kg] from then on; absent: as before
  double dwell = 0.0;             ///< [s] for which it rests there
};

/// Limits of the load's sway on its rope.
struct SwayLimit {
  double cable = 0.0;  ///< length of the rope from the tip to the load [m]
  double limit = 0.0;  ///< largest angle of the rope from the vertical [rad]
  double end_limit =
      0.0;  ///< largest angle to which it swings after the end and after each stop [rad]
};

/// Cost = energy * (E [J] + idle power * T) + time * T + commands * integral of sum_i u_i^2 dt
///        + smoothness * integral of sum_j qdd_j^2 dt, with u_i the command of valve i (1 = full flow).
struct ObjectiveWeights {
  double energy = 1.0;    ///< [-]
  double time = 0.0;      ///< [W]; with energy 0 the shortest duration is sought
  double commands = 0.0;  ///< [W]; with energy 0 the least squared commands are sought
  std::optional<double>
      smoothness;  ///< [J s^3] for joints in rad; absent: the optimiser's own default
};

struct MotionProblem {
  std::string name;  ///< `name` in the file, or the file's stem
  std::string file;  ///< as read
  /// `machine` in the file, resolved; empty when the file names none, or none that is there and another machine is given.
  std::string machine_path;
  std::string model_path;  ///< resolved; empty when the file names none
  Machine machine;
  std::vector<std::string> machine_warnings;  ///< warnings of load_machine()
  /// Whole sentences for the user, e.g. that other postures reach an oriented goal too.
  std::vector<std::string> notes;
  double payload = 0.0;   ///< [kg], hangs at the tip
  Eigen::VectorXd start;  ///< [rad] or [m], in the machine's joint order
  Goal goal;
  /// Rates of the joints at the start and at the goal, which is then a posture; empty = at rest. [rad/s] or [m/s]
  Eigen::VectorXd start_velocity, goal_velocity;
  /// Points that the tip passes in this order without having to stop [m]; the instants are free.
  std::vector<Eigen::Vector3d> waypoints;
  /// Stops of a cycle before `goal`, which is its last one; empty = one move from rest to rest.
  std::vector<Stop> stops;
  std::string goal_name;  ///< of a cycle: name of its last stop
  Duration duration;
  double idle_power = 0.0;  ///< engine power while time passes [W]
  MotionLimits limits;
  std::vector<Obstacle> obstacles;
  double clearance = 0.0;  ///< least distance of the machine from every obstacle [m]
  std::optional<TipLine> tip_line;
  std::optional<SwayLimit> sway;
  ObjectiveWeights objective;
  std::optional<int> knots;  ///< knots of the transcription; absent: the optimiser's choice

  // Defaulted in problem.cpp, so that they are not compiled in every file that copies a problem.
  MotionProblem();
  MotionProblem(const MotionProblem&);
  MotionProblem(MotionProblem&&) noexcept;
  MotionProblem& operator=(const MotionProblem&);
  MotionProblem& operator=(MotionProblem&&) noexcept;
  ~MotionProblem();
};

/// One leg of a cycle as a motion problem of its own, from `start` with the payload that it carries; leg 0 ends at the first stop,
/// the last one at the goal. A problem without stops is its only leg. Its duration is that of the whole.
MotionProblem leg_of(const MotionProblem& problem, std::size_t leg, const Eigen::VectorXd& start);
/// Payload on a leg. [kg]
double payload_on(const MotionProblem& problem, std::size_t leg);
/// Name of the stop in which a leg ends.
std::string end_of_leg(const MotionProblem& problem, std::size_t leg);
/// Time for which the machine rests at stops. [s]
double total_dwell(const MotionProblem& problem);

/// Whether the machine moves at the start or at the goal.
bool moves_at_an_end(const MotionProblem& problem);

/// The machine's own limits without overrides.
MotionLimits limits_of(const Machine& machine);

/// Orthonormal directions (base frame) along which the tip cannot move, whatever the joints do: for a
/// planar machine the normal of its plane; empty for a spatial one. A tip goal must agree with the tip
/// along these, and they carry no information about the posture.
std::vector<Eigen::Vector3d> fixed_tip_directions(const Machine& machine);
/// Orthonormal columns normal to these: the directions in which the tip can move [3 x 3 or fewer].
Eigen::Matrix3Xd moving_tip_directions(const Machine& machine);

}  // namespace sparflow
