/// An operator who moves one cylinder after another, lifting ones first and lowering ones last.
#include <algorithm>

#include "models/machine/kinematics.h"
#include "simulator/controllers/goal_posture.h"
#include "simulator/controllers/operator_hands.h"

namespace sparflow::control {
namespace {

class SequentialOperator : public Operator {
 public:
  using Operator::Operator;

  void begin(const Task& task, const Measurement& now) override {
    aim(task, now);
    order_ = order(now.q);
    at_ = 0;
    const double pauses =
        static_cast<double>(order_.size()) * (2.0 * kReaction + kLeverTime + 1.0 / gains_.approach);
    const double least = least_time(know_, now.q, goal_, false);
    share_ = std::clamp(least / time_for(task, pauses), kSteady, 1.0);
  }

  std::vector<double> step(const Measurement& now) override {
    const Eigen::VectorXd& q = seen_.look(now);
    std::vector<double> wanted(know_.machine->cylinders.size(), 0.0);
    // the next lever is touched when the one before rests; after the last the first one is looked at again
    for (std::size_t tried = 0; tried < order_.size(); ++tried) {
      const int c = order_[at_];
      const double left = way_left(c, q);
      const double held = lever(c, left, share_ * know_.valves->full_speed(c, left > 0.0));
      wanted[static_cast<std::size_t>(c)] = held;
      if (held != 0.0) break;
      at_ = (at_ + 1) % order_.size();
    }
    return hands_.move(wanted);
  }

 private:
  /// Cylinders by how much their way alone raises the tip, those that raise it most first.
  std::vector<int> order(const Eigen::VectorXd& from) const {
    const Machine& machine = *know_.machine;
    std::vector<std::pair<double, int>> rise;
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const int j = machine.cylinders[static_cast<std::size_t>(c)].joint;
      Eigen::VectorXd q = from;
      q[j] = goal_[j];
      rise.emplace_back(machine.gravity.dot(tip_position<double>(machine, q)), c);
    }
    std::sort(rise.begin(), rise.end());
    std::vector<int> cylinders;
    cylinders.reserve(rise.size());
    for (const auto& [height, c] : rise) cylinders.push_back(c);
    return cylinders;
  }

  std::vector<int> order_;
  std::size_t at_ = 0;
  double share_ = 1.0;
};

}  // namespace

ControllerInfo sequential_operator_info() {
  return {.name = "sequential_operator",
          .words = "operator who moves one lever after another",
          .gains = OperatorGains::table(),
          .make = made<SequentialOperator>};
}

}  // namespace sparflow::control
