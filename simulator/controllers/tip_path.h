#pragma once
/// Resolved-rate control of the tip along a straight line: the tip's speed becomes rates of the joints by a weighted
/// pseudo-inverse. The two controllers of this kind differ in their weights.
/// Source: Whitney (1969), IEEE Trans. Man-Machine Systems 10(2).
#include <span>

#include "simulator/controllers/registry.h"

namespace sparflow::control {

/// Damping of the pseudo-inverse, as share of its core's trace.
/// @threshold [-] 1e-6..0.1; chosen: rates stay within the valves near stretched postures
inline constexpr double kTipDamping = 1e-3;

struct TipGains {
  /// Speed by which an error of the tip is corrected.
  /// @threshold [1/s] 0.1..10; tuned: studies/controllers/tune_gains.py on problems/scenarios/tuning
  double proportional = 0.54;
  /// Growth of that speed while the error stays.
  /// @threshold [1/s2] 0..5; tuned: studies/controllers/tune_gains.py on problems/scenarios/tuning
  double integral = 1.2;
  /// Time by which the speed ahead is taken earlier, as valves follow late.
  /// @threshold [s] 0..0.5; tuned: studies/controllers/tune_gains.py on problems/scenarios/tuning
  double lead = 0.14;
  static std::vector<Gain> table();
  static TipGains from(std::span<const double> gains) { return {gains[0], gains[1], gains[2]}; }
};

class TipPath : public Controller {
 public:
  TipPath(const Knowledge& knowledge, std::span<const double> gains);
  void begin(const Task& task, const Measurement& now) override;
  std::vector<double> step(const Measurement& now) override;
  std::optional<Eigen::Vector3d> intended_tip() const override { return wanted_; }

 protected:
  /// Weights of the joints' squared rates. @param v [m/s] of the tip that is wanted
  virtual Eigen::VectorXd weights(const Measurement& now, const Eigen::Matrix3Xd& jacobian,
                                  const Eigen::Vector3d& v) = 0;
  Knowledge know_;

 private:
  Eigen::VectorXd rates(const Measurement& now, const Eigen::Vector3d& v);

  TipGains gains_;
  Task task_;
  Trajectory line_;  // of the tip, three columns
  Eigen::Vector3d integral_ = Eigen::Vector3d::Zero(), wanted_ = Eigen::Vector3d::Zero();
};

/// The weights of plain resolved-rate control: each joint's rate is weighed by the inverse square of its full rate.
Eigen::VectorXd full_rate_weights(const Knowledge& knowledge, const Eigen::VectorXd& q);
/// Rate of a joint at its cylinder's full speed; 0 without a drive. [rad/s] or [m/s]
double full_rate(const Knowledge& knowledge, const Eigen::VectorXd& q, int joint, bool positive);

}  // namespace sparflow::control
