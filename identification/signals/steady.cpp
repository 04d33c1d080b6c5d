#include "identification/signals/steady.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace sparflow {

Eigen::VectorXd since_unsteady(const MachineSignals& signals, const CylinderSignals& cylinder,
                               double span) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  Eigen::VectorXd since = Eigen::VectorXd::Constant(signals.samples(), kNever);
  std::vector<double> speeds;
  for (Eigen::Index k = 0; k < signals.samples(); ++k)
    if (cylinder.moving[k] && std::isfinite(cylinder.speed[k]))
      speeds.push_back(std::abs(cylinder.speed[k]));
  if (speeds.empty()) return since;
  const auto middle = speeds.begin() + std::ssize(speeds) / 2;
  std::nth_element(speeds.begin(), middle, speeds.end());
  const double fast = *middle / span;
  for (const SampleRange& run : signals.runs) {
    double changed = -kNever;
    for (Eigen::Index k = run.begin; k < run.end; ++k) {
      if (std::abs(cylinder.acceleration[k]) > fast) changed = signals.time[k];
      since[k] = signals.time[k] - changed;
    }
  }
  return since;
}

}  // namespace sparflow
