#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "models/effects/builtin.h"
#include "models/machine/linkage.h"

namespace sparflow {
namespace {

/// Lengths of the cylinder at the ends of its joint's range [m]. There are none where the length is not monotonic in
/// between or the linkage cannot close, because the joint's limits are then no stops of the cylinder.
std::optional<Range> lengths_at_joint_stops(const Machine& machine, int cylinder) try {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const Range& q = machine.joints[static_cast<std::size_t>(c.joint)].position;
  Range x{cylinder_length(machine, cylinder, q.lo), cylinder_length(machine, cylinder, q.hi)};
  if (x.lo > x.hi) std::swap(x.lo, x.hi);
  const double middle = cylinder_length(machine, cylinder, 0.5 * (q.lo + q.hi));
  if (!(x.lo < middle && middle < x.hi)) return std::nullopt;
  return x;
} catch (const std::domain_error&) {
  return std::nullopt;
}

/// Shortest and longest length of the cylinder [m]: where its stroke or the joint's range ends, whichever comes first.
Range length_range(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const std::optional<Range> joint = lengths_at_joint_stops(machine, cylinder);
  constexpr double kNoStop = std::numeric_limits<double>::infinity();
  if (!c.stroke || *c.stroke <= 0.0) return joint.value_or(Range{-kNoStop, kNoStop});
  const double zero = c.length_at_zero_stroke.value_or(0.0);
  const Range stroke{zero, zero + *c.stroke};
  if (!joint) return stroke;
  const Range both{std::max(joint->lo, stroke.lo), std::min(joint->hi, stroke.hi)};
  return both.hi > both.lo ? both : stroke;
}

/// [-] Cushion lengths to search, by stroke: cushions take a few per cent of it, soft stops more.
/// @threshold [1] 0.005..0.5; chosen: steps of a factor of 1.6
constexpr double kShares[] = {0.02, 0.035, 0.06, 0.10, 0.15};

class EndCushion final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "end_cushion",
        .title = "end-of-stroke cushioning",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        .parameters =
            {{"force", "N", 1.0, 0.0, 2e6, 30e3, "force at the end stop", true, {}},
             {"zone",
              "mm",
              1e-3,
              5e-3,
              1.5,
              0.06,
              "length over which the force builds up",
              false,
              {0.02, 0.04, 0.08, 0.15, 0.3, 0.6}},
             {"ends",
              "-",
              1.0,
              -1.0,
              1.0,
              0.0,
              "0: at both ends, 1: at the extended end only, -1: at the retracted end only",
              false,
              {0.0, 1.0, -1.0},
              true,
              false,
              {"at both ends", "at the extended end", "at the retracted end"}}},
        .equation =
            "F = F_static + force ((zone - distance to the stop)/zone)^2 sign(v) inside the "
            "zone, towards the stop only",
        .signals = {"cylinder force or both chamber pressures",
                    "position up to an end of the stroke"},
        .confused_with = {"coulomb_friction", "presliding", "line_loss"},
        .separated_by = "strokes into the end stop and out of it",
        .citation =
            "Murrenhoff (2001), Grundlagen der Fluidtechnik, cylinders; Schwartz, De Negri, "
            "Climaco (2005), J. Braz. Soc. Mech. Sci. & Eng. 27(4), stroke end cushioning",
        .form_error = 0.45,
        .in_motion = "force"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    std::vector<int> found;
    for (int i = 0; i < machine.cylinder_count(); ++i) {
      const Cylinder& c = machine.cylinders[static_cast<std::size_t>(i)];
      const Range& q = machine.joints[static_cast<std::size_t>(c.joint)].position;
      if ((c.stroke && *c.stroke > 0.0) || q.hi > q.lo) found.push_back(i);
    }
    return found;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  std::vector<double> grid(const MachineSeries& log, int at, int shape_index) const override {
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(at)];
    const Range x = length_range(*log.machine, at);
    const double stroke = x.hi - x.lo;
    double longest = x.lo - stroke, shortest = x.hi + stroke;
    for (Eigen::Index k = 0; k < c.length.size(); ++k) {
      if (c.direction[k] > 0 && c.length[k] > longest) longest = c.length[k];
      if (c.direction[k] < 0 && c.length[k] < shortest) shortest = c.length[k];
    }
    const double above = x.hi - longest, below = shortest - x.lo;
    if (shape_index == 0) {  // A log determines only the zones that it has entered.
      std::vector<double> zones;
      for (const double share : kShares) {
        const double zone = std::clamp(share * stroke, 0.01, 0.9 * stroke);
        /// Share of a cushion's length up to which the log must come to the stop.
        /// @threshold [1] 0..1; chosen: a force seen only at the cushion's edge gives no law
        constexpr double kReached = 0.7;
        if (std::min(above, below) < kReached * zone) zones.push_back(zone);
      }
      return zones;
    }
    /// Share of the longest cushion up to which the log must come to a stop.
    /// @threshold [1] 0..1; chosen: a force seen only at the cushion's edge gives no law
    constexpr double kReachedOfLongest = 0.7;
    const double zone = kShares[std::size(kShares) - 1] * stroke;
    const bool up = above < kReachedOfLongest * zone, down = below < kReachedOfLongest * zone;
    if (up && down) return {0.0, 1.0, -1.0};
    if (up) return {1.0};
    return down ? std::vector<double>{-1.0} : std::vector<double>{};
  }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    const int side = s.side[i];
    if (side == 0) return;
    const Range x = length_range(*s.machine, at);
    const double weight = std::clamp(1.0 + side * p[2], 0.0, 1.0);
    const T left = side > 0 ? x.hi - s.length[i] : s.length[i] - x.lo;
    const T depth = 1.0 - left / p[1];
    if (depth > T(0.0)) out[i] += (p[0] * weight * side) * depth * depth;
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

}  // namespace

std::unique_ptr<Effect> make_end_cushion() { return std::make_unique<EndCushion>(); }

}  // namespace sparflow
