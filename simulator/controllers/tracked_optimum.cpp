/// The energy-optimal motion, followed by the joint tracker.
#include "simulator/controllers/joint_tracker.h"

namespace sparflow::control {
namespace {

class TrackedOptimum : public MotionFollower {
 public:
  using MotionFollower::MotionFollower;

  void begin(const Task& task, const Measurement&) override {
    follow(motions().motion(task), task.begin);
  }
};

}  // namespace

ControllerInfo tracked_optimum_info() {
  return {.name = "tracked_optimum",
          .words = "energy-optimal motion, tracked as joint PI tracks its line",
          .gains = TrackerGains::table(),
          .needs_model = true,
          .needs_motion = true,
          .make = made<TrackedOptimum>};
}

}  // namespace sparflow::control
