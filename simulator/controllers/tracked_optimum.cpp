/// The energy-optimal motion, followed by the joint tracker.
#include "models/machine/kinematics.h"
#include "simulator/controllers/joint_tracker.h"

namespace sparflow::control {
namespace {

class TrackedOptimum : public Controller {
 public:
  TrackedOptimum(const Knowledge& knowledge, std::span<const double> gains)
      : know_(knowledge), tracker_(knowledge, TrackerGains::from(gains)) {
    if (know_.motions == nullptr) throw ControllerFailure("it needs a learned model");
  }
  void begin(const Task& task, const Measurement&) override {
    motion_ = know_.motions->motion(task);
    begin_ = task.begin;
    tracker_.reset();
  }
  std::vector<double> step(const Measurement& now) override {
    tip_ = tip_position<double>(*know_.machine, at_time(motion_, now.t - begin_).q);
    return tracker_.step(motion_, now.t - begin_, now);
  }
  std::optional<Eigen::Vector3d> intended_tip() const override { return tip_; }

 private:
  Knowledge know_;
  JointTracker tracker_;
  Trajectory motion_;
  double begin_ = 0.0;
  Eigen::Vector3d tip_ = Eigen::Vector3d::Zero();
};

}  // namespace

ControllerInfo tracked_optimum_info() {
  return {.name = "tracked_optimum",
          .words = "energy-optimal motion, tracked as joint PI tracks its line",
          .gains = TrackerGains::table(),
          .needs_model = true,
          .needs_motion = true,
          .make = [](const Knowledge& k, std::span<const double> gains) {
            return std::unique_ptr<Controller>(std::make_unique<TrackedOptimum>(k, gains));
          }};
}

}  // namespace sparflow::control
