#include "identification/mapping_proposal/evidence/supply_evidence.h"

#include <algorithm>
#include <cmath>

#include "models/math/nan.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Share of the fastest rod speed above which a cylinder takes flow from the pump.
/// @threshold [1] 0.02..0.3; chosen: above the noise of speeds
constexpr double kMovingShare = 0.1;
/// Pressure by which a pump may be below the working pressure, by noise of two sensors.
/// @threshold [Pa] 0..5e5; chosen: three times a usual sensor's noise
constexpr double kPressureNoise = 3e5;
/// Weight of the share of time in which the pump is lower than what it moves.
/// @threshold [nat] 1..20; chosen: a third of the time outweighs a clear word
constexpr double kPumpBelow = 8.0;
/// Rod speed at which the dry friction of a drive counts fully.
/// @threshold [m/s] 1e-3..0.02; chosen: twice the noise of speeds
constexpr double kSlipSpeed = 4e-3;
/// Temperatures of hydraulic oil.
/// @threshold [degC] -30..120; chosen: cold start to the limit of seals
constexpr Range kOilRange = {-25.0, 100.0};

VectorXd finite_part(const VectorXd& v, const VectorXd& mask) {
  std::vector<double> kept;
  kept.reserve(static_cast<std::size_t>(v.size()));
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    if (std::isfinite(mask[i])) kept.push_back(v[i]);
  }
  return Eigen::Map<const VectorXd>(kept.data(), static_cast<Eigen::Index>(kept.size()));
}

double correlation_of(const VectorXd& a, const VectorXd& b) {
  const VectorXd x = a.array() - a.mean(), y = b.array() - b.mean();
  const double scale = x.norm() * y.norm();
  return scale > 0.0 ? x.dot(y) / scale : 0.0;
}

std::vector<ChannelUnit> units_for(const ProposalData& data, int channel, const Meaning& meaning) {
  const ChannelUnit& given = data.units[static_cast<std::size_t>(channel)];
  const std::vector<ChannelUnit>& possible = possible_units(meaning, *data.machine);
  for (const ChannelUnit& u : possible) {
    if (u.of == given.of) return {given};
  }
  return possible;
}

}  // namespace

VectorXd largest_working_pressure(const ProposalData& data, const PressureSet& pressures,
                                  const std::vector<ProposedCylinder>& cylinders, int pump) {
  VectorXd most = VectorXd::Constant(data.samples.instants(), kNaN);
  for (const int c : data.machine->pumps[static_cast<std::size_t>(pump)].feeds) {
    const ProposedCylinder& cylinder = cylinders[static_cast<std::size_t>(c)];
    if (cylinder.speed == nullptr) continue;
    const VectorXd& v = *cylinder.speed;
    const double slow = kMovingShare * quantile(v.cwiseAbs(), 0.98);
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      if (!(std::abs(v[i]) > slow)) continue;
      const int column = v[i] > 0.0 ? cylinder.a : cylinder.b;
      const double p = column >= 0 ? pressures.values(i, column) : 0.0;
      if (!(most[i] >= p)) most[i] = p;
    }
  }
  return most;
}

PumpFit fit_pump(const ProposalData& data, const VectorXd& pressure, int pump,
                 const VectorXd& working) {
  const Pump& p = data.machine->pumps[static_cast<std::size_t>(pump)];
  PumpFit fit;
  const VectorXd distance = finite_part(pressure - working, working);
  fit.log_odds = -data.options.pump.price;
  if (distance.size() < 10) return fit;
  fit.above = static_cast<double>((distance.array() > -kPressureNoise).count()) /
              static_cast<double>(distance.size());
  fit.margin = median(distance);
  const double limit = std::max(p.max_pressure, 1.0);
  const bool constant = p.type == PumpType::kConstantPressure;
  const VectorXd judged = constant ? pressure : distance;
  fit.spread = robust_std(judged.array() - median(judged));
  // A third of the largest pressure is what unrelated pressures differ by.
  fit.log_odds = data.options.pump.log_odds(std::min(1.0, fit.spread / (0.33 * limit)));
  fit.log_odds -= kPumpBelow * std::min(1.0, 1.5 * std::max(0.0, 0.97 - fit.above));
  // A load-sensing pump keeps its margin, some ten bar; more is a supply of constant pressure.
  if (!constant && fit.margin > 0.25 * limit) fit.log_odds -= 1.5;
  if (constant && median(pressure) < 0.15 * limit) fit.log_odds -= 3.0;
  const double rest = median(pressure) / limit;
  if (!constant && quantile(pressure, 0.98) / limit < 0.15 && rest < 0.1) fit.log_odds -= 2.0;
  return fit;
}

double return_log_odds(const ProposalData& data, const VectorXd& pressure,
                       const std::vector<ProposedCylinder>& cylinders) {
  VectorXd flow = VectorXd::Zero(pressure.size());
  for (std::size_t c = 0; c < cylinders.size(); ++c) {
    if (cylinders[c].speed == nullptr) continue;
    const Cylinder& part = data.machine->cylinders[c];
    flow += cylinders[c].speed->unaryExpr(
        [&](double v) { return v > 0.0 ? v * part.area_rod() : -v * part.area_piston(); });
  }
  const double high = quantile(pressure, 0.98) / data.largest_pressure();
  const double level = high > 0.25 ? -4.0 : high > 0.12 ? -1.5 : 0.0;
  return -1.5 + level + 2.5 * std::max(0.0, correlation_of(flow, pressure) - 0.2);
}

double force_misfit(const ProposalData& data, int channel, int cylinder,
                    const std::vector<ProposedCylinder>& cylinders, const StaticForces& forces) {
  const VectorXd* speed = cylinders[static_cast<std::size_t>(cylinder)].speed;
  const VectorXd y = data.samples.values.col(channel);
  if (speed == nullptr || !(y.squaredNorm() > 0.0)) return 1.0;
  Eigen::MatrixXd z(y.size(), 4);
  z.col(0) = forces.empty.col(cylinder);
  z.col(1) = speed->unaryExpr([](double v) { return std::tanh(v / kSlipSpeed); });
  z.col(2) = *speed;
  z.col(3) = rate_of_change(data.samples, *speed);
  const VectorXd left = y - z * z.completeOrthogonalDecomposition().solve(y);
  return left.norm() / y.norm();
}

PayloadFit fit_payload(const ProposalData& data, const PressureSet& pressures, int channel,
                       const std::vector<ProposedCylinder>& cylinders, const StaticForces& forces) {
  const ChannelShape& shape = data.shape(channel);
  PayloadFit best;
  best.unit = possible_units({Role::kPayload, -1}, *data.machine).front();
  best.log_odds = -data.options.payload.price - 1.5;
  // Payloads stay for a while; a signal that moves all the time is none.
  if (shape.low < 0.0 || shape.resting < 0.8) {
    best.log_odds -= 3.0;
    return best;
  }
  const auto mass = data.samples.values.col(channel);
  std::vector<ChannelUnit> units = units_for(data, channel, {Role::kPayload, -1});
  for (const ChannelUnit& unit : units) {
    double left = 0.0, all = 0.0;
    for (std::size_t c = 0; c < cylinders.size(); ++c) {
      if (cylinders[c].a < 0 || cylinders[c].speed == nullptr) continue;
      const auto at = static_cast<Eigen::Index>(c);
      const Cylinder& part = data.machine->cylinders[c];
      VectorXd force = part.area_piston() * pressures.values.col(cylinders[c].a);
      if (cylinders[c].b >= 0) force -= part.area_rod() * pressures.values.col(cylinders[c].b);
      // In shares of the cylinder's largest force, so that each counts alike.
      const double scale = part.area_piston() * data.largest_pressure();
      const VectorXd rest = (force - forces.empty.col(at)) / scale;
      const VectorXd load = forces.by_mass.col(at) / scale;
      left += (rest - unit.factor * load.cwiseProduct(mass)).squaredNorm();
      all += rest.squaredNorm();
    }
    if (!(all > 0.0)) continue;
    const double share = 1.0 - left / all;
    const double odds = data.options.payload.log_odds(std::sqrt(std::clamp(1.0 - share, 0.0, 1.0)));
    const double gain = share > 0.05 ? odds + 0.5 : share > -0.2 ? -1.0 : -3.0;
    if (gain > best.log_odds) best = {share, unit, gain};
  }
  return best;
}

OilFit fit_oil(const ProposalData& data, int channel) {
  const ChannelShape& shape = data.shape(channel);
  OilFit best;
  best.unit = possible_units({Role::kOilTemperature, -1}, *data.machine).front();
  best.log_odds = -6.0;
  best.slow = shape.roughness < 0.05 || shape.constant;
  for (const ChannelUnit& unit : units_for(data, channel, {Role::kOilTemperature, -1})) {
    const double lo = unit.factor * shape.low + unit.offset,
                 hi = unit.factor * shape.high + unit.offset;
    if (lo < kOilRange.lo || hi > kOilRange.hi) continue;
    const double odds =
        (best.slow ? -0.5 : -3.0) - (hi < 5.0 ? 2.0 : 0.0) - (shape.constant ? 2.0 : 0.0);
    if (odds > best.log_odds) best = {unit, odds, best.slow, true};
  }
  return best;
}

}  // namespace sparflow
