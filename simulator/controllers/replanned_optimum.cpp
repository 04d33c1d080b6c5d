/// The energy-optimal motion, followed by the joint tracker and planned anew on the way from where the machine then is.
#include "models/machine/kinematics.h"
#include "simulator/controllers/joint_tracker.h"

namespace sparflow::control {
namespace {

/// Time between two plans.
/// @threshold [s] 0.2..60; chosen: several plans in a usual move, and each may take a second
constexpr double kPlanEvery = 2.0;
/// Share of the task's time at its end in which nothing is planned anew.
/// @threshold [-] 0..1; chosen: what is left is then braking
constexpr double kLastShare = 0.15;

class ReplannedOptimum : public Controller {
 public:
  ReplannedOptimum(const Knowledge& knowledge, std::span<const double> gains)
      : know_(knowledge), tracker_(knowledge, TrackerGains::from(gains)) {
    if (know_.motions == nullptr) throw ControllerFailure("it needs a learned model");
  }
  void begin(const Task& task, const Measurement&) override {
    task_ = task;
    motion_ = know_.motions->motion(task);
    begin_ = planned_ = task.begin;
    tracker_.reset();
  }
  std::vector<double> step(const Measurement& now) override {
    const double left = task_.begin + task_.duration - now.t;
    if (now.t - planned_ > kPlanEvery - 1e-9 && left > kLastShare * task_.duration) {
      planned_ = now.t;
      if (auto next = know_.motions->motion_from(task_, now, motion_, now.t - begin_)) {
        motion_ = std::move(*next);
        begin_ = now.t;
      }
    }
    tip_ = tip_position<double>(*know_.machine, at_time(motion_, now.t - begin_).q);
    return tracker_.step(motion_, now.t - begin_, now);
  }
  std::optional<Eigen::Vector3d> intended_tip() const override { return tip_; }

 private:
  Knowledge know_;
  JointTracker tracker_;
  Task task_;
  Trajectory motion_;
  double begin_ = 0.0, planned_ = 0.0;  // [s]
  Eigen::Vector3d tip_ = Eigen::Vector3d::Zero();
};

}  // namespace

ControllerInfo replanned_optimum_info() {
  return {.name = "replanned_optimum",
          .words = "energy-optimal motion, tracked and planned anew on the way",
          .gains = TrackerGains::table(),
          .needs_model = true,
          .needs_motion = true,
          .make = [](const Knowledge& k, std::span<const double> gains) {
            return std::unique_ptr<Controller>(std::make_unique<ReplannedOptimum>(k, gains));
          }};
}

}  // namespace sparflow::control
