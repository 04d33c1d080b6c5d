/// Joint PI with velocity feed-forward: a straight joint line to the nearest posture at the goal.
#include "simulator/controllers/goal_posture.h"
#include "simulator/controllers/joint_tracker.h"

namespace sparflow::control {
namespace {

class JointPi : public MotionFollower {
 public:
  using MotionFollower::MotionFollower;

  void begin(const Task& task, const Measurement& now) override {
    const Eigen::VectorXd goal = goal_posture(*know_.machine, task, now.q);
    follow(joint_line(now.q, goal, task.duration), task.begin);
  }
};

}  // namespace

ControllerInfo joint_pi_info() {
  return {.name = "joint_pi",
          .words = "joint PI with velocity feed-forward along a straight joint line",
          .gains = TrackerGains::table(),
          .make = made<JointPi>};
}

}  // namespace sparflow::control
