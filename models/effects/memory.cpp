#include "models/effects/memory.h"

#include <algorithm>
#include <cmath>

namespace sparflow {

Eigen::VectorXd first_order_lag(const MachineSeries& log, const Eigen::VectorXd& x, double tau) {
  return first_order_lag(log, x, tau, tau);
}

Eigen::VectorXd first_order_lag(const MachineSeries& log, const Eigen::VectorXd& x, double rising,
                                double falling) {
  Eigen::VectorXd y = x;
  for (const auto& [first, last] : log.runs) {
    for (Eigen::Index i = first + 1; i < last; ++i) {
      if (!std::isfinite(y[i - 1])) continue;  // Without a value before, the run starts here.
      const double target = std::isfinite(x[i]) ? x[i] : y[i - 1];
      // y approaches a constant target from one side.
      const double tau = target > y[i - 1] ? rising : falling;
      const double keep = std::exp(-(log.time[i] - log.time[i - 1]) / tau);
      y[i] = target + keep * (y[i - 1] - target);
    }
  }
  return y;
}

double limited_step(const LagStep& step, double limit, double tau) {
  // Far below its target y rises along a straight line, from there on exponentially.
  const double straight = std::clamp((step.target - limit - step.from) * tau / limit, 0.0, step.dt);
  const double from = step.from + straight * limit / tau;
  return step.target + std::exp(-(step.dt - straight) / tau) * (from - step.target);
}

Eigen::VectorXd limited_lag(const MachineSeries& log, const Eigen::VectorXd& x, double limit,
                            double tau) {
  Eigen::VectorXd y = x;
  for (const auto& [first, last] : log.runs) {
    for (Eigen::Index i = first + 1; i < last; ++i) {
      if (!std::isfinite(y[i - 1])) continue;  // Without a value before, the run starts here.
      const double target = std::isfinite(x[i]) ? x[i] : y[i - 1];
      y[i] = limited_step({y[i - 1], target, log.time[i] - log.time[i - 1]}, limit, tau);
    }
  }
  return y;
}

Eigen::VectorXd second_order_lag(const MachineSeries& log, const Eigen::VectorXd& x,
                                 double frequency, double damping) {
  const double decay = damping * frequency;
  const double swing = frequency * std::sqrt(1.0 - damping * damping);
  Eigen::VectorXd y = x;
  for (const auto& [first, last] : log.runs) {
    double slope = 0.0, target = first < last ? x[first] : 0.0;
    for (Eigen::Index i = first + 1; i < last; ++i) {
      if (!std::isfinite(y[i - 1])) {  // Without a value before, the run starts here.
        target = x[i];
        continue;
      }
      if (std::isfinite(x[i])) target = x[i];
      // e = y - target swings freely over the interval: e'' + 2 decay e' + frequency^2 e = 0.
      const double dt = log.time[i] - log.time[i - 1];
      const double keep = std::exp(-decay * dt), c = std::cos(swing * dt),
                   s = std::sin(swing * dt) / swing;
      const double e = y[i - 1] - target;
      y[i] = target + keep * (e * (c + decay * s) + slope * s);
      slope = keep * (slope * (c - decay * s) - e * frequency * frequency * s);
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

Eigen::VectorXd moving_average(const MachineSeries& log, const Eigen::VectorXd& x,
                               const Eigen::VectorXi& state, double width) {
  Eigen::VectorXd y = x;
  const auto same = [&](Eigen::Index i, Eigen::Index k) {
    return state.size() == 0 || state[i] == state[k];
  };
  for (const auto& [first, last] : log.runs) {
    for (Eigen::Index i = first; i < last; ++i) {
      if (!std::isfinite(x[i])) continue;
      double sum = x[i];
      int count = 1;
      const double half = 0.5 * width;
      Eigen::Index back = i - 1, ahead = i + 1;
      // The window is symmetric, as far as both sides reach, so that a slope is preserved.
      while (back >= first && ahead < last && same(back, i) && same(ahead, i) &&
             log.time[i] - log.time[back] <= half && log.time[ahead] - log.time[i] <= half &&
             std::isfinite(x[back]) && std::isfinite(x[ahead])) {
        sum += x[back--] + x[ahead++];
        count += 2;
      }
      y[i] = sum / count;
    }
  }
  return y;
}

}  // namespace sparflow
