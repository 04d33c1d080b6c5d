// Checks that compare a channel with the others at the same time: jumps that return, single wild samples, and commands
// that the machine does not follow.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "identification/data_checks/bad_data_checks.h"
#include "models/math/linear_algebra.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Whether another channel explains a step between samples k and k+1: a peer steps too, or a command starts, ends or steps
/// nearby.
class OtherChannels {
 public:
  OtherChannels(const CheckContext& context, std::size_t channel) : context_(context) {
    const CheckedChannel& c = context.channels[channel];
    for (std::size_t i = 0; i < context.channels.size(); ++i) {
      if (i == channel) continue;
      const CheckedChannel& other = context.channels[i];
      if (other.channel->role == Role::kCommand) commands_.push_back(i);
      if (!c.family.empty() && other.family == c.family) peers_.push_back(i);
    }
  }

  bool explain(Index k, double step) const {
    const BadDataOptions& options = context_.options;
    const Index near = options.near_samples;
    const Index n = context_.log.samples();
    for (Index i = std::max<Index>(0, k - near); i <= std::min(n - 2, k + near); ++i) {
      for (const std::size_t c : commands_) {
        const VectorXd& u = context_.channels[c].channel->values;
        const double change = std::abs(u[i + 1] - u[i]);
        const bool starts = (u[i] == 0.0) != (u[i + 1] == 0.0);
        if (starts || change > context_.channels[c].least_jump) return true;
      }
      for (const std::size_t t : peers_) {
        const VectorXd& y = context_.channels[t].channel->values;
        const double noise = context_.noise[t].typical;
        const double least =
            std::max(options.other_noise * noise, options.peer_step_share * std::abs(step));
        if (std::abs(y[i + 1] - y[i]) > least) return true;
      }
    }
    return false;
  }

  /// @return whether a command changes: a lever that leaves the valve's dead band makes the pump pressure step
  bool lever_moves(Index k) const {
    const BadDataOptions& options = context_.options;
    return std::any_of(commands_.begin(), commands_.end(), [&](std::size_t c) {
      const VectorXd& u = context_.channels[c].channel->values;
      const double change = std::abs(u[k + 1] - u[k]);
      return change > std::max(options.lever_step, options.other_noise * context_.noise[c].typical);
    });
  }

 private:
  const CheckContext& context_;
  std::vector<std::size_t> peers_, commands_;
};

struct Step {
  Index at = 0;       ///< between samples `at` and `at` + 1
  double size = 0.0;  ///< [unit]
};

/// @return [samples] noise of each sample's block, at least the channel's typical noise
VectorXd local_noise(const NoiseProfile& noise, Index samples) {
  VectorXd out = VectorXd::Constant(samples, noise.typical);
  for (std::size_t b = 0; b < noise.blocks.size(); ++b) {
    const double level = noise.level[static_cast<Index>(b)];
    const SampleRange& block = noise.blocks[b];
    if (level > noise.typical) out.segment(block.begin, block.size()).setConstant(level);
  }
  return out;
}

/// @return whether a step is one of several in a row of the same sign and similar size, as a chamber that fills
///   causes them
bool is_on_a_ramp(const VectorXd& x, const SampleRange& run, Index k,
                  const BadDataOptions& options) {
  const double size = x[k + 1] - x[k];
  int in_a_row = 1;
  for (const int way : {-1, 1}) {
    for (Index i = k + way; i >= run.begin && i + 1 < run.end; i += way) {
      if (!((x[i + 1] - x[i]) / size > options.ramp_share)) break;
      if (++in_a_row == options.ramp_steps) return true;
    }
  }
  return false;
}

/// @return whether a step is the steepest part of a signal that moves by itself, as a pump that hunts does within a few samples
bool is_part_of_a_slope(const VectorXd& x, const SampleRange& run, Index k,
                        const BadDataOptions& options) {
  const auto step = [&](Index i) {
    return i >= run.begin && i + 1 < run.end ? x[i + 1] - x[i] : 0.0;
  };
  return 0.5 * (step(k - 1) + step(k + 1)) / step(k) > options.local_slope_share;
}

/// @return steps between two samples that are large for the channel and that no other channel explains
std::vector<Step> unexplained_steps(const CheckContext& context, std::size_t channel) {
  const CheckedChannel& c = context.channels[channel];
  const VectorXd& x = c.channel->values;
  const VectorXd noise = local_noise(context.noise[channel], x.size());
  const bool position = c.family == "position";
  const OtherChannels others(context, channel);
  std::vector<Step> out;
  for (const SampleRange& run : context.log.runs) {
    for (Index k = run.begin; k + 1 < run.end; ++k) {
      const double size = x[k + 1] - x[k];
      const double limit =
          std::max(context.options.jump_noise * std::max(noise[k], noise[k + 1]), c.least_jump) +
          context.options.jump_speed_ratio * c.fastest *
              (context.log.time[k + 1] - context.log.time[k]);
      if (!(std::abs(size) > limit)) continue;
      // No load or valve moves a joint that far within a sample, so other channels cannot explain steps of positions.
      if (!position && (is_on_a_ramp(x, run, k, context.options) ||
                        is_part_of_a_slope(x, run, k, context.options) || others.explain(k, size)))
        continue;
      out.push_back({k, size});
    }
  }
  return out;
}

/// @return smallest nonzero step between samples, 0 for a constant channel
double resolution(const VectorXd& x) {
  double least = std::numeric_limits<double>::infinity();
  for (Index k = 0; k + 1 < x.size(); ++k) {
    const double step = std::abs(x[k + 1] - x[k]);
    if (step > 0.0) least = std::min(least, step);
  }
  return std::isfinite(least) ? least : 0.0;
}

/// @return whether so many samples are wild that they are a fault
bool is_wild(const CheckContext& context, const Mask& wild) {
  const auto fewest = std::max(context.options.wild_fewest,
                               context.options.wild_share * static_cast<double>(wild.size()));
  return static_cast<double>(wild.count()) >= fewest;
}

/// Marks samples far off the median of those around them (F. R. Hampel (1974), J. Am. Stat. Assoc. 69, 383-393): up to three wild
/// ones of seven hardly move it, and in the middle of a step or a ramp it is the sample itself.
/// @param limit [samples] least distance
void mark_off_median(const VectorXd& x, const SampleRange& run, const VectorXd& limit, Index reach,
                     Mask& out) {
  for (Index k = run.begin + reach; k + reach < run.end; ++k)
    out[k] = std::abs(x[k] - median(x.segment(k - reach, 2 * reach + 1))) > limit[k];
}

/// Marks samples far off both their neighbours, which agree with each other; inertia and compressibility exclude such
/// signals. A single one may be an impact; many are a fault, however small they are in the channel's units.
Mask wild_samples(const CheckContext& context, std::size_t channel) {
  const CheckedChannel& c = context.channels[channel];
  const VectorXd& x = c.channel->values;
  const OtherChannels others(context, channel);
  Mask out = Mask::Constant(x.size(), false);
  const VectorXd limit =
      (context.options.jump_noise * local_noise(context.noise[channel], x.size()))
          .cwiseMax(context.options.wild_resolution * resolution(x));
  for (const SampleRange& run : context.log.runs) {
    for (Index k = run.begin + 1; k + 1 < run.end; ++k) {
      const double off = std::abs(x[k] - 0.5 * (x[k - 1] + x[k + 1]));
      if (!(off > limit[k])) continue;
      if (std::abs(x[k + 1] - x[k - 1]) > context.options.wild_neighbours * off) continue;
      if (c.family != "position" && others.explain(k - 1, off)) continue;
      out[k] = true;
    }
  }
  if (!is_wild(context, out)) return out;
  // In a channel that is known to have them, they also come in motion, beside motions of a lever, and several in a row.
  out.setConstant(false);
  for (const SampleRange& run : context.log.runs)
    mark_off_median(x, run, limit, context.options.wild_reach_samples, out);
  return out;
}

/// Usual speed at a command in one direction, v = a + b |u|, with a dead band and a gain. [m/s]
struct UsualSpeed {
  double a = 0.0, b = 0.0;
  bool known = false;
  double at(double command) const { return std::max(0.0, a + b * std::abs(command)); }
};

UsualSpeed usual_speed(const CylinderSignals& s, int direction, const BadDataOptions& options) {
  std::vector<double> u, v;
  for (Index k = 0; k < s.speed.size(); ++k) {
    if (!s.driven[k] || s.direction[k] != direction) continue;
    u.push_back(std::abs(s.command[k]));
    v.push_back(std::abs(s.speed[k]));
  }
  UsualSpeed out;
  if (u.size() < options.speed_fewest) return out;
  const auto n = static_cast<Index>(u.size());
  Eigen::MatrixXd x(n, 2);
  x.col(0).setOnes();
  x.col(1) = Eigen::Map<VectorXd>(u.data(), n);
  const VectorXd y = Eigen::Map<VectorXd>(v.data(), n);
  VectorXd weight = VectorXd::Ones(n);
  for (int pass = 0; pass < 5; ++pass) {  // Huber's weights limit the influence of the fault
    const Eigen::MatrixXd wx = weight.asDiagonal() * x;
    const Eigen::Vector2d p = solve_symmetric(transposed_product(x, wx), wx.transpose() * y);
    out.a = p[0];
    out.b = p[1];
    const VectorXd r = y - x * p;
    const double limit = kHuberStds * robust_std(r);
    weight = r.unaryExpr([&](double e) { return huber_weight(e, limit); });
  }
  out.known = out.b > 0.0;
  return out;
}

}  // namespace

std::optional<Finding> check_jumps(const CheckContext& context, std::size_t channel) {
  const BadDataOptions& options = context.options;
  const CheckedChannel& c = context.channels[channel];
  const VectorXd& x = c.channel->values;
  if (c.least_jump <= 0.0) return {};
  // A controller may step a command arbitrarily, also for one sample across a dead band; only repeated short, high pulses
  // are faults.
  const bool command = c.channel->role == Role::kCommand;
  const bool pump = c.channel->role == Role::kPumpPressure;
  const OtherChannels others(context, channel);
  const std::vector<Step> steps = unexplained_steps(context, channel);
  const double noise = context.noise[channel].typical;
  Finding found;
  found.kind = BadDataKind::kJumping;
  found.affected = Mask::Constant(x.size(), false);
  int count = 0;
  bool zero = true;
  double largest = 0.0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    for (std::size_t j = i + 1; j < steps.size(); ++j) {
      if (context.log.time[steps[j].at] - context.log.time[steps[i].at] >
          (command ? options.pulse_s : options.jump_back_s)) {
        break;
      }
      if (command && std::abs(steps[i].size) < options.pulse_height) break;
      const double left = std::abs(steps[i].size + steps[j].size);
      const double alike =
          options.jump_alike_share * std::abs(steps[i].size) + options.jump_alike_noise * noise;
      if (left > alike) continue;
      if (pump &&
          context.log.time[steps[j].at] - context.log.time[steps[i].at] > options.contact_s &&
          others.lever_moves(steps[i].at)) {
        continue;
      }
      const Index first = steps[i].at + 1, length = steps[j].at - steps[i].at;
      found.affected.segment(first, length).setConstant(true);
      zero = zero && (x.segment(first, length).array() == 0.0).all();
      largest = std::max(largest, std::abs(steps[i].size));
      ++count;
      i = j;
      break;
    }
  }
  if (count < (command ? options.pulses : 1)) return {};
  if (zero) found.kind = BadDataKind::kDropOut;
  found.evidence = fmt::format(
      "it {} {} time{} and comes back, by up to {} from one sample to the next, {}",
      zero ? "falls to zero" : "jumps away", count, count == 1 ? "" : "s", in_field(c, largest),
      c.fastest > 0.0 ? fmt::format("where the machine can move by {}",
                                    in_field(c, c.fastest * context.log.step))
                      : fmt::format("while nothing else in the log changes (its noise is {})",
                                    in_field(c, noise)));
  found.remedy = "Check the sensor's cable and plug, and leave these samples out";
  return found;
}

std::optional<Finding> check_wild(const CheckContext& context, std::size_t channel) {
  const BadDataOptions& options = context.options;
  const CheckedChannel& c = context.channels[channel];
  const double noise = context.noise[channel].typical;
  if (c.least_jump <= 0.0 || c.channel->role == Role::kCommand || noise <= 0.0) return {};
  const Mask wild = wild_samples(context, channel);
  if (!is_wild(context, wild)) return {};
  if (!(wild && c.channel->values.array() != 0.0).any())
    return {};  // check_jumps reports these as drop-outs
  Finding found;
  found.kind = BadDataKind::kWild;
  found.affected = wild;
  found.evidence = fmt::format(
      "{} single samples lie more than {:.0f} times its noise ({}) off both their neighbours, "
      "most of them where nothing else in the log changes",
      wild.count(), options.jump_noise, in_field(c, noise));
  found.remedy = "Check the sensor's cable and plug, and leave these samples out";
  return found;
}

/// Flow of the pump that feeds a cylinder, to all that it feeds, from speeds. [samples, m^3/s]
VectorXd flow_of_its_pump(const CheckContext& context, int cylinder) {
  VectorXd total = VectorXd::Zero(context.log.samples());
  const int pump = context.machine.pump_of_cylinder(cylinder);
  if (pump < 0) return total;
  for (const int fed : context.machine.pumps[static_cast<std::size_t>(pump)].feeds)
    total += context.signals.cylinders[static_cast<std::size_t>(fed)].flow;
  return total;
}

std::optional<Finding> check_stuck_command(const CheckContext& context, std::size_t channel) {
  const BadDataOptions& options = context.options;
  const CheckedChannel& c = context.channels[channel];
  if (c.channel->role != Role::kCommand) return {};
  const CylinderSignals& s = context.signals.cylinders[static_cast<std::size_t>(c.cylinder)];
  if (!s.has_command()) return {};  // make_signals has removed it and noted so
  const VectorXd& u = c.channel->values;
  const VectorXd lengths = finite_values(s.length);
  if (lengths.size() == 0) return {};
  const double lo = lengths.minCoeff(), hi = lengths.maxCoeff();
  const double end = options.end_share * (hi - lo);
  const UsualSpeed usual[2] = {usual_speed(s, -1, options), usual_speed(s, 1, options)};
  // A pump whose largest flow is taken leaves the cylinder behind its command.
  const VectorXd flow = flow_of_its_pump(context, c.cylinder);
  const double exhausted = options.exhausted_share * flow.maxCoeff();
  const auto off = [&](Index k) {
    if (!(std::abs(u[k]) > options.firm_command)) return false;
    if (exhausted > 0.0 && flow[k] > exhausted) return false;
    const UsualSpeed& expected = usual[u[k] > 0.0 ? 1 : 0];
    const bool at_end = u[k] > 0.0 ? s.length[k] > hi - end : s.length[k] < lo + end;
    if (!expected.known || at_end) return false;
    const double follows = s.speed[k] * (u[k] > 0.0 ? 1.0 : -1.0) / expected.at(u[k]);
    return follows < options.slowest_following || follows > options.fastest_following;
  };
  Finding found;
  found.affected = Mask::Constant(u.size(), false);
  double longest = 0.0, value = 0.0;
  for (const SampleRange& stretch : constant_stretches(u, context.log)) {
    if (std::abs(u[stretch.begin]) < options.firm_command) continue;
    const double lasts = context.log.time[stretch.end - 1] - context.log.time[stretch.begin];
    if (lasts < options.command_stuck_s) continue;
    Index first = stretch.begin;  // since when it has not followed
    for (Index k = stretch.begin; k < stretch.end; ++k) {
      if (!off(k)) first = k + 1;
      const double since = static_cast<double>(k + 1 - first) * context.log.step;
      // where it does follow, the command is as good as any other
      if (since > options.contradiction_s)
        found.affected.segment(first, k + 1 - first).setConstant(true);
      if (since > longest) {
        longest = since;
        value = u[k];
      }
    }
  }
  if (!found.affected.any()) return {};
  // If the cylinder often does not follow other commands either, the cause is the valve or the pump.
  double others = 0.0, astray = 0.0;
  for (Index k = 0; k < u.size(); ++k) {
    if (found.affected[k] || !(std::abs(u[k]) > options.firm_command)) continue;
    others += 1.0;
    if (off(k)) astray += 1.0;
  }
  if (astray > options.astray_share * others) return {};
  found.kind = BadDataKind::kStuck;
  found.evidence = fmt::format(
      "it stays at exactly {:.3g} while the cylinder, away from its end stops, does not follow it "
      "for {:.1f} s; elsewhere it follows",
      value, longest);
  found.remedy = "Check where the command is logged, and leave this stretch out";
  return found;
}

}  // namespace sparflow
