#include "models/effects/memory.h"

#include <algorithm>
#include <cmath>

namespace sparflow {

Eigen::VectorXd first_order_lag(const MachineSeries& log, const Eigen::VectorXd& x, double tau) {
  Eigen::VectorXd y = x;
  for (const auto& [first, last] : log.runs) {
    for (Eigen::Index i = first + 1; i < last; ++i) {
      if (!std::isfinite(y[i - 1])) continue;  // nothing known before: start here
      const double keep = std::exp(-(log.time[i] - log.time[i - 1]) / tau);
      const double target = std::isfinite(x[i]) ? x[i] : y[i - 1];
      y[i] = target + keep * (y[i - 1] - target);
    }
  }
  return y;
}

Eigen::VectorXd delayed(const MachineSeries& log, const Eigen::VectorXd& x, double delay) {
  Eigen::VectorXd y = x;
  for (const auto& [first, last] : log.runs) {
    Eigen::Index k = first;
    for (Eigen::Index i = first; i < last; ++i) {
      const double t = std::clamp(log.time[i] - delay, log.time[first], log.time[last - 1]);
      while (k + 2 < last && log.time[k + 1] < t) ++k;
      while (k > first && log.time[k] > t) --k;
      if (k + 1 >= last) continue;
      const double w = (t - log.time[k]) / (log.time[k + 1] - log.time[k]);
      y[i] = (1.0 - w) * x[k] + w * x[k + 1];
    }
  }
  return y;
}

}  // namespace sparflow
