#pragma once
/// Follows joint positions over time: speed ahead through the learned valve model, proportional and integral feedback of
/// the rod's position. Joint PI and the tracked optima are this one controller on different motions (MotionFollower).
#include <span>
#include <vector>

#include "simulator/controllers/registry.h"
#include "simulator/controllers/rest_correction.h"

namespace sparflow::control {

struct TrackerGains {
  /// Speed by which an error of the rod's position is corrected.
  /// @threshold [1/s] 0.1..10; tuned: prediction_study --gains on problems/scenarios/tuning (docs/benchmark.md)
  double proportional = 1.4;
  /// Growth of that speed while the error stays.
  /// @threshold [1/s2] 0..5; tuned: prediction_study --gains on problems/scenarios/tuning (docs/benchmark.md); more hunts
  double integral = 0.1;
  /// Time by which the speed ahead is taken earlier, as valves follow late.
  /// @threshold [s] 0..0.5; tuned: studies/controllers/tune_gains.py on problems/scenarios/tuning
  double lead = 0.2;
  static std::vector<Gain> table();
  static TrackerGains from(std::span<const double> gains);
};

/// A motion at any time: before it begins its first instant, after it ends its last, at rest.
struct MotionInstant {
  Eigen::VectorXd q, qd;
};
MotionInstant at_time(const Trajectory& motion, double t);

/// A straight joint line from rest to rest: constant speed between ramps of a quarter of the time each.
Trajectory joint_line(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double duration);

class JointTracker {
 public:
  JointTracker(const Knowledge& knowledge, const TrackerGains& gains);
  /// Forgets the errors of a motion before.
  void reset();
  /// @param t [s] since the motion began
  std::vector<double> step(const Trajectory& motion, double t, const Measurement& now);

 private:
  /// Speed to ask for of a rod that the motion holds at rest. [m/s]
  double held(int cylinder, double error, const Measurement& now);

  Knowledge know_;
  TrackerGains gains_;
  std::vector<RestCorrection> rest_;  // by cylinder
  std::vector<double> integral_;      // [m/s] by cylinder
  std::vector<int> way_;              // by cylinder: sign of the speed ahead
};

/// A controller that follows a motion of the joints with the joint tracker; which motion, `begin` says.
class MotionFollower : public Controller {
 public:
  MotionFollower(const Knowledge& knowledge, std::span<const double> gains)
      : know_(knowledge), tracker_(knowledge, TrackerGains::from(gains)) {}
  std::vector<double> step(const Measurement& now) override;
  std::optional<Eigen::Vector3d> intended_tip() const override { return tip_; }

 protected:
  /// The source of energy-optimal motions. @throws ControllerFailure without a learned model
  MotionSource& motions() const;
  /// From now on this motion, which begins at the time `begin` [s]. @param goes_on from the one before
  void follow(Trajectory motion, double begin, bool goes_on = false);

  Knowledge know_;
  Trajectory motion_;
  double begin_ = 0.0;  // [s]

 private:
  JointTracker tracker_;
  Eigen::Vector3d tip_ = Eigen::Vector3d::Zero();
};

}  // namespace sparflow::control
