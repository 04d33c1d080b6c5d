/// The energy-optimal motion, followed by the joint tracker and planned anew on the way from where the machine then is.
#include "simulator/controllers/joint_tracker.h"

namespace sparflow::control {
namespace {

/// Time between two plans.
/// @threshold [s] 0.2..60; chosen: several plans in a usual move, and each may take a second
constexpr double kPlanEvery = 2.0;
/// Share of the task's time at its end in which nothing is planned anew.
/// @threshold [-] 0..1; chosen: what is left is then braking
constexpr double kLastShare = 0.15;

class ReplannedOptimum : public MotionFollower {
 public:
  using MotionFollower::MotionFollower;

  void begin(const Task& task, const Measurement&) override {
    task_ = task;
    planned_ = task.begin;
    follow(motions().motion(task), task.begin);
  }
  std::vector<double> step(const Measurement& now) override {
    const double left = task_.begin + task_.duration - now.t;
    if (now.t - planned_ > kPlanEvery - 1e-9 && left > kLastShare * task_.duration) {
      planned_ = now.t;
      if (auto next = motions().motion_from(task_, now, motion_, now.t - begin_))
        follow(std::move(*next), now.t, true);
    }
    return MotionFollower::step(now);
  }

 private:
  Task task_;
  double planned_ = 0.0;  // [s]
};

}  // namespace

ControllerInfo replanned_optimum_info() {
  return {.name = "replanned_optimum",
          .words = "energy-optimal motion, tracked and planned anew on the way",
          .gains = TrackerGains::table(),
          .needs_model = true,
          .needs_motion = true,
          .make = made<ReplannedOptimum>};
}

}  // namespace sparflow::control
