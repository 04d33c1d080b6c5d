/// An operator who moves all levers at once, each at the share that lets all arrive together.
#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "simulator/controllers/goal_posture.h"
#include "simulator/controllers/operator_hands.h"

namespace sparflow::control {
namespace {

class SimultaneousOperator : public Controller {
 public:
  SimultaneousOperator(const Knowledge& knowledge, std::span<const double> gains)
      : know_(knowledge),
        gains_(OperatorGains::from(gains)),
        hands_(knowledge.machine->cylinders.size(), knowledge.sample_time),
        push_(knowledge.machine->cylinders.size(), knowledge.sample_time) {}

  void begin(const Task& task, const Measurement& now) override {
    const Machine& machine = *know_.machine;
    goal_ = goal_posture(machine, task, now.q);
    seen_.clear();
    const double pauses = kReaction + kLeverTime + 1.0 / gains_.approach;
    const double time = std::max({0.2 * task.duration, gains_.hurry * task.duration - pauses,
                                  least_time(know_, now.q, goal_, true)});
    cruise_.clear();
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const int j = machine.cylinders[static_cast<std::size_t>(c)].joint;
      cruise_.push_back(
          std::abs(cylinder_length(machine, c, goal_[j]) - cylinder_length(machine, c, now.q[j])) /
          time);
    }
  }

  std::vector<double> step(const Measurement& now) override {
    const Machine& machine = *know_.machine;
    const Eigen::VectorXd& q = seen_.look(now);
    std::vector<double> wanted(machine.cylinders.size(), 0.0);
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const auto k = static_cast<std::size_t>(c);
      const int j = machine.cylinders[k].joint;
      const double left = cylinder_length(machine, c, goal_[j]) - cylinder_length(machine, c, q[j]);
      // a rod that has fallen short is brought in no slower than the hand can be held steady
      const double least = kSteady * know_.valves->full_speed(c, left > 0.0);
      const double speed = careful_speed(left, std::max(cruise_[k], least), gains_.approach);
      wanted[k] = push_.lever(k, left, know_.valves->lever(c, speed));
    }
    return hands_.move(wanted);
  }

 private:
  /// Least share of the full speed at which a lever is held.
  /// @threshold [-] 0.01..0.5; chosen: as that of the operator who moves one lever
  static constexpr double kSteady = 0.05;
  Knowledge know_;
  OperatorGains gains_;
  Hands hands_;
  Push push_;
  Seen seen_;
  Eigen::VectorXd goal_;
  std::vector<double> cruise_;  // [m/s] by cylinder
};

}  // namespace

ControllerInfo simultaneous_operator_info() {
  return {.name = "simultaneous_operator",
          .words = "operator who moves all levers at once",
          .gains = OperatorGains::table(),
          .make = [](const Knowledge& k, std::span<const double> gains) {
            return std::unique_ptr<Controller>(std::make_unique<SimultaneousOperator>(k, gains));
          }};
}

}  // namespace sparflow::control
