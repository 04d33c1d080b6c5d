#include "identification/mapping_proposal/evidence/position_evidence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// What a sensor of the joint or of its cylinder can show.
struct Travel {
  Range range;           ///< [rad] or [m]
  double largest_speed;  ///< [rad/s] or [m/s]
  const char* unit;
};

Travel joint_travel(const Joint& joint) {
  return {joint.position, std::max(joint.velocity.hi, -joint.velocity.lo),
          joint.type == JointType::kRevolute ? "rad" : "m"};
}

/// Stroke range of a cylinder, from samples of its linkage over the joint's range.
Travel stroke_travel(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const Joint& joint = machine.joints[static_cast<std::size_t>(c.joint)];
  Travel t = joint_travel(joint);
  const double joint_speed = t.largest_speed;
  t = {{1e300, -1e300}, 0.0, "m"};
  constexpr int kSamples = 17;
  for (int k = 0; k < kSamples; ++k) {
    const double q =
        joint.position.lo + (joint.position.hi - joint.position.lo) * k / (kSamples - 1);
    const double x = stroke_at(machine, cylinder, q);
    t.range.lo = std::min(t.range.lo, x);
    t.range.hi = std::max(t.range.hi, x);
    t.largest_speed =
        std::max(t.largest_speed, std::abs(linkage_rates(machine, cylinder, q).d1) * joint_speed);
  }
  return t;
}

/// Range, rate and roughness of values in SI against the travel.
std::pair<double, std::string> travel_score(const ProposalData& data, int channel,
                                            const VectorXd& values, const Travel& travel,
                                            const PositionOptions& o) {
  std::string words;
  const double width = std::max(travel.range.hi - travel.range.lo, 1e-9);
  const double lo = quantile(values, 0.005), hi = quantile(values, 0.995);
  const double outside =
      (std::max(0.0, travel.range.lo - lo) + std::max(0.0, hi - travel.range.hi)) / width;
  const VectorXd rate = rate_of_change(data.samples, values).cwiseAbs();
  const double fast = quantile(rate, 0.98) / std::max(travel.largest_speed, 1e-9);
  const double off = std::log(std::max(fast, 1e-6) / o.usual_rate) / o.rate_spread;
  // A joint that was not moved is no contradiction, one that is too fast is.
  const double speed_loss = std::min(0.5 * off * off, off < 0.0 ? 2.5 : o.outside);
  const double rough = data.shape(channel).roughness;
  // Noise about one value is no motion of its own: it counts by the part of the range that it covers.
  const double covered = std::min(1.0, (hi - lo) / (o.rough_span * width));
  const double rough_loss =
      data.shape(channel).constant
          ? 0.0
          : covered * std::min(o.outside, 25.0 * std::max(0.0, rough - o.rough));
  const double outside_loss = o.outside * std::min(1.0, outside / o.outside_share);
  const double span = 0.5 * std::log(std::min(1.0, (hi - lo) / width) + 0.05) + 0.5;
  if (outside < 0.02) {
    words = fmt::format("{:.3g} to {:.3g} {} lie in the range {:.3g} to {:.3g} {}", lo, hi,
                        travel.unit, travel.range.lo, travel.range.hi, travel.unit);
  } else {
    words =
        fmt::format("{:.3g} to {:.3g} {} leave the range {:.3g} to {:.3g} {} by {:.2g} %", lo, hi,
                    travel.unit, travel.range.lo, travel.range.hi, travel.unit, 100.0 * outside);
  }
  return {o.fits + span - outside_loss - speed_loss - rough_loss, words};
}

bool joint_positions(const Machine& machine, int cylinder, VectorXd* stroke) {
  for (double& x : *stroke) {
    try {
      x = joint_at_stroke(machine, cylinder, x);
    } catch (const std::domain_error&) {
      return false;
    }
  }
  return true;
}

}  // namespace

VectorXd speed_of(const ProposalData& data, int joint, const VectorXd& position) {
  const Machine& machine = *data.machine;
  const int cylinder = machine.cylinder_of_joint(joint);
  VectorXd speed = rate_of_change(data.samples, position);
  if (cylinder < 0) return speed;
  const Range& range = machine.joints[static_cast<std::size_t>(joint)].position;
  for (Eigen::Index i = 0; i < speed.size(); ++i) {
    speed[i] *= linkage_rates(machine, cylinder, std::clamp(position[i], range.lo, range.hi)).d1;
  }
  return speed;
}

std::vector<PositionCandidate> position_candidates(const ProposalData& data, int joint,
                                                   const PositionOptions& o) {
  const Machine& machine = *data.machine;
  const int cylinder = machine.cylinder_of_joint(joint);
  const bool direct =
      cylinder < 0 || std::holds_alternative<DirectLinkage>(
                          machine.cylinders[static_cast<std::size_t>(cylinder)].linkage);
  const bool rack =
      cylinder >= 0 && std::holds_alternative<RackLinkage>(
                           machine.cylinders[static_cast<std::size_t>(cylinder)].linkage);
  std::vector<PositionCandidate> all;
  for (const bool stroke : {false, true}) {
    if (stroke && cylinder < 0) continue;
    const Meaning meaning =
        stroke ? Meaning{Role::kStroke, cylinder} : Meaning{Role::kJointPosition, joint};
    const Travel travel = stroke ? stroke_travel(machine, cylinder)
                                 : joint_travel(machine.joints[static_cast<std::size_t>(joint)]);
    for (const int m : data.considered) {
      const ChannelUnit& given = data.units[static_cast<std::size_t>(m)];
      std::vector<std::string> reasons;
      const double said = data.said(m, meaning, &reasons);
      const std::vector<ChannelUnit> one = {given};
      const std::vector<ChannelUnit>& possible = possible_units(meaning, machine);
      const bool known = std::any_of(possible.begin(), possible.end(),
                                     [&](const ChannelUnit& u) { return u.of == given.of; });
      for (const ChannelUnit& unit : known ? one : possible) {
        VectorXd values = data.samples.values.col(m) * unit.factor;
        const auto [fit, words] = travel_score(data, m, values, travel, o);
        PositionCandidate c;
        c.joint = joint;
        // The stroke of a rack is the joint's position in another unit, and rarely logged.
        const double rare = rack && stroke ? o.rare : 0.0;
        c.reading = {m, unit, stroke, said + fit - rare, said, reasons};
        c.reading.reasons.push_back(words);
        if (c.reading.score <= -o.missing) continue;
        c.position = std::move(values);
        all.push_back(std::move(c));
      }
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const PositionCandidate& a, const PositionCandidate& b) {
                     return a.reading.score > b.reading.score;
                   });
  // Where stroke and joint position are the same, one reading of a channel is enough.
  std::vector<PositionCandidate> kept;
  kept.reserve(static_cast<std::size_t>(o.candidates));
  for (PositionCandidate& c : all) {
    const bool same =
        direct && std::any_of(kept.begin(), kept.end(), [&](const PositionCandidate& k) {
          return k.reading.channel == c.reading.channel &&
                 k.reading.unit.factor == c.reading.unit.factor;
        });
    if (same) continue;
    if (c.reading.stroke && !direct && !joint_positions(machine, cylinder, &c.position)) continue;
    c.speed = speed_of(data, joint, c.position);
    const Joint& j = machine.joints[static_cast<std::size_t>(joint)];
    const double limit = std::max(j.velocity.hi, -j.velocity.lo);
    // Noise has a rate as well, but covers nothing.
    const double span = quantile(c.position, 0.995) - quantile(c.position, 0.005);
    c.moves =
        quantile(rate_of_change(data.samples, c.position).cwiseAbs(), 0.98) > o.resting * limit &&
        span > o.resting * (j.position.hi - j.position.lo);
    kept.push_back(std::move(c));
    if (static_cast<int>(kept.size()) >= o.candidates) break;
  }
  return kept;
}

}  // namespace sparflow
