/// Joint PI with velocity feed-forward: a straight joint line to the nearest posture at the goal.
#include "models/machine/kinematics.h"
#include "simulator/controllers/goal_posture.h"
#include "simulator/controllers/joint_tracker.h"

namespace sparflow::control {
namespace {

class JointPi : public Controller {
 public:
  JointPi(const Knowledge& knowledge, std::span<const double> gains)
      : machine_(*knowledge.machine), tracker_(knowledge, TrackerGains::from(gains)) {}

  void begin(const Task& task, const Measurement& now) override {
    motion_ = joint_line(now.q, goal_posture(machine_, task, now.q), task.duration);
    begin_ = task.begin;
    tracker_.reset();
  }
  std::vector<double> step(const Measurement& now) override {
    tip_ = tip_position<double>(machine_, at_time(motion_, now.t - begin_).q);
    return tracker_.step(motion_, now.t - begin_, now);
  }
  std::optional<Eigen::Vector3d> intended_tip() const override { return tip_; }

 private:
  const Machine& machine_;
  JointTracker tracker_;
  Trajectory motion_;
  double begin_ = 0.0;
  Eigen::Vector3d tip_ = Eigen::Vector3d::Zero();
};

}  // namespace

ControllerInfo joint_pi_info() {
  return {.name = "joint_pi",
          .words = "joint PI with velocity feed-forward along a straight joint line",
          .gains = TrackerGains::table(),
          .make = [](const Knowledge& k, std::span<const double> gains) {
            return std::unique_ptr<Controller>(std::make_unique<JointPi>(k, gains));
          }};
}

}  // namespace sparflow::control
