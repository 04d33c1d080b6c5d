#pragma once
/// How an operator moves a lever: what is seen is acted on after a reaction time, a lever's way takes time, and near the
/// goal the hand becomes careful.
#include <deque>
#include <span>

#include "simulator/controllers/registry.h"

namespace sparflow::control {

struct OperatorGains {
  /// Speed by which the rest of a rod's way is closed near the goal.
  /// @threshold [1/s] 0.2..5; tuned: studies/controllers/tune_gains.py on problems/scenarios/tuning
  double approach = 1.0;
  /// Share of the time given that the operator means to use; the rest is for care at the end.
  /// @threshold [-] 0.5..1; tuned: studies/controllers/tune_gains.py on problems/scenarios/tuning
  double hurry = 1.0;
  static std::vector<Gain> table();
  static OperatorGains from(std::span<const double> gains) { return {gains[0], gains[1]}; }
};

/// Time between what is seen and what the hand does.
/// @threshold [s] 0..1; cited: Johansson, Rumar (1971), Human Factors 13(1): a median of 0.66 s for a surprise, half of
/// it for what is expected
inline constexpr double kReaction = 0.3;
/// Time of a lever from its middle to its end.
/// @threshold [s] 0..2; chosen: an operator who does not want the load to swing
inline constexpr double kLeverTime = 0.6;

/// Postures as they are seen, a reaction time late.
class Seen {
 public:
  void clear() { past_.clear(); }
  const Eigen::VectorXd& look(const Measurement& now);

 private:
  std::deque<std::pair<double, Eigen::VectorXd>> past_;
};

/// A lever that moves nothing is pushed further, bit by bit, until something moves.
class Push {
 public:
  Push(std::size_t cylinders, double sample_time)
      : more_(cylinders, 0.0),
        last_(cylinders, 0.0),
        since_(cylinders, 0.0),
        sample_time_(sample_time) {}
  /// @param left way left as it is seen [m] @param lever that is meant @return the lever that is held
  double lever(std::size_t cylinder, double left, double lever);

 private:
  std::vector<double> more_, last_, since_;  // [-], [m] and [s] where it was looked at last
  double sample_time_;
};

/// Levers that follow wanted ones no faster than a hand.
class Hands {
 public:
  Hands(std::size_t cylinders, double sample_time)
      : lever_(cylinders, 0.0), most_(sample_time / kLeverTime) {}
  const std::vector<double>& move(const std::vector<double>& wanted);

 private:
  std::vector<double> lever_;
  double most_;
};

/// Rod speed towards a goal at which an operator drives. @param left way left [m] @param cruise [m/s]
double careful_speed(double left, double cruise, double approach);

/// Least share of a task's time that remains for moving, however long reaction and care take.
/// @threshold [-] 0.05..1; chosen: an operator who is late hurries, within what the valves give
inline constexpr double kLeastTime = 0.2;

/// Least share of the full speed at which a lever is held.
/// @threshold [-] 0.01..0.5; chosen: an operator does not creep over a long way, nor hold a lever steadier
inline constexpr double kSteady = 0.05;

/// Way left at which a rod counts as arrived.
/// @threshold [m] 0.0005..0.02; chosen: the tip is then within some centimetres
inline constexpr double kArrived = 0.003;

/// What both operators have in common: eyes that see the posture late, and hands on the levers.
class Operator : public Controller {
 public:
  Operator(const Knowledge& knowledge, std::span<const double> gains);

 protected:
  /// Aims at the posture that ends the task.
  void aim(const Task& task, const Measurement& now);
  /// Time that remains for moving. @param pauses for reaction and care [s] @return [s]
  double time_for(const Task& task, double pauses) const;
  /// Way of a rod from a posture to the goal. [m]
  double way_left(int cylinder, const Eigen::VectorXd& q) const;
  /// The lever that is held for a rod's speed near the goal. @param left way left as it is seen [m] @param cruise [m/s]
  double lever(int cylinder, double left, double cruise);

  Knowledge know_;
  OperatorGains gains_;
  Seen seen_;
  Hands hands_;
  Eigen::VectorXd goal_;

 private:
  Push push_;
};

}  // namespace sparflow::control
