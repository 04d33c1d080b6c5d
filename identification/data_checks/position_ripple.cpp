#include "identification/data_checks/position_ripple.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/data_checks/bad_data_checks.h"
#include "models/machine/inertial_torque.h"
#include "models/math/linear_algebra.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The spectra of all signals of a cylinder in one block of time: a parabola is removed, Hann's window applied.
class BlockSpectrum {
 public:
  /// @param hertz [frequencies] of the band, 1 / (length of the block) apart
  BlockSpectrum(const VectorXd& time, SampleRange block, const VectorXd& hertz)
      : block_(block), sines_(2 * hertz.size(), block.size()), trend_(block.size(), 3) {
    const Index n = block.size();
    const VectorXd t =
        time.segment(block.begin, n).array() - 0.5 * (time[block.begin] + time[block.end - 1]);
    trend_.col(0).setOnes();
    trend_.col(1) = t / t[n - 1];
    trend_.col(2) = trend_.col(1).array().square();
    const VectorXd window =
        (M_PI * VectorXd::LinSpaced(n, 0.5, static_cast<double>(n) - 0.5) / static_cast<double>(n))
            .array()
            .sin()
            .square();
    for (Index i = 0; i < hertz.size(); ++i) {
      const auto phase = (2.0 * M_PI * hertz[i] * t).array();
      sines_.row(2 * i) = (2.0 / window.sum() * window.array() * phase.cos()).matrix().transpose();
      sines_.row(2 * i + 1) =
          (2.0 / window.sum() * window.array() * phase.sin()).matrix().transpose();
    }
    weighted_ = window.asDiagonal() * trend_;
    normal_ = transposed_product(trend_, weighted_);
  }

  /// @return [frequencies] squared amplitudes, whose sum over the band is that of a sine; NaN with missing samples
  VectorXd power(const VectorXd& values) const {
    VectorXd x = values.segment(block_.begin, block_.size());
    if (!x.allFinite()) return VectorXd::Constant(sines_.rows() / 2, std::nan(""));
    x -= trend_ * solve_symmetric(normal_, weighted_.transpose() * x);
    const VectorXd parts = sines_ * x;
    // no threshold: equivalent noise bandwidth of Hann's window in units of 1 / (length of the block)
    constexpr double kBandwidth = 1.5;
    VectorXd out(parts.size() / 2);
    for (Index i = 0; i < out.size(); ++i)
      out[i] = (parts[2 * i] * parts[2 * i] + parts[2 * i + 1] * parts[2 * i + 1]) / kBandwidth;
    return out;
  }

 private:
  SampleRange block_;
  MatrixXd sines_, trend_, weighted_;
  MatrixXd normal_;
};

/// @return [kg] or [kg m^2] least inertia about a joint that a position can show: all other joints free, no payload; 0 where the
///   machine's masses do not tell it
double least_inertia(const Machine& machine, const VectorXd& q, int joint) {
  const Index n = q.size();
  MatrixXd mass(n, n);
  for (Index i = 0; i < n; ++i)
    mass.col(i) = inertial_torque<double>(machine, q, VectorXd::Zero(n), VectorXd::Unit(n, i), 0.0);
  if (!mass.allFinite()) return 0.0;
  const Eigen::LDLT<MatrixXd> factor(0.5 * (mass + mass.transpose()));
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0.0)) return 0.0;
  const double inverse = factor.solve(VectorXd::Unit(n, joint))[joint];
  return inverse > 0.0 ? 1.0 / inverse : 0.0;
}

/// Where the spectrum of a position exceeds what is allowed there.
struct Excess {
  double amplitude = 0.0;  ///< [m] of the rod
  double allowed = 0.0;    ///< [m] at the same frequencies
  double speed = 0.0;      ///< [m/s] 2 pi f X
};

/// What one block shows of a position.
struct RippleBlock {
  SampleRange samples;
  bool known = false;
  double amplitude = 0.0;  ///< [m] of the rod, of the band
  double noise = 0.0;      ///< [m] amplitude of the noise between the lines
  Excess sure, edge;       ///< by RippleOptions::allowed_ratio and edge_ratio
  double hertz = 0.0;      ///< of the largest line
  double flatness = 1.0;   ///< geometric over arithmetic mean of the powers
};

struct Rod {
  const CylinderSignals& signals;
  int cylinder = -1, joint = -1;
  bool angle = false;       ///< whether the channel is the joint's position
  double stroke = 0.0;      ///< [m]
  double full_speed = 0.0;  ///< [m/s] the joint's limit
};

/// @return [frequencies] the largest of each value and its two neighbours, over which Hann's window spreads a line
Eigen::ArrayXd spread(const Eigen::ArrayXd& x) {
  Eigen::ArrayXd out = x;
  const Index n = x.size();
  out.head(n - 1) = out.head(n - 1).max(x.tail(n - 1));
  out.tail(n - 1) = out.tail(n - 1).max(x.head(n - 1));
  return out;
}

/// @return [frequencies] [m] amplitude of the rod that force, pressures and command allow; NaN where it is not known
Eigen::ArrayXd allowed_amplitude(const CheckContext& context, const Rod& rod,
                                 const BlockSpectrum& spectrum, const Eigen::ArrayXd& omega,
                                 double mass) {
  Eigen::ArrayXd out = spectrum.power(rod.signals.force).array().sqrt() / (mass * omega.square());
  Eigen::ArrayXd pressure = Eigen::ArrayXd::Zero(omega.size());
  for (const VectorXd* p : {&rod.signals.pressure_a, &rod.signals.pressure_b}) {
    if (p->size() == 0) continue;
    const Eigen::ArrayXd of_chamber = spectrum.power(*p).array().sqrt();
    if (of_chamber.allFinite()) pressure = pressure.max(of_chamber);
  }
  out += rod.stroke / context.options.ripple.softest_oil * pressure;
  if (rod.signals.has_command()) {
    const Eigen::ArrayXd command = spectrum.power(rod.signals.command).array().sqrt();
    if (command.allFinite()) out += rod.full_speed * command / omega;
  }
  return spread(out);
}

/// The part of a spectrum in which the position exceeds what is allowed.
Excess excess(const Eigen::ArrayXd& position, const Eigen::ArrayXd& allowed,
              const Eigen::ArrayXd& omega, double ratio) {
  Excess out;
  double sum = 0.0, bound = 0.0, speed = 0.0;
  for (Index i = 0; i < position.size(); ++i) {
    if (position[i] <= ratio * allowed[i]) continue;
    sum += position[i] * position[i];
    bound += allowed[i] * allowed[i];
    speed += std::pow(omega[i] * position[i], 2);
  }
  out.amplitude = std::sqrt(sum);
  out.allowed = std::sqrt(bound);
  out.speed = std::sqrt(speed);
  return out;
}

void judge_block(const CheckContext& context, const Rod& rod, const VectorXd& values,
                 const VectorXd& hertz, RippleBlock& b) {
  const RippleOptions& options = context.options.ripple;
  const MachineSignals& s = context.signals;
  const Index middle = (b.samples.begin + b.samples.end) / 2;
  const double rate = std::abs(rod.signals.rate[middle]);
  if (!s.q.row(middle).allFinite() || !(rate > 0.0)) return;
  const BlockSpectrum spectrum(s.time, b.samples, hertz);
  const Eigen::ArrayXd position = spectrum.power(values).array().sqrt() * (rod.angle ? rate : 1.0);
  const double inertia = least_inertia(context.machine, s.q.row(middle).transpose(), rod.joint);
  if (!position.allFinite() || !(inertia > 0.0)) return;
  const Eigen::ArrayXd omega = 2.0 * M_PI * hertz.array();
  const Eigen::ArrayXd allowed =
      allowed_amplitude(context, rod, spectrum, omega, inertia / (rate * rate));
  if (!allowed.allFinite()) return;
  b.known = true;
  b.sure = excess(position, allowed, omega, options.allowed_ratio);
  b.edge = excess(position, allowed, omega, options.edge_ratio);
  const Eigen::ArrayXd power = position.square();
  b.amplitude = std::sqrt(power.sum());
  // the median of powers of white noise is log(2) of their mean
  b.noise = std::sqrt(median(power) / std::log(2.0) * static_cast<double>(power.size()));
  Index line = 0;
  power.maxCoeff(&line);
  b.hertz = hertz[line];
  const double mean = power.mean();
  if (mean > 0.0) b.flatness = std::exp((power / mean).max(1e-12).log().mean());
}

std::vector<RippleBlock> judged_blocks(const CheckContext& context, const Rod& rod,
                                       const VectorXd& values) {
  const RippleOptions& options = context.options.ripple;
  const Log& log = context.log;
  const double step = std::max(log.step, 1e-9);
  const double highest = std::min(options.highest_hz, options.sampling_share / step);
  const auto count =
      static_cast<Index>(std::floor((highest - options.lowest_hz) * options.block_s)) + 1;
  std::vector<RippleBlock> out;
  if (highest < options.lowest_hz || count < options.fewest_frequencies) return out;
  const VectorXd hertz =
      options.lowest_hz +
      VectorXd::LinSpaced(count, 0.0, static_cast<double>(count - 1)).array() / options.block_s;
  const auto size = static_cast<Index>(std::lround(options.block_s / step));
  for (const SampleRange& run : log.runs) {
    for (Index k = run.begin; k + size <= run.end; k += std::max<Index>(1, size / 2)) {
      RippleBlock b;
      b.samples = {k, k + size};
      judge_block(context, rod, values, hertz, b);
      if (b.known) out.push_back(b);
    }
  }
  return out;
}

std::optional<Rod> rod_of(const CheckContext& context, const CheckedChannel& c) {
  if (c.family != "position" || c.cylinder < 0) return {};
  const CylinderSignals& s = context.signals.cylinders[static_cast<std::size_t>(c.cylinder)];
  if (!s.has_force()) return {};
  Rod rod{s};
  rod.cylinder = c.cylinder;
  rod.joint = context.machine.cylinders[static_cast<std::size_t>(c.cylinder)].joint;
  rod.angle = c.channel->role == Role::kJointPosition;
  const double rate = median(finite_values(s.rate.cwiseAbs()));
  rod.stroke = c.scale * (rod.angle ? rate : 1.0);
  rod.full_speed = c.fastest * (rod.angle ? rate : 1.0);
  return rod;
}

/// Blocks that ripple, with those around them in which the ripple is weaker, and pauses between them.
struct RippleStretch {
  SampleRange samples;
  const RippleBlock* worst = nullptr;
  double flatness = 0.0;  ///< sum over the blocks
  double blocks = 0.0;
  double seconds = 0.0;  ///< [s] without the pauses
};

/// Adds a stretch and the pause before it.
void join(const RippleStretch& next, RippleStretch& s) {
  s.samples.end = next.samples.end;
  if (next.worst->sure.amplitude > s.worst->sure.amplitude) s.worst = next.worst;
  s.flatness += next.flatness;
  s.blocks += next.blocks;
  s.seconds += next.seconds;
}

std::vector<RippleStretch> rippling_stretches(const std::vector<RippleBlock>& blocks,
                                              const Rod& rod, double step,
                                              const RippleOptions& options) {
  VectorXd amplitudes(static_cast<Index>(blocks.size()));
  for (Index i = 0; i < amplitudes.size(); ++i)
    amplitudes[i] = blocks[static_cast<std::size_t>(i)].amplitude;
  const double quiet = quantile(amplitudes, options.quiet_quantile);
  const auto ripples = [&](const RippleBlock& b, const Excess& e) {
    return e.amplitude > options.noise_ratio * std::min(quiet, b.noise) &&
           e.speed > options.least_speed_share * rod.full_speed;
  };
  std::vector<RippleStretch> out;
  for (std::size_t i = 0; i < blocks.size();) {
    RippleStretch s{blocks[i].samples};
    bool sure = false;
    for (; i < blocks.size() && ripples(blocks[i], blocks[i].edge) &&
           blocks[i].samples.begin <= s.samples.end;
         ++i) {
      const RippleBlock& b = blocks[i];
      s.samples.end = b.samples.end;
      s.flatness += b.flatness;
      s.blocks += 1.0;
      if (s.worst == nullptr || b.sure.amplitude > s.worst->sure.amplitude) s.worst = &b;
      sure = sure || ripples(b, b.sure);
    }
    if (s.worst == nullptr) ++i;
    if (!sure) continue;
    s.seconds = static_cast<double>(s.samples.size()) * step;
    if (!out.empty() && static_cast<double>(s.samples.begin - out.back().samples.end) * step <=
                            options.longest_pause_s) {
      join(s, out.back());
    } else {
      out.push_back(s);
    }
  }
  std::erase_if(out, [&](const RippleStretch& s) { return s.seconds < options.least_s; });
  return out;
}

}  // namespace

std::optional<Finding> check_ripple(const CheckContext& context, std::size_t channel) {
  const RippleOptions& options = context.options.ripple;
  const CheckedChannel& c = context.channels[channel];
  const std::optional<Rod> rod = rod_of(context, c);
  if (!rod) return {};
  const std::vector<RippleBlock> blocks = judged_blocks(context, *rod, c.channel->values);
  if (blocks.empty()) return {};
  const std::vector<RippleStretch> stretches =
      rippling_stretches(blocks, *rod, context.log.step, options);
  if (stretches.empty()) return {};
  Finding found;
  found.kind = BadDataKind::kRippling;
  found.affected = Mask::Constant(context.log.samples(), false);
  const RippleBlock* worst = nullptr;
  double flatness = 0.0, count = 0.0;
  for (const RippleStretch& s : stretches) {
    found.affected.segment(s.samples.begin, s.samples.size()).setConstant(true);
    flatness += s.flatness;
    count += s.blocks;
    if (worst == nullptr || s.worst->sure.amplitude > worst->sure.amplitude) worst = s.worst;
  }
  if (flatness > options.flattest * count) return {};
  found.evidence = fmt::format(
      "the rod would oscillate by up to {:.2g} mm (amplitude, at {:.0f} Hz), while its cylinder's "
      "pressures, force and command oscillate as for {:.2g} mm at most",
      1e3 * worst->sure.amplitude, worst->hertz, 1e3 * worst->sure.allowed);
  found.remedy = "Check the sensor, its mounting and its cable, and leave this stretch out";
  return found;
}

}  // namespace sparflow
