#include "models/linkage.h"

#include <cmath>

namespace sparflow {

Taylor3 linkage_rates(const Machine& machine, int cylinder, double q) {
  return cylinder_length(machine, cylinder, Taylor3::variable(q));
}

double stroke_at(const Machine& machine, int cylinder, double q) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  return cylinder_length(machine, cylinder, q) - c.length_at_zero_stroke.value_or(0.0);
}

double joint_at_stroke(const Machine& machine, int cylinder, double stroke, double slack) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const Joint& joint = machine.joints[static_cast<std::size_t>(c.joint)];
  const double length = stroke + c.length_at_zero_stroke.value_or(0.0);
  if (std::holds_alternative<DirectLinkage>(c.linkage)) return length;
  if (const auto* rack = std::get_if<RackLinkage>(&c.linkage)) return length / rack->radius;

  // Widen the range by the slack, but not past where the linkage opens or turns round.
  double lo = joint.position.lo, hi = joint.position.hi;
  const double sign = linkage_rates(machine, cylinder, 0.5 * (lo + hi)).d1 > 0.0 ? 1.0 : -1.0;
  const auto good = [&](double q) {
    try {
      return sign * linkage_rates(machine, cylinder, q).d1 > 0.0;
    } catch (const std::domain_error&) {
      return false;
    }
  };
  for (double s = slack; s > 1e-3; s *= 0.5) {
    if (good(lo - s)) {
      lo -= s;
      break;
    }
  }
  for (double s = slack; s > 1e-3; s *= 0.5) {
    if (good(hi + s)) {
      hi += s;
      break;
    }
  }
  const auto residual = [&](double q) {
    return sign * (cylinder_length(machine, cylinder, q) - length);
  };
  if (residual(lo) > 0.0 || residual(hi) < 0.0) {
    throw std::domain_error("no joint coordinate has this stroke");
  }
  double q = 0.5 * (lo + hi);
  for (int iteration = 0; iteration < 100; ++iteration) {
    const Taylor3 x = linkage_rates(machine, cylinder, q);
    const double r = sign * (x.value - length);
    (r > 0.0 ? hi : lo) = q;
    double next = q - r / (sign * x.d1);
    if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
    if (std::abs(next - q) < 1e-13) return next;
    q = next;
  }
  return q;
}

}  // namespace sparflow
