#include "identification/mapping_proposal/evidence/force_evidence.h"

#include <algorithm>
#include <cmath>

#include "identification/log/log_columns.h"
#include "models/machine/static_force.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Of = ChannelUnit::Of;

/// Rod speed at which dry friction counts fully.
/// @threshold [m/s] 1e-3..0.02; chosen: twice the noise of speeds
constexpr double kSlip = 4e-3;
/// Ridge of the regression, of the regressors' own squares.
// no threshold: numerical, keeps regressors of zero or in proportion solvable
constexpr double kRidge = 1e-6;

double range_score(const ProposalData& data, int channel, double factor, double offset,
                   const PressureOptions& o) {
  const ChannelShape& s = data.shape(channel);
  const double most = data.largest_pressure();
  const double lo = (factor * s.low + offset) / most, hi = (factor * s.high + offset) / most;
  double score = 0.0;
  if (lo < -o.lowest) score -= o.outside * std::min(1.0, (-lo - o.lowest) / 0.1 + 0.3);
  if (hi > o.highest) score -= o.outside * std::min(1.0, std::log(hi / o.highest) + 0.3);
  if (hi < o.idle) score -= 1.0;
  if (s.constant) score -= 2.0;
  return score;
}

/// Whether the machine's log may hold this channel as a pressure, without regard to its unit's factor.
bool may_be_pressure(const ProposalData& data, int channel) {
  const Of of = data.units[static_cast<std::size_t>(channel)].of;
  if (of != Of::kPressure && of != Of::kNothing) return false;
  const ChannelShape& s = data.shape(channel);
  // Levels and slow signals are none: a pressure shows its sensor's noise.
  return of == Of::kPressure || (!s.constant && s.high > 0.0 && s.low > -0.1 * s.high);
}

/// Whether a channel bears the name that the program itself uses for a pressure of this machine.
bool has_own_name(const ProposalData& data, int channel) {
  const ColumnMeaning own = column_meaning(data.name(channel), "", *data.machine);
  if (own.is_time || !own.error.empty()) return false;
  return own.role == Role::kPressureA || own.role == Role::kPressureB ||
         own.role == Role::kPumpPressure || own.role == Role::kReturnPressure;
}

PressureSet pressure_set(const ProposalData& data, const std::vector<int>& channels,
                         const ChannelUnit& open, const PressureOptions& o) {
  PressureSet set;
  const Machine& machine = *data.machine;
  const int cylinders = machine.cylinder_count();
  struct Ranked {
    int channel;
    ChannelUnit unit;
    double range, best;
    bool own_name;
  };
  std::vector<Ranked> all;
  all.reserve(channels.size());
  for (const int m : channels) {
    const ChannelUnit& given = data.units[static_cast<std::size_t>(m)];
    const ChannelUnit unit = given.of == Of::kPressure ? given : open;
    const double range = range_score(data, m, unit.factor, unit.offset, o);
    double best = data.said(m, {Role::kReturnPressure, -1}, nullptr);
    for (int p = 0; p < machine.pump_count(); ++p)
      best = std::max(best, data.said(m, {Role::kPumpPressure, p}, nullptr));
    for (int c = 0; c < cylinders; ++c) {
      best = std::max({best, data.said(m, {Role::kPressureA, c}, nullptr),
                       data.said(m, {Role::kPressureB, c}, nullptr)});
    }
    if (range + best > -o.outside)
      all.push_back({m, unit, range, range + best, has_own_name(data, m)});
  }
  std::stable_sort(all.begin(), all.end(), [](const Ranked& a, const Ranked& b) {
    return a.own_name != b.own_name ? a.own_name : a.best > b.best;
  });
  // A log in the program's own names keeps all its pressures, however many cylinders the machine has.
  const auto own = static_cast<std::size_t>(
      std::count_if(all.begin(), all.end(), [](const Ranked& r) { return r.own_name; }));
  all.resize(std::min(all.size(), std::max(own, static_cast<std::size_t>(o.channels))));
  const auto n = static_cast<Eigen::Index>(all.size());
  set.values.resize(data.samples.instants(), n);
  set.said_a.resize(n, cylinders);
  set.said_b.resize(n, cylinders);
  set.channels.reserve(all.size());
  set.units.reserve(all.size());
  set.range_score.reserve(all.size());
  for (Eigen::Index k = 0; k < n; ++k) {
    const Ranked& r = all[static_cast<std::size_t>(k)];
    set.channels.push_back(r.channel);
    set.units.push_back(r.unit);
    set.range_score.push_back(r.range);
    set.values.col(k) = data.samples.values.col(r.channel).array() * r.unit.factor + r.unit.offset;
    for (int c = 0; c < cylinders; ++c) {
      set.said_a(k, c) = data.said(r.channel, {Role::kPressureA, c}, nullptr);
      set.said_b(k, c) = data.said(r.channel, {Role::kPressureB, c}, nullptr);
    }
  }
  set.inner = set.values.transpose() * set.values;
  return set;
}

}  // namespace

std::vector<PressureSet> pressure_sets(const ProposalData& data, const PressureOptions& o) {
  std::vector<int> channels;
  std::vector<double> highs;
  channels.reserve(data.considered.size());
  highs.reserve(data.considered.size());
  for (const int m : data.considered) {
    if (!may_be_pressure(data, m)) continue;
    channels.push_back(m);
    if (data.units[static_cast<std::size_t>(m)].of != Of::kPressure)
      highs.push_back(data.shape(m).high);
  }
  const std::vector<ChannelUnit>& units =
      possible_units({Role::kReturnPressure, -1}, *data.machine);
  std::vector<PressureSet> sets;
  sets.reserve(units.size());
  if (highs.empty()) {
    sets.push_back(pressure_set(data, channels, units.front(), o));
    return sets;
  }
  const double most = data.largest_pressure();
  for (const ChannelUnit& unit : units) {
    // The largest values of a working machine reach a good part of the pump's pressure.
    const auto plausible = std::count_if(highs.begin(), highs.end(), [&](double h) {
      return unit.factor * h > 0.15 * most && unit.factor * h < o.highest * most;
    });
    if (plausible < 1) continue;
    sets.push_back(pressure_set(data, channels, unit, o));
    sets.back().open_unit = unit.word;
  }
  if (sets.empty()) sets.push_back(pressure_set(data, channels, units.front(), o));
  return sets;
}

std::vector<int> payload_channels(const ProposalData& data, const PressureOptions& o) {
  struct Ranked {
    int channel;
    double score;
  };
  std::vector<Ranked> all;
  all.reserve(data.considered.size());
  for (const int m : data.considered) {
    const ChannelShape& s = data.shape(m);
    if (s.resting < 0.9 || s.low < 0.0 || s.high <= 0.0) continue;
    const double score = data.said(m, {Role::kPayload, -1}, nullptr) + (s.constant ? -2.0 : 0.0);
    if (score > -3.0) all.push_back({m, score});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Ranked& a, const Ranked& b) { return a.score > b.score; });
  std::vector<int> best;
  best.reserve(static_cast<std::size_t>(o.payloads));
  for (const Ranked& r : all) {
    if (static_cast<int>(best.size()) < o.payloads) best.push_back(r.channel);
  }
  return best;
}

StaticForces forces_along(const Machine& machine, const MatrixXd& position) {
  constexpr double kMass = 1000.0;
  StaticForce model(machine);
  StaticForces out;
  out.empty.setZero(position.rows(), machine.cylinder_count());
  out.by_mass.setZero(position.rows(), machine.cylinder_count());
  VectorXd q(position.cols());
  for (Eigen::Index i = 0; i < position.rows(); ++i) {
    for (Eigen::Index j = 0; j < position.cols(); ++j) {
      // The linkages are only known to close within the range.
      const Range& range = machine.joints[static_cast<std::size_t>(j)].position;
      q[j] = std::clamp(position(i, j), range.lo, range.hi);
    }
    model.update(q.data(), 0.0, 0);
    out.empty.row(i) = model.force().transpose();
    model.update(q.data(), kMass, 0);
    out.by_mass.row(i) = (model.force().transpose() - out.empty.row(i)) / kMass;
  }
  return out;
}

VectorXd activity_scores(const ProposalData& data, const PressureSet& pressures,
                         const VectorXd& speed, const PressureOptions& o) {
  const Eigen::Index n = pressures.values.cols();
  VectorXd score = VectorXd::Zero(n);
  const double slow = 0.05 * quantile(speed.cwiseAbs(), 0.98);
  if (!(slow > 0.0)) return score;
  VectorXd moving = VectorXd::Zero(n), all = VectorXd::Zero(n);
  double steps = 0.0, moving_steps = 0.0;
  for (const SampleRange& run : data.samples.runs) {
    for (Eigen::Index i = run.begin + 1; i < run.end; ++i) {
      // Pressures rise with the lever, a little before the rod moves, and fall after it.
      bool moves = false;
      for (Eigen::Index k = std::max(run.begin, i - 3); k <= std::min(run.end - 1, i + 3); ++k) {
        moves = moves || std::abs(speed[k]) > slow;
      }
      const auto change =
          (pressures.values.row(i) - pressures.values.row(i - 1)).cwiseAbs2().transpose();
      all += change;
      steps += 1.0;
      if (!moves) continue;
      moving += change;
      moving_steps += 1.0;
    }
  }
  if (moving_steps < 5.0 || moving_steps > steps - 5.0) return score;
  const double share = moving_steps / steps;
  for (Eigen::Index k = 0; k < n; ++k) {
    if (!(all[k] > 0.0)) continue;
    const double own = std::clamp(moving[k] / all[k], 0.02, 0.98);
    score[k] = o.activity *
               std::clamp(std::log(own / (1.0 - own)) - std::log(share / (1.0 - share)), -1.5, 1.5);
  }
  return score;
}

CylinderForces::CylinderForces(const ProposalData& data, const ForceQuestion& question,
                               const PressureOptions& options)
    : data_(&data), options_(options) {
  const auto& [pressures, cylinder, forces, speed, payloads] = question;
  const Cylinder& c = data.machine->cylinders[static_cast<std::size_t>(cylinder)];
  piston_ = c.area_piston();
  rod_ = c.area_rod();
  scale_ = std::max(0.5 * data.largest_pressure() * piston_, 1e-9);
  count_ = speed.size();
  const Eigen::Index n = pressures.values.cols();
  const VectorXd by_mass = forces.by_mass.col(cylinder);
  mass_scale_ = scale_ / std::max(by_mass.cwiseAbs().mean(), 1e-9);
  MatrixXd z(count_, 3 + payloads.cols());
  z.col(0) = speed.unaryExpr([](double v) { return std::tanh(v / kSlip); });
  z.col(1) = speed;
  z.col(2) = by_mass;
  for (Eigen::Index k = 0; k < payloads.cols(); ++k)
    z.col(3 + k) = by_mass.cwiseProduct(payloads.col(k));
  MatrixXd y(count_, n + 1);
  y.leftCols(n) = pressures.values;
  y.col(n) = forces.empty.col(cylinder);
  // Scaled regressors with a ridge: a slewing joint has no gravity force, a log may have a constant payload.
  VectorXd norm = z.colwise().norm().transpose();
  for (double& v : norm) v = v > 1e-12 ? v : 1.0;
  const MatrixXd scaled = z * norm.cwiseInverse().asDiagonal();
  MatrixXd normal = scaled.transpose() * scaled;
  normal.diagonal().array() += kRidge;
  coefficients_ = normal.ldlt().solve(scaled.transpose() * y);
  const MatrixXd left = y - scaled * coefficients_;
  left_ = left.transpose() * left;
  coefficients_ = (norm.cwiseInverse().asDiagonal() * coefficients_).eval();
}

ForceFit CylinderForces::fit(int a, int b) const {
  const Eigen::Index n = left_.cols() - 1;
  const double rod = b >= 0 ? rod_ : 0.0;
  const Eigen::Index r = b >= 0 ? b : n;
  const double squares =
      piston_ * piston_ * left_(a, a) + left_(n, n) - 2.0 * piston_ * left_(a, n) +
      rod * (rod * left_(r, r) - 2.0 * piston_ * left_(a, r) + 2.0 * left_(r, n));
  const auto coefficient = [&](Eigen::Index k) {
    return piston_ * coefficients_(k, a) - rod * coefficients_(k, r) - coefficients_(k, n);
  };
  ForceFit fit;
  const auto samples = static_cast<double>(std::max<Eigen::Index>(1, count_));
  fit.rms = std::sqrt(std::max(0.0, squares) / samples);
  fit.misfit = fit.rms / scale_;
  fit.friction = coefficient(0);
  const FitWeight& weight = b >= 0 ? data_->options.force : data_->options.single_chamber;
  fit.log_odds = weight.log_odds(fit.misfit);
  const double drives = std::max(0.0, -fit.friction / scale_) / 0.04;
  const double lifts =
      coefficients_.rows() == 3 ? std::max(0.0, -coefficient(2) / mass_scale_) / 0.15 : 0.0;
  fit.log_odds -= options_.impossible * (std::min(1.0, drives) + std::min(1.0, lifts));
  return fit;
}

}  // namespace sparflow
