#include "models/machine/linkage_review.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/machine/linkage.h"
#include "models/machine/static_force.h"

namespace sparflow {
namespace {

/// Positions of a joint at which a branch is looked at.
/// @threshold [1] 11..10001; chosen: a hundredth of the range
constexpr int kReviewSamples = 101;

double at_sample(const Range& range, int k, int count) {
  return range.lo + (range.hi - range.lo) * k / (count - 1.0);
}

/// Worst to best rate; large means that the force grows large at one end of the range.
double unevenness(const FourBarBranch& b) {
  return b.closes && b.least_rate > 0.0 ? b.largest_rate / b.least_rate
                                        : std::numeric_limits<double>::infinity();
}

/// Whether a branch fits the cylinder's stroke, where the file gives both; nothing where it does not.
std::optional<double> misfit(const Cylinder& c, const FourBarBranch& b) {
  if (!c.length_at_zero_stroke || !c.stroke) return {};
  const double end = *c.length_at_zero_stroke + *c.stroke;
  return std::max({0.0, *c.length_at_zero_stroke - b.shortest, b.longest - end});
}

std::string branch_doubt(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const int branch = std::get<FourBarLinkage>(c.linkage).branch;
  const FourBarBranch given = *four_bar_branch(machine, cylinder, branch);
  const FourBarBranch other = *four_bar_branch(machine, cylinder, -branch);
  if (!given.closes || !other.closes) return "";
  const std::string remedy =
      fmt::format("look at it with `sparflow machine` and try branch: {}", -branch);
  /// Misfit of a stroke from which on a branch does not fit the cylinder.
  /// @threshold [m] 1e-3..0.1; chosen: beyond what drawings and pin holes leave open
  constexpr double kMisfit = 0.01;
  const std::optional<double> given_off = misfit(c, given), other_off = misfit(c, other);
  if (given_off && *given_off > kMisfit && *other_off < 0.5 * *given_off) {
    return fmt::format(
        "the four-bar may be on the wrong branch: on this one the length misses the cylinder's "
        "stroke by {:.3f} m, on the other by {:.3f} m; {}",
        *given_off, *other_off, remedy);
  }
  if (given_off && *given_off <= kMisfit && *other_off > kMisfit) return "";
  /// Ratio of both branches' unevenness from which on the less even one is doubted.
  /// @threshold [1] 1.2..10; chosen: knuckles are made to keep the lever arm even over a wide range
  constexpr double kLessEven = 2.0;
  if (unevenness(given) > kLessEven * unevenness(other)) {
    return fmt::format(
        "the four-bar may be on the wrong branch: its lever arm is {:.2g} to {:.2g} m, on the "
        "other branch a more even {:.2g} to {:.2g} m; {}",
        given.least_rate, given.largest_rate, other.least_rate, other.largest_rate, remedy);
  }
  return "";
}

/// A cylinder cannot be shorter, drawn in, than each of its stages is long.
std::string length_doubt(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const Range& range = machine.joints[static_cast<std::size_t>(c.joint)].position;
  const double a = cylinder_length(machine, cylinder, range.lo);
  const double b = cylinder_length(machine, cylinder, range.hi);
  const double shortest = std::min(a, b), longest = std::max(a, b);
  const double most = c.stages + 1.0;
  if (longest <= most * shortest) return "";
  return fmt::format(
      "the length grows from {:.3f} to {:.3f} m; a cylinder of {} stage{} becomes at most {:.0f} "
      "times as long as it is drawn in: check the pins{}",
      shortest, longest, c.stages, c.stages > 1 ? "s" : "", most,
      std::holds_alternative<FourBarLinkage>(c.linkage) ? " and the branch" : "");
}

}  // namespace

Eigen::VectorXd middle_posture(const Machine& machine) {
  Eigen::VectorXd q(machine.joint_count());
  for (int j = 0; j < machine.joint_count(); ++j) {
    const Range& range = machine.joints[static_cast<std::size_t>(j)].position;
    q[j] = 0.5 * (range.lo + range.hi);
  }
  return q;
}

std::vector<LinkageSample> linkage_samples(const Machine& machine, int cylinder,
                                           const Eigen::VectorXd& posture, double payload,
                                           int count) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const Range& range = machine.joints[static_cast<std::size_t>(c.joint)].position;
  StaticForce statics(machine);
  Eigen::VectorXd q = posture;
  std::vector<LinkageSample> samples;
  for (int k = 0; k < count; ++k) {
    q[c.joint] = at_sample(range, k, count);
    LinkageSample s;
    s.q = q[c.joint];
    const Taylor3 x = linkage_rates(machine, cylinder, s.q);
    s.length = x.value;
    s.rate = x.d1;
    s.stroke = stroke_at(machine, cylinder, s.q);
    statics.update(q.data(), 0.0, 0);
    s.force_empty = statics.force()[cylinder];
    statics.update(q.data(), payload, 0);
    s.force_loaded = statics.force()[cylinder];
    samples.push_back(s);
  }
  return samples;
}

std::optional<FourBarBranch> four_bar_branch(const Machine& machine, int cylinder, int branch) {
  Machine changed = machine;
  Cylinder& c = changed.cylinders[static_cast<std::size_t>(cylinder)];
  auto* bar = std::get_if<FourBarLinkage>(&c.linkage);
  if (bar == nullptr) return {};
  bar->branch = branch;
  const Joint& joint = changed.joints[static_cast<std::size_t>(c.joint)];
  FourBarBranch b;
  b.shortest = b.least_rate = std::numeric_limits<double>::infinity();
  double sign = 0.0;
  for (int k = 0; k < kReviewSamples; ++k) {
    const double q = at_sample(joint.position, k, kReviewSamples);
    Taylor3 x;
    try {
      x = linkage_rates(changed, cylinder, q);
    } catch (const std::domain_error&) {
      return FourBarBranch{};
    }
    if (x.d1 * sign < 0.0) return FourBarBranch{};
    sign = x.d1;
    b.shortest = std::min(b.shortest, x.value);
    b.longest = std::max(b.longest, x.value);
    b.least_rate = std::min(b.least_rate, std::abs(x.d1));
    b.largest_rate = std::max(b.largest_rate, std::abs(x.d1));
  }
  b.closes = true;
  return b;
}

std::vector<std::string> linkage_doubts(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const bool bar = std::holds_alternative<FourBarLinkage>(c.linkage);
  std::vector<std::string> doubts;
  if (!bar && !std::holds_alternative<PinsLinkage>(c.linkage)) return doubts;
  if (bar) {
    const std::string branch = branch_doubt(machine, cylinder);
    if (!branch.empty()) doubts.push_back(branch);
  }
  const std::string length = length_doubt(machine, cylinder);
  if (!length.empty()) doubts.push_back(length);
  return doubts;
}

}  // namespace sparflow
