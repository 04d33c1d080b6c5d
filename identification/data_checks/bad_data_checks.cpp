#include "identification/data_checks/bad_data_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// @return median magnitude of the differences of `order` in the range, scaled to the standard deviation of white noise
///   (the sum of squared binomial coefficients is C(2 order, order)); NaN with fewer than `fewest` differences
double difference_level(const VectorXd& values, SampleRange range, int order, std::size_t fewest) {
  const double scale = order == 3 ? std::sqrt(20.0) : std::sqrt(924.0);
  static constexpr std::array<double, 4> kThird = {-1, 3, -3, 1};
  static constexpr std::array<double, 7> kSixth = {1, -6, 15, -20, 15, -6, 1};
  std::vector<double> size;
  for (Index k = range.begin; k + order < range.end; ++k) {
    double sum = 0.0;
    for (int i = 0; i <= order; ++i) {
      const auto c = static_cast<std::size_t>(i);
      sum += values[k + i] * (order == 3 ? kThird[c] : kSixth[c]);
    }
    if (std::isfinite(sum)) size.push_back(std::abs(sum));
  }
  if (size.size() < fewest) return std::nan("");
  const auto middle = size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2);
  std::nth_element(size.begin(), middle, size.end());
  return 1.4826 * *middle / scale;
}

/// @return the other channels of the same family
std::vector<std::size_t> peers_of(const CheckContext& context, std::size_t channel) {
  std::vector<std::size_t> peers;
  for (std::size_t i = 0; i < context.channels.size(); ++i) {
    if (i != channel && !context.channels[channel].family.empty() &&
        context.channels[i].family == context.channels[channel].family) {
      peers.push_back(i);
    }
  }
  return peers;
}

/// @return upper median of the peers' noise in this channel's unit (of two peers the larger); 0 without peers
double noise_of_peers(const CheckContext& context, std::size_t channel,
                      const std::vector<std::size_t>& peers) {
  std::vector<double> levels;
  levels.reserve(peers.size());
  for (const std::size_t i : peers) {
    levels.push_back(context.noise[i].typical / context.channels[i].scale);
  }
  if (levels.empty()) return 0.0;
  const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
  std::nth_element(levels.begin(), middle, levels.end());
  return *middle * context.channels[channel].scale;
}

/// @return largest ratio of a peer's noise in this block to its typical noise, at least 1; it is large when the machine
///   vibrates
double disturbance_of_peers(const CheckContext& context, const std::vector<std::size_t>& peers,
                            Index block) {
  double most = 1.0;
  for (const std::size_t i : peers) {
    const NoiseProfile& n = context.noise[i];
    if (n.typical > 0.0 && std::isfinite(n.level[block]))
      most = std::max(most, n.level[block] / n.typical);
  }
  return most;
}

/// @return [samples] whether the channel's cylinder (for a pump any cylinder) is commanded or moves
Mask driven(const CheckContext& context, const CheckedChannel& c) {
  Mask out = Mask::Constant(context.log.samples(), false);
  for (std::size_t i = 0; i < context.signals.cylinders.size(); ++i) {
    if (c.cylinder >= 0 && c.cylinder != static_cast<int>(i)) continue;
    out = out || (context.signals.cylinders[i].direction.array() != 0);
  }
  return out;
}

/// Number of steps of a channel and of those that repeat the value, by state of the machine (rest, driven).
struct Repeats {
  std::array<double, 2> equal = {0, 0}, steps = {0, 0};
  void add(const VectorXd& values, const Mask& state, SampleRange range) {
    for (Index k = range.begin; k + 1 < range.end; ++k) {
      if (!std::isfinite(values[k]) || !std::isfinite(values[k + 1])) continue;
      const std::size_t s = state[k] ? 1 : 0;
      steps[s] += 1.0;
      if (values[k] == values[k + 1]) equal[s] += 1.0;
    }
  }
};

/// @return log10 of the probability of the repetitions `inside`, by the frequency of repetitions elsewhere
double log_chance(const Repeats& all, const Repeats& inside, const BadDataOptions& options) {
  double sum = 0.0;
  for (std::size_t s = 0; s < 2; ++s) {
    const double steps = all.steps[s] - inside.steps[s], equal = all.equal[s] - inside.equal[s];
    if (steps < options.fewest_steps) continue;
    const double p = (equal + 1.0) / (steps + 2.0);
    if (p < options.common_repeats) sum += inside.equal[s] * std::log10(p);
  }
  return sum;
}

/// @return whether the channel's cylinder (for a pump any) starts, stops or reverses near a sample, which fills or empties
///   a chamber quickly
bool turns_near(const CheckContext& context, const CheckedChannel& c, Index k) {
  const auto around = static_cast<Index>(
      std::ceil(context.options.valve_answer_s / std::max(context.log.step, 1e-9)));
  for (std::size_t i = 0; i < context.signals.cylinders.size(); ++i) {
    if (c.cylinder >= 0 && c.cylinder != static_cast<int>(i)) continue;
    const Eigen::VectorXi& direction = context.signals.cylinders[i].direction;
    const Index last = std::min(k + around, direction.size() - 1);
    for (Index j = std::max<Index>(1, k - around); j <= last; ++j) {
      if (direction[j] != direction[j - 1]) return true;
    }
  }
  return false;
}

/// @return whether a stretch at the end of the range was entered and left by small steps or by a start, stop or reversal of
///   the machine; a faulty sensor does so at arbitrary times
bool reached_by_machine(const CheckContext& context, const CheckedChannel& c,
                        const VectorXd& values, SampleRange s, double gentle) {
  const auto by_machine = [&](Index k) {  // from k - 1 to k
    return k <= 0 || k >= values.size() || std::abs(values[k] - values[k - 1]) < gentle ||
           turns_near(context, c, k);
  };
  return by_machine(s.begin) && by_machine(s.end);
}

/// Finds a channel that never changes although its cylinder moves in both directions; its frequency of repetitions is no
/// reference then.
std::optional<Finding> constant_throughout(const CheckContext& context, std::size_t channel) {
  const CheckedChannel& c = context.channels[channel];
  const VectorXd& values = c.channel->values;
  if (c.family.empty() || c.cylinder < 0 || !values.array().isFinite().any()) return {};
  const VectorXd known = finite_values(values);
  if (known.maxCoeff() != known.minCoeff()) return {};
  const CylinderSignals& s = context.signals.cylinders[static_cast<std::size_t>(c.cylinder)];
  const bool position = c.family == "position";
  if (position && !s.has_command()) return {};
  double ways[2] = {0.0, 0.0};
  for (Index k = 0; k < s.direction.size(); ++k) {
    if (position ? std::abs(s.command[k]) > context.options.firm_command
                 : static_cast<bool>(s.moving[k])) {
      ways[s.direction[k] > 0 ? 1 : 0] += context.log.step;
    }
  }
  if (std::min(ways[0], ways[1]) < context.options.stuck_s) return {};
  Finding found;
  const bool zero = known[0] == 0.0;
  found.kind = zero ? BadDataKind::kDropOut : BadDataKind::kStuck;
  found.affected = values.array().isFinite();
  found.evidence = fmt::format(
      "it is {} in the whole log, while {} {} for {:.0f} s in both directions",
      in_field(c, known[0]), context.machine.cylinders[static_cast<std::size_t>(c.cylinder)].name,
      position ? "is commanded" : "moves", ways[0] + ways[1]);
  found.remedy = "Check that the sensor is connected, or remove the column from the log";
  return found;
}

/// The same for the pressure of a load-sensing pump, whose cylinders move and rest.
std::optional<Finding> pump_constant_throughout(const CheckContext& context, std::size_t channel) {
  const Channel& c = *context.channels[channel].channel;
  if (c.role != Role::kPumpPressure) return {};
  const Pump& pump = context.machine.pumps[static_cast<std::size_t>(c.index)];
  const VectorXd known = finite_values(c.values);
  if (pump.type != PumpType::kLoadSensing || known.size() == 0 ||
      known.maxCoeff() != known.minCoeff())
    return {};
  double moves = 0.0, rests = 0.0;
  for (Index k = 0; k < context.log.samples(); ++k) {
    const bool any = std::any_of(pump.feeds.begin(), pump.feeds.end(), [&](int i) {
      return static_cast<bool>(context.signals.cylinders[static_cast<std::size_t>(i)].moving[k]);
    });
    (any ? moves : rests) += context.log.step;
  }
  if (std::min(moves, rests) < context.options.stuck_s) return {};
  Finding found;
  found.kind = known[0] == 0.0 ? BadDataKind::kDropOut : BadDataKind::kStuck;
  found.affected = c.values.array().isFinite();
  found.evidence = fmt::format(
      "it is {} in the whole log, while cylinders of this load-sensing pump move for {:.0f} s and "
      "all "
      "rest for {:.0f} s",
      in_field(context.channels[channel], known[0]), moves, rests);
  found.remedy =
      "Check that the sensor is connected, remove the column from the log, or write type: "
      "constant_pressure if the supply is one";
  return found;
}

}  // namespace

std::string in_field(const CheckedChannel& channel, double value) {
  return fmt::format("{:.3g}{}{}", value / channel.field, channel.field_unit.empty() ? "" : " ",
                     channel.field_unit);
}

VectorXd finite_values(const VectorXd& values) {
  VectorXd out(values.size());
  Index n = 0;
  for (const double v : values) {
    if (std::isfinite(v)) out[n++] = v;
  }
  out.conservativeResize(n);
  return out;
}

NoiseProfile noise_profile(const VectorXd& values, const Log& log, const BadDataOptions& options) {
  NoiseProfile out;
  const auto size = static_cast<Index>(
      std::max(options.block_fewest, options.block_s / std::max(log.step, 1e-9)));
  for (const SampleRange& run : log.runs) {
    for (Index k = run.begin; k < run.end; k += size) {
      out.blocks.push_back({k, std::min(k + size, run.end)});
    }
  }
  const auto count = static_cast<Index>(out.blocks.size());
  out.level.resize(count);
  out.whiteness.resize(count);
  for (Index b = 0; b < count; ++b) {
    const SampleRange& block = out.blocks[static_cast<std::size_t>(b)];
    out.level[b] = difference_level(values, block, 3, options.fewest_differences);
    const double sixth = difference_level(values, block, 6, options.fewest_differences);
    out.whiteness[b] = out.level[b] > 0.0 ? sixth / out.level[b] : 0.0;
  }
  const VectorXd known = finite_values(out.level);
  out.typical = median(known);
  out.quiet = quantile(known, options.quiet_quantile);
  return out;
}

std::vector<SampleRange> constant_stretches(const VectorXd& values, const Log& log) {
  std::vector<SampleRange> out;
  for (const SampleRange& run : log.runs) {
    Index begin = run.begin;
    for (Index k = run.begin + 1; k <= run.end; ++k) {
      if (k < run.end && values[k] == values[begin]) continue;  // NaN equals nothing
      if (k - begin > 1) out.push_back({begin, k});
      begin = k;
    }
  }
  return out;
}

std::optional<Finding> check_missing(const CheckContext& context, std::size_t channel) {
  const VectorXd& values = context.channels[channel].channel->values;
  Finding found;
  found.kind = BadDataKind::kDropOut;
  found.affected = !values.array().isFinite();
  const double share = found.affected.cast<double>().mean();
  if (share < context.options.missing_share || share == 1.0) return {};
  found.evidence = fmt::format("{:.0f} % of its samples have no value", 100.0 * share);
  found.remedy = "Check cable and logger, or cut the stretches out of the log";
  return found;
}

std::optional<Finding> check_noise(const CheckContext& context, std::size_t channel) {
  const BadDataOptions& options = context.options;
  const CheckedChannel& c = context.channels[channel];
  const NoiseProfile& noise = context.noise[channel];
  const std::vector<std::size_t> peers = peers_of(context, channel);
  const double peer_noise = noise_of_peers(context, channel, peers);
  const bool few = peers.size() < 2;
  const double caution = peers.size() == 1 ? options.single_peer_ratio : 1.0;
  const double least = few && c.family == "position"
                           ? std::max(c.least_noise, options.shaking_share * c.scale)
                           : c.least_noise;
  const bool has_peers = peer_noise > 0.0;
  const double reference = has_peers ? peer_noise : noise.quiet;
  const double ratio = options.noise_ratio * caution;
  const bool throughout =
      has_peers && noise.typical > options.throughout_share * ratio * peer_noise;
  const auto noisy = [&](double level) {
    if (!has_peers) return level > ratio * noise.quiet;
    const double share = throughout ? options.throughout_block_share : 1.0;
    if (level > share * ratio * peer_noise) return true;
    return noise.quiet > 0.0 && level > options.burst_own_ratio * ratio * noise.quiet &&
           level > options.burst_peer_share * ratio * peer_noise;
  };
  Finding found;
  found.kind = BadDataKind::kNoisy;
  found.affected = Mask::Constant(context.log.samples(), false);
  double seconds = 0.0, worst = 0.0, squares = 0.0, blocks = 0.0;
  for (Index b = 0; b < noise.level.size(); ++b) {
    const double level = noise.level[b];
    if (!(level > least && noisy(level))) continue;
    if (!(noise.whiteness[b] > options.least_whiteness)) continue;
    if (reference > 0.0 &&
        level / reference < options.livelier_ratio * disturbance_of_peers(context, peers, b)) {
      continue;
    }
    const SampleRange& block = noise.blocks[static_cast<std::size_t>(b)];
    found.affected.segment(block.begin, block.size()).setConstant(true);
    seconds += static_cast<double>(block.size()) * context.log.step;
    worst = std::max(worst, level);
    squares += level * level;
    blocks += 1.0;
  }
  if (seconds < options.noise_bursts_s || blocks < options.noise_fewest_blocks) return {};
  // Blocks that pass in a channel that is noisy in most of them pass by chance, or at rest at a limit.
  if (throughout) found.affected.setConstant(true);
  const double level = std::sqrt(squares / blocks);
  found.evidence =
      peer_noise > 0.0
          ? fmt::format(
                "its noise there is {} (standard deviation), that of the {} other {} "
                "channel{} is {:.3g} times smaller",
                in_field(c, level), peers.size(), c.family, peers.size() == 1 ? "" : "s",
                level / peer_noise)
          : fmt::format("its noise there is {} (standard deviation), elsewhere in the log {}",
                        in_field(c, level), in_field(c, noise.quiet));
  found.remedy = "Check the sensor, its cable, shield and supply, and record again";
  return found;
}

std::optional<Finding> check_stuck(const CheckContext& context, std::size_t channel) {
  const BadDataOptions& options = context.options;
  const CheckedChannel& c = context.channels[channel];
  const Role role = c.channel->role;
  if (role == Role::kCommand || role == Role::kPayload) return {};  // constant by nature
  if (std::optional<Finding> whole = constant_throughout(context, channel)) return whole;
  if (std::optional<Finding> whole = pump_constant_throughout(context, channel)) return whole;
  const VectorXd& values = c.channel->values;
  const Mask state = driven(context, c);
  const std::vector<SampleRange> stretches = constant_stretches(values, context.log);
  if (stretches.empty()) return {};
  VectorXd lengths(static_cast<Index>(stretches.size()));
  for (Index i = 0; i < lengths.size(); ++i) {
    lengths[i] = static_cast<double>(stretches[static_cast<std::size_t>(i)].size());
  }
  const double usual = quantile(lengths, options.usual_stretch_quantile);
  Repeats all;
  for (const SampleRange& run : context.log.runs) all.add(values, state, run);
  const double limit =
      std::log10(options.stuck_chance / static_cast<double>(context.log.samples()));
  Finding found;
  found.affected = Mask::Constant(context.log.samples(), false);
  SampleRange longest;
  bool zero = true;
  for (const SampleRange& s : stretches) {
    const double seconds = context.log.time[s.end - 1] - context.log.time[s.begin];
    if (seconds < options.stuck_s) continue;
    if (stretches.size() >= options.fewest_stretches &&
        static_cast<double>(s.size()) < options.stretch_ratio * usual)
      continue;
    Repeats inside;
    inside.add(values, state, s);
    if (log_chance(all, inside, options) > limit) continue;
    // A sensor whose range ends at zero is clipped there but not faulty.
    const double gentle = options.jump_noise * context.noise[channel].typical + c.least_jump;
    if (values[s.begin] == 0.0 && reached_by_machine(context, c, values, s, gentle)) continue;
    zero = zero && values[s.begin] == 0.0;
    found.affected.segment(s.begin, s.size()).setConstant(true);
    if (s.size() > longest.size()) longest = s;
  }
  if (longest.size() == 0) return {};
  found.kind = zero ? BadDataKind::kDropOut : BadDataKind::kStuck;
  const double seconds = context.log.time[longest.end - 1] - context.log.time[longest.begin];
  found.evidence = fmt::format(
      "it stays at exactly {} for {:.1f} s, while nine of ten stretches of equal values last at "
      "most {:.0f} samples",
      in_field(c, values[longest.begin]), seconds, usual);
  found.remedy = zero ? "Check the sensor's cable and supply, and leave this stretch out"
                      : "Check the sensor and the logger's update, and leave this stretch out";
  return found;
}

std::optional<Finding> check_saturated(const CheckContext& context, std::size_t channel) {
  const BadDataOptions& options = context.options;
  const CheckedChannel& c = context.channels[channel];
  const Role role = c.channel->role;
  if (role == Role::kCommand || role == Role::kPayload || role == Role::kOilTemperature) return {};
  const VectorXd& values = c.channel->values;
  const VectorXd known = finite_values(values);
  if (known.size() == 0) return {};
  const double lively =
      quantile(finite_values(context.noise[channel].level), options.lively_quantile);
  if (lively < options.noiseless_share * (known.maxCoeff() - known.minCoeff())) return {};
  Repeats all;
  const Mask state = driven(context, c);
  for (const SampleRange& run : context.log.runs) all.add(values, state, run);
  for (const double rail : {known.maxCoeff(), known.minCoeff()}) {
    if (rail == 0.0) continue;  // zero is a physical limit of pressures
    Finding found;
    found.affected = Mask::Constant(context.log.samples(), false);
    Repeats inside;
    int count = 0;
    double seconds = 0.0;
    for (const SampleRange& s : constant_stretches(values, context.log)) {
      if (values[s.begin] != rail || s.size() < options.saturated_shortest) continue;
      inside.add(values, state, s);
      found.affected.segment(s.begin, s.size()).setConstant(true);
      seconds += static_cast<double>(s.size()) * context.log.step;
      ++count;
    }
    if (count < options.saturated_fewest || seconds < options.saturated_s) continue;
    const double steps = all.steps[0] + all.steps[1] - inside.steps[0] - inside.steps[1];
    const double equal = all.equal[0] + all.equal[1] - inside.equal[0] - inside.equal[1];
    if (equal > options.saturated_repeats * steps) continue;
    found.kind = BadDataKind::kSaturated;
    found.evidence = fmt::format("it is cut off at exactly {} {} times, for {:.1f} s in total",
                                 in_field(c, rail), count, seconds);
    found.remedy = "Choose a larger measuring range, or leave these stretches out";
    return found;
  }
  return {};
}

}  // namespace sparflow
