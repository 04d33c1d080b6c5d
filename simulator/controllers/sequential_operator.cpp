/// An operator who moves one cylinder after another, lifting ones first and lowering ones last.
#include <algorithm>
#include <cmath>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "simulator/controllers/goal_posture.h"
#include "simulator/controllers/operator_hands.h"

namespace sparflow::control {
namespace {

/// Least share of the full speed at which a lever is held.
/// @threshold [-] 0.01..0.5; chosen: an operator does not creep over a long way
constexpr double kLeastShare = 0.08;

class SequentialOperator : public Controller {
 public:
  SequentialOperator(const Knowledge& knowledge, std::span<const double> gains)
      : know_(knowledge),
        gains_(OperatorGains::from(gains)),
        hands_(knowledge.machine->cylinders.size(), knowledge.sample_time),
        push_(knowledge.machine->cylinders.size(), knowledge.sample_time) {}

  void begin(const Task& task, const Measurement& now) override {
    goal_ = goal_posture(*know_.machine, task, now.q);
    seen_.clear();
    order_ = order(now.q);
    at_ = 0;
    const double pauses =
        static_cast<double>(order_.size()) * (2.0 * kReaction + kLeverTime + 1.0 / gains_.approach);
    const double time = std::max(0.2 * task.duration, gains_.hurry * task.duration - pauses);
    share_ = std::clamp(least_time(know_, now.q, goal_, false) / time, kLeastShare, 1.0);
  }

  std::vector<double> step(const Measurement& now) override {
    const Machine& machine = *know_.machine;
    const Eigen::VectorXd& q = seen_.look(now);
    std::vector<double> wanted(machine.cylinders.size(), 0.0);
    // the next lever is touched when the one before rests; after the last the first one is looked at again
    for (std::size_t tried = 0; tried < order_.size(); ++tried) {
      const int c = order_[at_];
      const auto k = static_cast<std::size_t>(c);
      const int j = machine.cylinders[k].joint;
      const double left = cylinder_length(machine, c, goal_[j]) - cylinder_length(machine, c, q[j]);
      const double cruise = share_ * know_.valves->full_speed(c, left > 0.0);
      wanted[k] = push_.lever(k, left,
                              know_.valves->lever(c, careful_speed(left, cruise, gains_.approach)));
      if (wanted[k] != 0.0) break;
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

  Knowledge know_;
  OperatorGains gains_;
  Hands hands_;
  Push push_;
  Seen seen_;
  Eigen::VectorXd goal_;
  std::vector<int> order_;
  std::size_t at_ = 0;
  double share_ = 1.0;
};

}  // namespace

ControllerInfo sequential_operator_info() {
  return {.name = "sequential_operator",
          .words = "operator who moves one lever after another",
          .gains = OperatorGains::table(),
          .make = [](const Knowledge& k, std::span<const double> gains) {
            return std::unique_ptr<Controller>(std::make_unique<SequentialOperator>(k, gains));
          }};
}

}  // namespace sparflow::control
