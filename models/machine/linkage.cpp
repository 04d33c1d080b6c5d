#include "models/machine/linkage.h"

#include <cmath>

namespace sparflow {

namespace {

using Series = TaylorSeries<3>;

/// k + c cos q + s sin q, the form of squared distances and scalar products of a rotating pin's position.
struct Turning {
  double k, c, s;
  Series at(double cosine, double sine) const {
    const double along = c * cosine + s * sine, across = s * cosine - c * sine;
    return Series::from_derivatives({k + along, across, -along, -across});
  }
};

/// A pin of the joint's link in the parent's frame: centre + across cos q + turned sin q.
struct TurningPin {
  TurningPin(const Joint& joint, const Eigen::Vector3d& point) {
    const Eigen::Matrix3d rotation = joint.origin.linear();
    const Eigen::Vector3d along = joint.axis * joint.axis.dot(point);
    centre = joint.origin.translation() + rotation * along;
    across = rotation * (point - along);
    turned = rotation * joint.axis.cross(point);
  }
  /// Squared distance from a fixed point; `across` and `turned` have equal length and are perpendicular.
  Turning distance2(const Eigen::Vector3d& from) const {
    const Eigen::Vector3d d = centre - from;
    return {d.squaredNorm() + across.squaredNorm(), 2.0 * d.dot(across), 2.0 * d.dot(turned)};
  }
  Eigen::Vector3d centre, across, turned;
};

Series four_bar_length(const FourBarLinkage& f, const Joint& joint, double cosine, double sine) {
  using std::sqrt;
  const Eigen::Vector3d axis = joint.origin.linear() * joint.axis;
  TurningPin coupler(joint, f.coupler);
  // w is the vector from rocker to coupler pin, normal to the axis.
  Eigen::Vector3d& centre = coupler.centre;
  centre -= f.rocker;
  centre -= axis * axis.dot(centre);
  const Series w2 = coupler.distance2(Eigen::Vector3d::Zero()).at(cosine, sine);
  const double r = f.rocker_length, k = f.coupler_length;
  // The rod pin is rocker + along w + beside (axis x w), at the rocker's length from the rocker pin.
  const Series inverse = 1.0 / w2;
  const Series along = 0.5 + 0.5 * (r * r - k * k) * inverse;
  const Series beside2 = r * r * inverse - along * along;
  if (!(beside2.value() > 0.0)) throw std::domain_error("the four-bar cannot close");
  const Series beside = sqrt(beside2);
  const Eigen::Vector3d base = f.rocker - f.barrel, across = base.cross(axis);
  const auto product = [&](const Eigen::Vector3d& with) {
    return Turning{with.dot(centre), with.dot(coupler.across), with.dot(coupler.turned)}.at(cosine,
                                                                                            sine);
  };
  // base . (axis x w) = (base x axis) . w
  const double branch = static_cast<double>(f.branch);
  return sqrt(base.squaredNorm() + r * r +
              2.0 * (along * product(base) + beside * product(branch * across)));
}

}  // namespace

/// Revolute joints have a closed form, because the template with three derivatives of every number took a fifth of the
/// time of an optimisation. tests/models/machine/linkage_test.cpp compares the two.
Taylor3 linkage_rates(const Machine& machine, int cylinder, double q) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const Joint& joint = machine.joints[static_cast<std::size_t>(c.joint)];
  const auto* pins = std::get_if<PinsLinkage>(&c.linkage);
  const auto* four_bar = std::get_if<FourBarLinkage>(&c.linkage);
  if (joint.type == JointType::kPrismatic || (pins == nullptr && four_bar == nullptr))
    return cylinder_length(machine, cylinder, Series::variable(q));
  const double cosine = std::cos(q), sine = std::sin(q);
  if (four_bar != nullptr) return four_bar_length(*four_bar, joint, cosine, sine);
  return sqrt(TurningPin(joint, pins->child_pin).distance2(pins->parent_pin).at(cosine, sine));
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

  // The range is widened by the slack, but not beyond where the linkage opens or passes a dead centre.
  double lo = joint.position.lo, hi = joint.position.hi;
  const double sign = linkage_rates(machine, cylinder, 0.5 * (lo + hi)).d1 > 0.0 ? 1.0 : -1.0;
  const auto good = [&](double q) {
    try {
      return sign * linkage_rates(machine, cylinder, q).d1 > 0.0;
    } catch (const std::domain_error&) {
      return false;
    }
  };
  /// Extension of the range below which none is tried.
  /// @threshold [rad or m] 1e-6..0.1; chosen: a linkage that ends so near its range has a dead centre there
  constexpr double kLeastSlack = 1e-3;
  for (double s = slack; s > kLeastSlack; s *= 0.5) {
    if (good(lo - s)) {
      lo -= s;
      break;
    }
  }
  for (double s = slack; s > kLeastSlack; s *= 0.5) {
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
  /// Largest number of steps.
  /// @threshold [1] 60..1000; numerical: each halves the bracket at least where Newton's step leaves it
  constexpr int kMostSteps = 100;
  /// Step below which the iteration has converged.
  /// @threshold [rad or m] 1e-16..1e-8; numerical: some units in the last place
  constexpr double kSettled = 1e-13;
  for (int iteration = 0; iteration < kMostSteps; ++iteration) {
    const Taylor3 x = linkage_rates(machine, cylinder, q);
    const double r = sign * (x.value - length);
    (r > 0.0 ? hi : lo) = q;
    double next = q - r / (sign * x.d1);
    if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
    if (std::abs(next - q) < kSettled) return next;
    q = next;
  }
  return q;
}

}  // namespace sparflow
