#include "identification/mapping_proposal/evidence/motion_evidence.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Share of the fastest rod speed below which a cylinder rests.
/// @threshold [1] 0.005..0.1; chosen: above the noise of positions, below creeping
constexpr double kRestShare = 0.03;

/// Loss of a unit that is not the usual one where the file gives none.
/// @threshold [nat] 0..4; chosen: between a vague and a clear word
constexpr double kUnusualUnit = 1.5;
/// Loss of a flow that has both signs.
/// @threshold [nat] 0..4; chosen: as a unit that is not the usual one; flows are counted in the direction of the pump
constexpr double kSignedFlow = 1.5;

/// Misfit up to which the slopes of a command mean something.
/// @threshold [1] 0.5..1; chosen: a third of the rod speed's square is explained
constexpr double kExplained = 0.8;
/// Largest loss by slopes that are not those of the valve's flows.
/// @threshold [nat] 0..6; chosen: valve tables are often those of another spool
constexpr double kSlopeLoss = 2.5;
/// Spread of the logarithm of extending over retracting speed, which needs no unit of the command.
/// @threshold [1] 0.1..1; tuned: seeds 1..4 of docs/mapping_proposal.md
constexpr double kRatioSpread = 0.3;
/// Spread of the logarithm of the speed at full command.
/// @threshold [1] 0.1..1; tuned: seeds 1..4 of docs/mapping_proposal.md; full command is limited by many controllers
constexpr double kGainSpread = 0.4;

double neutral_of(const Eigen::Ref<const VectorXd>& v, const VectorXd& speed) {
  const double rest = kRestShare * std::max(quantile(speed.cwiseAbs(), 0.98), 1e-9);
  std::vector<double> resting;
  resting.reserve(static_cast<std::size_t>(v.size()));
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    if (std::abs(speed[i]) < rest) resting.push_back(v[i]);
  }
  if (resting.size() < 5) return median(v);
  return median(
      Eigen::Map<const VectorXd>(resting.data(), static_cast<Eigen::Index>(resting.size())));
}

CopyFit copy_fit(const Eigen::Ref<const VectorXd>& v, const std::vector<ChannelUnit>& units,
                 const VectorXd& expected, const FitWeight& weight) {
  CopyFit best;
  best.log_odds = -weight.price;
  const double all = expected.squaredNorm();
  if (!(all > 0.0)) return best;
  for (const ChannelUnit& unit : units) {
    const double misfit =
        std::sqrt(std::min(1.0, (unit.factor * v - expected).squaredNorm() / all));
    // A unit that the file does not give is rather the usual one.
    const double odds = weight.log_odds(misfit) - (&unit == &units.front() ? 0.0 : kUnusualUnit);
    if (misfit < 1.0 && odds > best.log_odds) best = {misfit, unit.factor, unit, odds};
  }
  return best;
}

std::vector<ChannelUnit> units_of(const ProposalData& data, int channel, const Meaning& meaning) {
  const ChannelUnit& given = data.units[static_cast<std::size_t>(channel)];
  const std::vector<ChannelUnit>& possible = possible_units(meaning, *data.machine);
  for (const ChannelUnit& u : possible) {
    if (u.of == given.of) return {given};
  }
  return possible;
}

}  // namespace

CommandFit fit_command(const ProposalData& data, int channel, const PositionCandidate& position) {
  const auto values = data.samples.values.col(channel);
  const VectorXd& v = position.speed;
  CommandFit best;
  best.log_odds = -data.options.command.price;
  const double all = v.squaredNorm();
  if (!(all > 0.0) || data.shape(channel).constant) return best;
  best.neutral = neutral_of(values, v);
  const VectorXd u = values.array() - best.neutral;
  for (int lag = 0; lag <= data.options.longest_lag; ++lag) {
    const VectorXd d = delayed(data.samples, u, lag);
    double moment[2] = {0.0, 0.0}, square[2] = {0.0, 0.0};
    for (Eigen::Index i = 0; i < d.size(); ++i) {
      const int side = d[i] > 0.0 ? 0 : 1;
      moment[side] += d[i] * v[i];
      square[side] += d[i] * d[i];
    }
    for (const double sign : {1.0, -1.0}) {
      double explained = 0.0, slope[2] = {0.0, 0.0};
      for (int side = 0; side < 2; ++side) {
        if (!(square[side] > 0.0) || sign * moment[side] <= 0.0) continue;
        slope[side] = moment[side] / square[side];
        explained += moment[side] * slope[side];
      }
      const double misfit = std::sqrt(std::max(0.0, 1.0 - explained / all));
      if (misfit >= best.misfit) continue;
      best.misfit = misfit;
      best.lag = lag;
      best.sign = sign;
      best.slope[0] = sign > 0.0 ? slope[0] : slope[1];
      best.slope[1] = sign > 0.0 ? slope[1] : slope[0];
    }
  }
  best.log_odds = data.options.command.log_odds(best.misfit);
  // Levers rest at one value exactly; speeds and flows that are measured do not.
  const double mode = data.mode_shares[static_cast<std::size_t>(channel)];
  best.log_odds -= slope_loss(data, channel, position.joint, best);
  best.log_odds += best.sign < 0.0 ? -1.0 : 0.0;
  best.log_odds += mode > 0.05 ? 0.8 : -0.8;
  return best;
}

double slope_loss(const ProposalData& data, int channel, int joint, const CommandFit& fit) {
  const int cylinder = data.machine->cylinder_of_joint(joint);
  const Valve* valve = cylinder < 0 ? nullptr : data.machine->valve_of_cylinder(cylinder);
  if (valve == nullptr || fit.misfit > kExplained) return 0.0;
  const Cylinder& c = data.machine->cylinders[static_cast<std::size_t>(cylinder)];
  const double full[2] = {valve->max_flow_extend / c.area_piston(),
                          valve->max_flow_retract / c.area_rod()};
  const double slope[2] = {std::abs(fit.slope[0]), std::abs(fit.slope[1])};
  if (!(full[0] > 0.0 && full[1] > 0.0 && slope[0] > 0.0 && slope[1] > 0.0)) return 0.0;
  const auto loss = [](double ratio, double spread) {
    const double off = std::log(ratio) / spread;
    return std::min(kSlopeLoss, 0.5 * off * off);
  };
  double sum = loss(slope[0] / slope[1] * full[1] / full[0], kRatioSpread);
  const ChannelUnit& unit = data.units[static_cast<std::size_t>(channel)];
  if (unit.of == ChannelUnit::Of::kShare) {
    sum += loss(std::sqrt(slope[0] * slope[1] / (full[0] * full[1])) / unit.factor, kGainSpread);
  }
  return sum;
}

CopyFit fit_speed(const ProposalData& data, int channel, const Meaning& meaning,
                  const VectorXd& rate) {
  return copy_fit(data.samples.values.col(channel), units_of(data, channel, meaning), rate,
                  data.options.speed);
}

CopyFit fit_flow(const ProposalData& data, int channel, int cylinder, const VectorXd& rod_speed) {
  const Cylinder& c = data.machine->cylinders[static_cast<std::size_t>(cylinder)];
  const VectorXd expected = rod_speed.unaryExpr(
      [&](double v) { return v > 0.0 ? c.area_piston() * v : -c.area_rod() * v; });
  CopyFit fit =
      copy_fit(data.samples.values.col(channel).cwiseAbs(),
               units_of(data, channel, {Role::kFlow, cylinder}), expected, data.options.flow);
  const ChannelShape& shape = data.shape(channel);
  if (shape.low < -0.1 * shape.high) fit.log_odds -= kSignedFlow;
  return fit;
}

CopyFit fit_copy(const ProposalData& data, int channel, const Meaning& meaning,
                 const VectorXd& expected) {
  // About the mean, because a position of 1 m that varies by 1 cm would agree with any constant of 1 m.
  CopyFit best;
  best.log_odds = -data.options.speed.price;
  const double spread = (expected.array() - expected.mean()).matrix().norm();
  if (!(spread > 0.0)) return best;
  for (const ChannelUnit& unit : units_of(data, channel, meaning)) {
    const VectorXd off = unit.factor * data.samples.values.col(channel) - expected;
    const double misfit = std::min(1.0, off.norm() / spread);
    if (misfit < best.misfit)
      best = {misfit, unit.factor, unit, data.options.speed.log_odds(misfit)};
  }
  return best;
}

std::string command_expression(const ProposalData& data, int channel, int cylinder,
                               const CommandFit& fit, std::string* scale_words) {
  const ChannelShape& shape = data.shape(channel);
  const ChannelUnit& unit = data.units[static_cast<std::size_t>(channel)];
  const double reach = std::max(shape.high - fit.neutral, fit.neutral - shape.low);
  const bool share = unit.of == ChannelUnit::Of::kShare;
  const double centred = std::abs(fit.neutral) <= 0.02 * reach ? 0.0 : fit.neutral;
  // Full deflections in use: shares, percent, counts, currents of 4..20 mA, volts of 0.5..4.5 and 0..10 V.
  static constexpr std::array<double, 14> kUsual = {
      1.0, 2.0, 2.5, 5.0, 8.0, 10.0, 100.0, 127.0, 250.0, 500.0, 1000.0, 2048.0, 4096.0, 32767.0};
  double scale = 0.0;
  if (share) {
    scale = 1.0 / unit.factor;
  } else {
    // The valve's flow at full command tells which of the usual full deflections is meant.
    const Valve* valve = data.machine->valve_of_cylinder(cylinder);
    const Cylinder& c = data.machine->cylinders[static_cast<std::size_t>(cylinder)];
    double by_flow = 0.0;
    if (valve != nullptr && c.hydraulic()) {
      const double extend = fit.slope[0] * fit.sign > 0.0
                                ? valve->max_flow_extend / c.area_piston() / std::abs(fit.slope[0])
                                : 0.0;
      const double retract = fit.slope[1] * fit.sign > 0.0
                                 ? valve->max_flow_retract / c.area_rod() / std::abs(fit.slope[1])
                                 : 0.0;
      by_flow =
          extend > 0.0 && retract > 0.0 ? std::sqrt(extend * retract) : std::max(extend, retract);
    }
    double nearest = 1e300;
    for (const double usual : kUsual) {
      if (usual < 0.98 * reach || usual > 5.0 * reach) continue;
      const double off = std::abs(std::log(usual / (by_flow > 0.0 ? by_flow : reach)));
      if (off < nearest) nearest = off, scale = usual;
    }
    if (scale == 0.0) scale = reach > 0.0 ? reach : 1.0;
  }
  *scale_words = fmt::format("full command is taken for {:.4g}{} of its unit", scale,
                             centred != 0.0 ? fmt::format(" around {:.4g}", centred) : "");
  const std::string column = fmt::format("`{}`", data.name(channel));
  const std::string value = centred == 0.0 ? column : fmt::format("({} - {:.6g})", column, centred);
  const std::string minus = fit.sign < 0.0 ? "-" : "";
  if (scale == 1.0) return minus + value;
  return fmt::format("{}{} / {:.6g}", minus, value, scale);
}

}  // namespace sparflow
