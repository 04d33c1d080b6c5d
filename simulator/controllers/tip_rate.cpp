/// Resolved-rate tip control by pseudo-inverse.
#include "simulator/controllers/tip_path.h"

namespace sparflow::control {
namespace {

class TipRate : public TipPath {
 public:
  using TipPath::TipPath;

 protected:
  Eigen::VectorXd weights(const Measurement& now, const Eigen::Matrix3Xd&,
                          const Eigen::Vector3d&) override {
    return full_rate_weights(know_, now.q);
  }
};

}  // namespace

ControllerInfo tip_rate_info() {
  return {.name = "tip_rate",
          .words = "resolved-rate control of the tip along a straight line, by pseudo-inverse",
          .gains = TipGains::table(),
          .make = made<TipRate>};
}

}  // namespace sparflow::control
