#include "models/effects/hanging_load/pendulum.h"

#include <algorithm>
#include <cmath>

namespace sparflow {

using Eigen::Vector3d;

void Pendulum::move(const Vector3d& from, const Vector3d& to, double dt, const SwingDecay& swing) {
  const int steps = std::max(1, static_cast<int>(std::ceil(dt / swing.largest_step)));
  for (int s = 0; s < steps; ++s) {
    const double a = static_cast<double>(s) / steps, b = static_cast<double>(s + 1) / steps;
    step((1.0 - a) * from + a * to, (1.0 - b) * from + b * to, dt / steps, swing.decay);
  }
}

/// Runge's rule of fourth order; afterwards `down` is of unit length and the rate across it.
void Pendulum::step(const Vector3d& from, const Vector3d& to, double dt, double decay) {
  const Vector3d middle = 0.5 * (from + to);
  const Vector3d v1 = rate, a1 = slope(from, decay);
  const Pendulum p2 = moved(0.5 * dt * v1, 0.5 * dt * a1);
  const Vector3d v2 = p2.rate, a2 = p2.slope(middle, decay);
  const Pendulum p3 = moved(0.5 * dt * v2, 0.5 * dt * a2);
  const Vector3d v3 = p3.rate, a3 = p3.slope(middle, decay);
  const Pendulum p4 = moved(dt * v3, dt * a3);
  const Vector3d v4 = p4.rate, a4 = p4.slope(to, decay);
  down += dt / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
  rate += dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  down.normalize();
  rate -= down * down.dot(rate);
}

}  // namespace sparflow
