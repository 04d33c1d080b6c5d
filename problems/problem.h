#pragma once
/// A motion to be planned: from rest at `start` to rest at `goal`. Plain data, SI, base frame; read from
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
};

/// Goal configuration, in the machine's joint order. [rad] or [m]
struct JointGoal {
  Eigen::VectorXd q;
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
  /// Points that the tip passes in this order without having to stop [m]; the instants are free.
  std::vector<Eigen::Vector3d> waypoints;
  Duration duration;
  double idle_power = 0.0;  ///< engine power while time passes [W]
  MotionLimits limits;
  std::vector<Obstacle> obstacles;
  double clearance = 0.0;  ///< least distance of the machine from every obstacle [m]
  std::optional<TipLine> tip_line;
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

/// The machine's own limits without overrides.
MotionLimits limits_of(const Machine& machine);

/// Orthonormal directions (base frame) along which the tip cannot move, whatever the joints do: for a
/// planar machine the normal of its plane; empty for a spatial one. A tip goal must agree with the tip
/// along these, and they carry no information about the posture.
std::vector<Eigen::Vector3d> fixed_tip_directions(const Machine& machine);
/// Orthonormal columns normal to these: the directions in which the tip can move [3 x 3 or fewer].
Eigen::Matrix3Xd moving_tip_directions(const Machine& machine);

}  // namespace sparflow
