/// An operator who moves all levers at once, each at the share that lets all arrive together.
#include <algorithm>
#include <cmath>

#include "simulator/controllers/goal_posture.h"
#include "simulator/controllers/operator_hands.h"

namespace sparflow::control {
namespace {

class SimultaneousOperator : public Operator {
 public:
  using Operator::Operator;

  void begin(const Task& task, const Measurement& now) override {
    aim(task, now);
    const double pauses = kReaction + kLeverTime + 1.0 / gains_.approach;
    const double time = std::max(time_for(task, pauses), least_time(know_, now.q, goal_, true));
    cruise_.clear();
    for (int c = 0; c < know_.machine->cylinder_count(); ++c)
      cruise_.push_back(std::abs(way_left(c, now.q)) / time);
  }

  std::vector<double> step(const Measurement& now) override {
    const Eigen::VectorXd& q = seen_.look(now);
    std::vector<double> wanted(know_.machine->cylinders.size(), 0.0);
    for (int c = 0; c < know_.machine->cylinder_count(); ++c) {
      const auto k = static_cast<std::size_t>(c);
      const double left = way_left(c, q);
      // a rod that has fallen short is brought in no slower than the hand can be held steady
      const double least = kSteady * know_.valves->full_speed(c, left > 0.0);
      wanted[k] = lever(c, left, std::max(cruise_[k], least));
    }
    return hands_.move(wanted);
  }

 private:
  std::vector<double> cruise_;  // [m/s] by cylinder
};

}  // namespace

ControllerInfo simultaneous_operator_info() {
  return {.name = "simultaneous_operator",
          .words = "operator who moves all levers at once",
          .gains = OperatorGains::table(),
          .make = made<SimultaneousOperator>};
}

}  // namespace sparflow::control
