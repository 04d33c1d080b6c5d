/// Resolved-rate tip control whose redundancy is weighed by energy: a joint's weight is the power that the learned model
/// predicts for moving it alone, over its squared rate. This is the local form of the cost of Nurmi and Mattila (2017),
/// Global energy-optimal redundancy resolution of hydraulic manipulators, Energies 10(5), 647, who take pump pressure times
/// flow over the whole path by dynamic programming; of the given path only the instant is known here.
#include <algorithm>
#include <cmath>

#include "simulator/controllers/inverse_kinematics.h"
#include "simulator/controllers/tip_path.h"

namespace sparflow::control {
namespace {

/// Share of the full rate at which a joint's power is asked for.
/// @threshold [-] 0.05..1; chosen: the middle of usual work
constexpr double kAsked = 0.3;
/// Least power of a joint, as share of the largest one's.
/// @threshold [-] 0.001..1; chosen: a joint that costs nothing must not take all of the motion
constexpr double kLeast = 0.05;

class EnergyTipRate : public TipPath {
 public:
  EnergyTipRate(const Knowledge& knowledge, std::span<const double> gains)
      : TipPath(knowledge, gains) {
    if (know_.power == nullptr) throw ControllerFailure("it needs a learned model");
  }

 protected:
  Eigen::VectorXd weights(const Measurement& now, const Eigen::Matrix3Xd& jacobian,
                          const Eigen::Vector3d& v) override {
    Eigen::VectorXd w = full_rate_weights(know_, now.q);
    const Eigen::VectorXd plain = weighted_rates(jacobian, w, v, kTipDamping);
    Eigen::VectorXd power = Eigen::VectorXd::Zero(w.size()), rate = power;
    for (Eigen::Index k = 0; k < w.size(); ++k) {
      rate[k] = kAsked * full_rate(know_, now.q, static_cast<int>(k), plain[k] > 0.0);
      if (rate[k] == 0.0) continue;
      Eigen::VectorXd alone = Eigen::VectorXd::Zero(w.size());
      alone[k] = std::copysign(rate[k], plain[k]);
      power[k] = know_.power->power(now.q, alone, now.payload);
    }
    const double least = kLeast * power.maxCoeff();
    if (!(least > 0.0)) return w;
    const double drop = w.maxCoeff();  // of joints without a drive, which stay as they are
    for (Eigen::Index k = 0; k < w.size(); ++k)
      w[k] =
          rate[k] > 0.0 ? std::max(power[k], least) / (rate[k] * rate[k]) : drop * power.maxCoeff();
    return w;
  }
};

}  // namespace

ControllerInfo energy_tip_rate_info() {
  return {.name = "energy_tip_rate",
          .words = "resolved-rate control of the tip with energy-weighted redundancy",
          .gains = TipGains::table(),
          .needs_model = true,
          .make = made<EnergyTipRate>};
}

}  // namespace sparflow::control
