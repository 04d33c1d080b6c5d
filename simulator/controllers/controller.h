#pragma once
/// What a controller of the benchmark sees and gives. All see the same: sensors, machine file, the goal, and what was
/// learned of the machine, through interfaces that the program above implements; none sees the plant's parameters.
#include <Eigen/Dense>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/machine/trajectory.h"

namespace sparflow::control {

/// What sensors tell at one sample. Vectors in the order of the machine file, SI.
struct Measurement {
  double t = 0.0;      ///< [s]
  Eigen::VectorXd q;   ///< [rad] or [m]; in a gap of the channel its last value
  Eigen::VectorXd qd;  ///< [rad/s] or [m/s], filtered differences of q
  std::vector<double> pressure_bore, pressure_rod;  ///< [Pa] by cylinder; 0 without hydraulics
  std::vector<double> pump_pressure;                ///< [Pa] by pump
  double payload = 0.0;                             ///< [kg]
  double oil = 40.0;                                ///< [degC]
};

/// One move of the work: from where the machine stands to a place, in a time.
struct Task {
  int leg = 0;                         ///< number of the move in its scenario
  Eigen::Vector3d tip;                 ///< [m] where the tip shall end
  std::optional<Eigen::VectorXd> q;    ///< the posture there, where the work asks for one
  double begin = 0.0, duration = 0.0;  ///< [s]
  double tolerance = 0.05;             ///< [m] of the tip, within which the work can be done
};

/// Levers for rod speeds, as they were learned, or as the machine file tells them where nothing was.
class ValveModel {
 public:
  virtual ~ValveModel() = default;
  /// @param speed [m/s] of the rod, positive extends @return [-1..1]
  virtual double lever(int cylinder, double speed) const = 0;
  /// Rod speed at full lever where no other cylinder takes the pump's flow. [m/s]
  virtual double full_speed(int cylinder, bool extend) const = 0;
};

/// Power of the pumps in a motion, as the learned model predicts it.
class PowerModel {
 public:
  virtual ~PowerModel() = default;
  virtual double power(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, double payload) = 0;
};

/// Gives energy-optimal motions.
class MotionSource {
 public:
  virtual ~MotionSource() = default;
  /// The motion of a task from where it was expected to begin. @throws ControllerFailure when there is none
  virtual Trajectory motion(const Task& task) = 0;
  /// A motion to the same goal from where the machine is now, in the time that is left; nothing when none is found.
  /// @param current the motion that is followed @param t [s] since it began
  virtual std::optional<Trajectory> motion_from(const Task& task, const Measurement& now,
                                                const Trajectory& current, double t) = 0;
};

/// What every controller knows. Nothing is owned.
struct Knowledge {
  const Machine* machine = nullptr;
  const ValveModel* valves = nullptr;
  PowerModel* power = nullptr;      ///< null: there is no learned model
  MotionSource* motions = nullptr;  ///< null: the same
  double sample_time = 0.02;        ///< [s]
};

/// A controller that cannot go on; the sentence stands in the row of its run.
class ControllerFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Controller {
 public:
  virtual ~Controller() = default;
  /// A new task begins. @throws ControllerFailure
  virtual void begin(const Task& task, const Measurement& now) = 0;
  /// Levers [-1..1] by cylinder until the next sample. @throws ControllerFailure
  virtual std::vector<double> step(const Measurement& now) = 0;
  /// Where the tip should be now, for controllers that follow a path. [m]
  virtual std::optional<Eigen::Vector3d> intended_tip() const { return std::nullopt; }
};

}  // namespace sparflow::control
