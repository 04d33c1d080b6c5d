// Builds the channels of an Evidence from the signals of all logs; declared in evidence.h.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnosis/evidence/branches.h"
#include "diagnosis/evidence/channel_builder.h"
#include "diagnosis/evidence/common_support.h"
#include "diagnosis/evidence/evidence.h"
#include "diagnosis/evidence/filled_chambers.h"
#include "diagnosis/evidence/force_low_pass.h"
#include "diagnosis/evidence/sensor_noise.h"
#include "identification/learning/learn_pump.h"
#include "identification/signals/load_sensing_leader.h"
#include "identification/signals/low_pass.h"
#include "identification/signals/series.h"
#include "identification/signals/steady.h"
#include "models/effects/hydraulics.h"
#include "models/math/nan.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The supply or the return chamber of a cylinder that moves in one direction.
struct ChamberRole {
  int side;        // +1 extending, -1 retracting
  bool returning;  // the return chamber

  EvidenceKind kind() const {
    if (returning) return side > 0 ? EvidenceKind::kReturnExtend : EvidenceKind::kReturnRetract;
    return side > 0 ? EvidenceKind::kSupplyExtend : EvidenceKind::kSupplyRetract;
  }
  /// [Pa] as logged
  const VectorXd& pressure(const CylinderSignals& c) const {
    return (side > 0) != returning ? c.pressure_a : c.pressure_b;
  }
  /// Columns 1, Q, Q^2 of a return chamber, and F, Q F in a supply chamber. [samples x columns]
  MatrixXd baseline(const CylinderSeries& s) const {
    const VectorXd& q = returning ? s.return_flow : s.flow;
    MatrixXd base(q.size(), returning ? 3 : 5);
    const double q0 = kBaselineFlow, f0 = kBaselineForce;
    base.col(0).setOnes();
    base.col(1) = q / q0;
    base.col(2) = (q / q0).cwiseAbs2();
    if (!returning) {
      base.col(3) = steady_force(s) / f0;
      base.col(4) = (steady_force(s) / f0).cwiseProduct(q / q0);
    }
    return base;
  }
};

/// Time since a command changed by more than `least`, in its run; infinite before the first change. [samples, s]
VectorXd since_change(const MachineSeries& series, double least) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  VectorXd since = VectorXd::Constant(series.samples(), kNever);
  for (const CylinderSeries& c : series.cylinders) {
    if (c.command.size() == 0) continue;
    for (const auto& [first, last] : series.runs) {
      double level = c.command[first], changed = -kNever;
      for (Index k = first; k < last; ++k) {
        if (std::isnan(level)) level = c.command[k];
        if (std::abs(c.command[k] - level) > least) {
          level = c.command[k];
          changed = series.time[k];
        }
        since[k] = std::min(since[k], series.time[k] - changed);
      }
    }
  }
  return since;
}

/// Lets the times begin anew as long before a change as a filter's window reaches: a filtered row there has its part of what follows.
/// @param reach half the window [s]
void begin_where_filters_reach(const MachineSeries& series, double reach, VectorXd& since) {
  for (const auto& [first, last] : series.runs) {
    double change = std::numeric_limits<double>::infinity();
    for (Index k = last; k-- > first;) {
      if (since[k] == 0.0) change = series.time[k];
      if (change - series.time[k] <= reach) since[k] = 0.0;
    }
  }
}

/// Lets the times begin anew also where the pressure of a pump moves faster than `fastest` [Pa/s]: behind a slow or swinging pump
/// nothing is settled, however long the commands have stood.
void restart_where_pumps_move(const MachineSignals& signals, const MachineSeries& series,
                              double fastest, VectorXd& since) {
  /// Time over which a rate is taken.
  /// @threshold [s] 0.05..1; chosen: noise of 1 bar then stands for 7 bar/s, a seventh of the limit, whatever the filter
  constexpr double kSpan = 0.2;
  const auto half = std::max<Index>(
      1, static_cast<Index>(std::lround(0.5 * std::max(signals.window, kSpan) / signals.step)));
  for (const PumpSignals& pump : signals.pumps) {
    const VectorXd& p = pump.pressure_smooth;
    if (p.size() == 0) continue;
    for (const auto& [first, last] : series.runs) {
      double moved = -std::numeric_limits<double>::infinity();
      for (Index k = first; k < last; ++k) {
        const Index a = std::max(first, k - half), b = std::min(last - 1, k + half);
        const double rate =
            std::abs(p[b] - p[a]) / std::max(series.time[b] - series.time[a], signals.step);
        if (rate > fastest) moved = series.time[k];
        since[k] = std::min(since[k], series.time[k] - moved);
      }
    }
  }
}

std::vector<const MachineSignals*> in_order(const std::vector<MachineSignals>& suspects,
                                            const std::vector<MachineSignals>& references) {
  std::vector<const MachineSignals*> all;
  all.reserve(suspects.size() + references.size());
  for (const MachineSignals& s : suspects) all.push_back(&s);
  for (const MachineSignals& s : references) all.push_back(&s);
  return all;
}

bool measures_both_chambers(const CylinderSignals& c) {
  return c.pressure_a.size() > 0 && c.pressure_b.size() > 0;
}

/// Where the law of a load-sensing pump does not end at its pressure cut-off, neither at a sample nor in the filter's window about
/// it; learning leaves the same samples out. [samples]
Mask below_cut_off(const Pump& pump, const MachineSignals& signals, const VectorXd& pressure) {
  Mask below = Mask::Constant(pressure.size(), true);
  if (pump.type != PumpType::kLoadSensing || !(pump.max_pressure > 0.0)) return below;
  const double limit = LearnPumpOptions{}.cut_off_share * pump.max_pressure;
  const auto half = static_cast<Index>(std::lround(0.5 * signals.window / signals.step));
  for (Index k = 0; k < pressure.size(); ++k) {
    if (!(pressure[k] > limit)) continue;
    const Index first = std::max<Index>(0, k - half);
    below.segment(first, std::min(pressure.size(), k + half + 1) - first).setConstant(false);
  }
  return below;
}

/// One cylinder that moves to one side, as the branches' mixture takes it.
BranchData branch_data(const MachineSignals& signals, const MachineSeries& series,
                       std::size_t cylinder, int side) {
  const CylinderSignals& c = signals.cylinders[cylinder];
  const CylinderSeries& s = series.cylinders[cylinder];
  BranchData d;
  d.p_return = side > 0 ? s.pressure_b : s.pressure_a;
  d.p_supply = side > 0 ? s.pressure_a : s.pressure_b;
  d.q_return = s.return_flow;
  d.q_supply = s.flow;
  d.force = s.force;
  d.q_return_total = VectorXd::Zero(s.return_flow.size());
  for (const CylinderSeries& other : series.cylinders) d.q_return_total += other.return_flow;
  d.oil = series.oil;
  d.moving = c.driven && signals.usable && (c.direction.array() == side);
  return d;
}

}  // namespace

/// Adds the logs, then the channels; add_logs must come first.
class EvidenceCollector {
 public:
  /// The arguments must outlive this.
  EvidenceCollector(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                    const std::vector<MachineSignals>& references, const EvidenceOptions& options)
      : model_(model), signals_(in_order(suspects, references)) {
    evidence_.options = options;
    evidence_.suspects = suspects.size();
    if (options.whole_motions) return;
    own_.reserve(signals_.size());
    for (const MachineSignals*& s : signals_) {
      own_.push_back(with_accelerations_of_filter(model.machine, *s));
      s = &own_.back();
    }
  }

  /// @param in_references effects that act in the references; null: those of the model
  void add_logs(const std::vector<AppliedEffect>* in_references);
  void add_force_channel(int cylinder);
  void add_flow_channel(int cylinder);
  /// By direction: a return channel where the return line sets the pressures, else a supply channel.
  void add_pressure_channels(int cylinder);
  void add_pump_channel(int pump);
  /// The common return line, where a log measures its pressure.
  void add_return_line_channel();
  Evidence finished();

 private:
  const EvidenceOptions& options() const { return evidence_.options; }
  bool is_suspect(std::size_t log) const { return log < evidence_.suspects; }
  void add_kernels(const MachineSignals& signals);
  /// Half the filter's width, so that a row contains samples of its own motion only. [samples]
  Index margin_of(std::size_t log) const;
  /// A builder of a channel of cylinder or pump `index`. @param unit of reports
  ChannelBuilder builder(EvidenceKind kind, int index, const FieldUnit& unit) const;
  /// @return for each log; empty where the log does not measure what the branches need
  std::vector<BranchSplit> branches_of(std::size_t cylinder, int side) const;
  CommonSupport support_of(int cylinder, const ChamberRole& chamber,
                           const std::vector<BranchSplit>& splits) const;
  /// @param support outside which the log's values are missing; null: everywhere
  /// @return false where the log does not measure the chamber
  bool add_chamber(std::size_t log, const ChamberRole& chamber, const BranchSplit& split,
                   const CommonSupport* support, ChannelBuilder& to) const;
  /// @param splits of the chamber's side, for each log
  void add_pressure_channel(int cylinder, const ChamberRole& chamber,
                            const std::vector<BranchSplit>& splits);

  const CraneModel& model_;
  Evidence evidence_;
  std::vector<const MachineSignals*> signals_;  // suspect logs first, then references
  std::vector<MachineSignals> own_;             // with the accelerations of their own filter
  std::vector<double> width_behind_force_;      // [s] by cylinder
  std::vector<double> gain_pressure_;           // by log: gain of the filter on white noise
};

void EvidenceCollector::add_logs(const std::vector<AppliedEffect>* in_references) {
  Evidence& e = evidence_;
  e.known_ = model_.effects;
  e.known_in_references_ = in_references != nullptr ? *in_references : model_.effects;
  for (int i = 0; i < model_.machine.cylinder_count(); ++i)
    width_behind_force_.push_back(low_pass_width(model_.machine, signals_, i, e.options));
  for (std::size_t log = 0; log < signals_.size(); ++log) {
    const MachineSignals& s = *signals_[log];
    e.series.push_back(make_series(model_, s));
    if (!is_suspect(log) && in_references != nullptr) {
      e.series[log] = with_reached(*in_references, std::move(e.series[log]));
      e.series[log].pumps = pumps_led_by(*in_references, e.series[log]);
    }
    for (PumpSeries& p : e.series[log].pumps) {
      const bool late = p.following.effect != nullptr;
      if (late && !e.options.mechanisms.act(Mechanism::kPumpFollows)) p.following = {};
    }
    if (e.options.settles && e.options.mechanisms.enabled(Mechanism::kSettling)) {
      VectorXd since = since_change(e.series[log], e.options.least_change);
      restart_where_pumps_move(s, e.series[log], e.options.fastest_settled, since);
      begin_where_filters_reach(e.series[log], 0.5 * s.window, since);
      e.since_change.push_back(std::move(since));
    }
    add_kernels(s);
    e.window = std::max(e.window, s.window);
    e.stride = std::max(e.stride,
                        static_cast<int>(std::lround(s.window / s.step / e.options.rows_a_window)));
  }
}

void EvidenceCollector::add_kernels(const MachineSignals& signals) {
  Evidence::Kernels k;
  if (options().whole_motions) {
    k.force = k.speed = k.pressure = VectorXd::Ones(1);
    k.behind_force.assign(width_behind_force_.size(), VectorXd::Ones(1));
  } else {
    k.force = low_pass_of(signals.step, signals.window, signals.order, 2);
    k.speed = low_pass_of(signals.step, signals.window, signals.order, 1);
    k.pressure = low_pass_of(signals.step, signals.window, signals.order, 0);
    for (const double width : width_behind_force_)
      k.behind_force.push_back(raised_cosine(width, signals.step));
  }
  gain_pressure_.push_back(k.pressure.norm());
  evidence_.kernels_.push_back(std::move(k));
}

Index EvidenceCollector::margin_of(std::size_t log) const {
  if (options().whole_motions) return 0;
  return static_cast<Index>(std::lround(0.5 * signals_[log]->window / signals_[log]->step));
}

ChannelBuilder EvidenceCollector::builder(EvidenceKind kind, int index,
                                          const FieldUnit& unit) const {
  const Machine& machine = model_.machine;
  const auto at = static_cast<std::size_t>(index);
  ChannelBuilder b(evidence_);
  b.channel.kind = kind;
  b.channel.index = index;
  if (kind != EvidenceKind::kReturnLine)
    b.channel.at =
        kind == EvidenceKind::kPump ? machine.pumps[at].name : machine.cylinders[at].name;
  b.channel.unit = unit;
  b.channel.text = evidence_text(kind, b.channel.at);
  return b;
}

void EvidenceCollector::add_force_channel(int cylinder) {
  Evidence& e = evidence_;
  ChannelBuilder b = builder(EvidenceKind::kForce, cylinder, {"N", 1.0});
  const std::string name = b.channel.at;
  double noise = 0.0, suspects = 0.0;
  if (!e.options.settles && e.options.mechanisms.enabled(Mechanism::kSettling)) {
    for (const MachineSignals* s : signals_)
      b.since_change.push_back(since_unsteady(*s, s->cylinders[static_cast<std::size_t>(cylinder)],
                                              e.options.unsteady_span));
  }
  for (std::size_t log = 0; log < signals_.size(); ++log) {
    const CylinderSignals& c = signals_[log]->cylinders[static_cast<std::size_t>(cylinder)];
    if (!c.has_force()) continue;
    const VectorXd y =
        e.behind_force(log, cylinder,
                       e.filter(log, EvidenceKind::kForce, c.force) - c.static_force -
                           e.smooth_known(log, EvidenceKind::kForce, cylinder));
    b.channel.raw.resize(signals_.size());
    b.channel.raw[log] = c.force - c.static_force - e.known(log, EvidenceKind::kForce, cylinder);
    for (const double f : c.static_force) {
      if (std::isfinite(f))
        b.channel.largest_force = std::max(b.channel.largest_force, std::abs(f));
    }
    b.add(log, c.moving && signals_[log]->usable, y, MatrixXd(y.size(), 0),
          margin_of(log) +
              e.kernels_[log].behind_force[static_cast<std::size_t>(cylinder)].size() / 2);
    if (!is_suspect(log)) continue;
    const ForceNoise here(model_.machine, *signals_[log], cylinder, e.options);
    if (!here.known()) continue;
    const double width = width_behind_force_[static_cast<std::size_t>(cylinder)];
    noise += std::hypot(here.of_pressures(width), here.of_accelerations(width));
    suspects += 1.0;
  }
  b.channel.noise_floor = suspects > 0.0 ? noise / suspects : kNaN;
  if (!b.finish(e.channels)) {
    e.notes.push_back(
        fmt::format("{}: no measured force while it moves, force effects cannot be judged", name));
  }
}

void EvidenceCollector::add_flow_channel(int cylinder) {
  Evidence& e = evidence_;
  ChannelBuilder b = builder(EvidenceKind::kFlow, cylinder, {"mm/s", 1e-3});
  const std::string name = b.channel.at;
  std::vector<double> still;
  bool commanded = false;
  for (std::size_t log = 0; log < signals_.size(); ++log) {
    const CylinderSignals& c = signals_[log]->cylinders[static_cast<std::size_t>(cylinder)];
    if (!c.has_command()) continue;
    commanded = true;
    const CylinderSeries& s = e.series[log].cylinders[static_cast<std::size_t>(cylinder)];
    const VectorXd& reached = s.reached.size() > 0 ? s.reached : c.command;
    MatrixXd base(c.command.size(), 2);
    base.col(0) = e.filter(log, EvidenceKind::kFlow, reached.cwiseMax(0.0));
    base.col(1) = e.filter(log, EvidenceKind::kFlow, reached.cwiseMin(0.0));
    const VectorXd commanded_nearby = e.filter(log, EvidenceKind::kFlow, c.command.cwiseAbs());
    const VectorXd y = c.speed - e.smooth_known(log, EvidenceKind::kFlow, cylinder);
    const MachineSignals& signals = *signals_[log];
    Mask rows = signals.usable && !signals.edge;
    const Mask filled = chambers_filled(signals, c, options().void_pressure);
    if (options().mechanisms.act(Mechanism::kVoid, !filled.all())) rows = rows && filled;
    b.add(log, rows, y, base, 0);
    for (Index k = 0; k < y.size(); ++k) {
      if (commanded_nearby[k] == 0.0 && std::isfinite(y[k])) still.push_back(y[k]);
    }
  }
  b.channel.noise_floor =
      still.size() > static_cast<std::size_t>(options().fewest_samples_at_rest)
          ? robust_std(Eigen::Map<VectorXd>(still.data(), static_cast<Index>(still.size())))
          : kNaN;
  if (!b.finish(e.channels)) {
    e.notes.push_back(fmt::format("{}: {}, valve effects cannot be judged", name,
                                  commanded ? "the logs are too short" : "no command is logged"));
  }
}

std::vector<BranchSplit> EvidenceCollector::branches_of(std::size_t cylinder, int side) const {
  std::vector<BranchData> data;
  std::vector<std::size_t> owner;
  std::vector<BranchSplit> result(signals_.size());
  for (std::size_t log = 0; log < signals_.size(); ++log) {
    if (!measures_both_chambers(signals_[log]->cylinders[cylinder]) ||
        evidence_.series[log].cylinders[cylinder].force.size() == 0)
      continue;
    data.push_back(branch_data(*signals_[log], evidence_.series[log], cylinder, side));
    owner.push_back(log);
  }
  if (data.empty()) return result;
  const auto suspects =
      std::count_if(owner.begin(), owner.end(), [&](std::size_t log) { return is_suspect(log); });
  std::vector<BranchSplit> splits =
      split_branches(data, static_cast<std::size_t>(suspects), options().branches);
  for (std::size_t k = 0; k < owner.size(); ++k) result[owner[k]] = std::move(splits[k]);
  return result;
}

void EvidenceCollector::add_pressure_channels(int cylinder) {
  const auto at = static_cast<std::size_t>(cylinder);
  for (const int side : {1, -1}) {
    const std::vector<BranchSplit> splits = branches_of(at, side);
    for (const bool returning : {true, false})
      add_pressure_channel(cylinder, {side, returning}, splits);
  }
}

CommonSupport EvidenceCollector::support_of(int cylinder, const ChamberRole& chamber,
                                            const std::vector<BranchSplit>& splits) const {
  ChannelBuilder references = builder(chamber.kind(), cylinder, {"bar", 1e5});
  if (options().mechanisms.act(Mechanism::kCommonSupport)) {
    for (std::size_t log = evidence_.suspects; log < signals_.size(); ++log)
      add_chamber(log, chamber, splits[log], nullptr, references);
  }
  return CommonSupport(references.baseline());
}

bool EvidenceCollector::add_chamber(std::size_t log, const ChamberRole& chamber,
                                    const BranchSplit& split, const CommonSupport* support,
                                    ChannelBuilder& to) const {
  const auto at = static_cast<std::size_t>(to.channel.index);
  const CylinderSignals& c = signals_[log]->cylinders[at];
  if (!measures_both_chambers(c) || split.return_line.size() == 0) return false;
  const CylinderSeries& s = evidence_.series[log].cylinders[at];
  VectorXd y = evidence_.filter(log, chamber.kind(), chamber.pressure(c)) -
               evidence_.smooth_known(log, chamber.kind(), to.channel.index);
  const MatrixXd base = chamber.baseline(s);
  if (support != nullptr) support->limit(base, y);
  to.add(log, chamber.returning ? split.return_line : split.counterbalance, y, base,
         margin_of(log));
  return true;
}

void EvidenceCollector::add_pressure_channel(int cylinder, const ChamberRole& chamber,
                                             const std::vector<BranchSplit>& splits) {
  Evidence& e = evidence_;
  ChannelBuilder b = builder(chamber.kind(), cylinder, {"bar", 1e5});
  MeanNoise noise(e.options);
  const CommonSupport support = support_of(cylinder, chamber, splits);
  for (std::size_t log = 0; log < signals_.size(); ++log) {
    const bool suspect = is_suspect(log);
    if (!add_chamber(log, chamber, splits[log], suspect ? &support : nullptr, b)) continue;
    if (suspect)
      noise.add(chamber.pressure(signals_[log]->cylinders[static_cast<std::size_t>(cylinder)]),
                gain_pressure_[log]);
  }
  b.channel.noise_floor = noise.value();
  if (!b.finish(e.channels)) return;
  set_slopes(e.channels.back(), e.suspects, e.options);
  if (!chamber.returning) {
    const Cylinder& c = model_.machine.cylinders[static_cast<std::size_t>(cylinder)];
    e.channels.back().flow_slope *= supply_area(c, chamber.side) / supply_area(c, -chamber.side);
  }
}

void EvidenceCollector::add_pump_channel(int pump) {
  Evidence& e = evidence_;
  const auto at = static_cast<std::size_t>(pump);
  ChannelBuilder b = builder(EvidenceKind::kPump, pump, {"bar", 1e5});
  const std::string name = b.channel.at;
  MeanNoise noise(e.options);
  for (std::size_t log = 0; log < signals_.size(); ++log) {
    const PumpSignals& s = signals_[log]->pumps[at];
    const PumpSeries& series = e.series[log].pumps[at];
    if (s.pressure.size() == 0 || series.demand.size() == 0) continue;
    const VectorXd beyond = s.pressure - series.demand;
    const VectorXd y =
        e.filter(log, EvidenceKind::kPump, beyond) - e.smooth_known(log, EvidenceKind::kPump, pump);
    const Mask follows = below_cut_off(model_.machine.pumps[at], *signals_[log], s.pressure_smooth);
    b.add(log, signals_[log]->usable && !signals_[log]->edge && follows, y, e.margins(log, pump),
          0);
    b.channel.raw.resize(signals_.size());
    b.channel.raw[log] = beyond - e.known(log, EvidenceKind::kPump, pump);
    if (is_suspect(log)) noise.add(s.pressure, gain_pressure_[log]);
  }
  b.channel.noise_floor = noise.value();
  if (!b.finish(e.channels)) {
    e.notes.push_back(
        fmt::format("pump {}: its pressure or what it feeds is not measured or hardly moves, pump "
                    "effects cannot "
                    "be judged",
                    name));
  }
}

void EvidenceCollector::add_return_line_channel() {
  Evidence& e = evidence_;
  constexpr EvidenceKind kKind = EvidenceKind::kReturnLine;
  ChannelBuilder b = builder(kKind, 0, {"bar", 1e5});
  MeanNoise noise(e.options);
  for (std::size_t log = 0; log < signals_.size(); ++log) {
    const VectorXd& raw = signals_[log]->return_pressure;
    if (raw.size() == 0) continue;
    const VectorXd total = total_return_flow(e.series[log]) / kBaselineFlow;
    MatrixXd base(total.size(), 3);
    base.col(0).setOnes();
    base.col(1) = e.filter(log, kKind, total);
    base.col(2) = e.filter(log, kKind, total.cwiseAbs2());
    b.add(log, signals_[log]->usable && !signals_[log]->edge,
          e.filter(log, kKind, raw) - e.smooth_known(log, kKind, 0), base, 0);
    if (is_suspect(log)) noise.add(raw, gain_pressure_[log]);
  }
  b.channel.noise_floor = noise.value();
  b.finish(e.channels);
}

Evidence EvidenceCollector::finished() {
  for (EvidenceChannel& channel : evidence_.channels) evidence_.add_shared(channel);
  return std::move(evidence_);
}

Evidence collect_evidence(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                          const std::vector<MachineSignals>& references,
                          const std::vector<AppliedEffect>* in_references,
                          const EvidenceOptions& options) {
  EvidenceCollector collector(model, suspects, references, options);
  collector.add_logs(in_references);
  const auto wanted = [&](std::initializer_list<EvidenceKind> kinds) {
    return options.kinds.empty() ||
           std::find_first_of(options.kinds.begin(), options.kinds.end(), kinds.begin(),
                              kinds.end()) != options.kinds.end();
  };
  using enum EvidenceKind;
  for (int i = 0; i < model.machine.cylinder_count(); ++i) {
    if (wanted({kForce})) collector.add_force_channel(i);
    if (wanted({kFlow})) collector.add_flow_channel(i);
    if (wanted({kReturnExtend, kReturnRetract, kSupplyExtend, kSupplyRetract}))
      collector.add_pressure_channels(i);
  }
  for (int p = 0; wanted({kPump}) && p < model.machine.pump_count(); ++p)
    collector.add_pump_channel(p);
  if (wanted({kReturnLine}) && !hydraulic_cylinders(model.machine).empty())
    collector.add_return_line_channel();
  return collector.finished();
}

}  // namespace sparflow
