#include "diagnosis/evidence/evidence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/evidence/branches.h"
#include "diagnosis/evidence/channel_builder.h"
#include "identification/signals/load_sensing_leader.h"
#include "identification/signals/low_pass.h"
#include "identification/signals/series.h"
#include "models/effects/hydraulics.h"
#include "models/math/nan.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
/// Standard deviation of a raw channel's white noise from third differences (robust, so that motion does not count).
double raw_noise(const VectorXd& x, int fewest_differences) {
  std::vector<double> d = third_differences(x, 0, x.size());
  if (d.size() < static_cast<std::size_t>(fewest_differences)) return kNaN;
  return robust_std(Eigen::Map<VectorXd>(d.data(), static_cast<Index>(d.size()))) /
         kThirdDifferenceNoise;
}

/// Noise floor of a channel over several logs: the mean of those in which it is measured.
class MeanNoise {
 public:
  explicit MeanNoise(const EvidenceOptions& options) : fewest_(options.fewest_differences) {}

  /// @param gain of the channel's filter on white noise
  void add(const VectorXd& raw, double gain) {
    const double noise = raw_noise(raw, fewest_);
    if (!std::isfinite(noise)) return;
    sum_ += noise * gain;
    ++logs_;
  }
  /// NaN where no log measures it.
  double value() const { return logs_ > 0 ? sum_ / logs_ : kNaN; }

 private:
  int fewest_;  // differences
  double sum_ = 0.0;
  int logs_ = 0;
};

std::vector<BranchSplit> branches_of(const Evidence& e,
                                     const std::vector<const MachineSignals*>& signals,
                                     std::size_t cylinder, int side) {
  std::vector<BranchData> data;
  std::vector<std::size_t> owner;
  std::vector<BranchSplit> result(signals.size());
  for (std::size_t log = 0; log < signals.size(); ++log) {
    const CylinderSignals& c = signals[log]->cylinders[cylinder];
    const CylinderSeries& s = e.series[log].cylinders[cylinder];
    if (c.pressure_a.size() == 0 || c.pressure_b.size() == 0 || s.force.size() == 0) continue;
    BranchData d;
    d.p_return = side > 0 ? s.pressure_b : s.pressure_a;
    d.p_supply = side > 0 ? s.pressure_a : s.pressure_b;
    d.q_return = s.return_flow;
    d.q_supply = s.flow;
    d.force = s.force;
    d.q_return_total = VectorXd::Zero(s.return_flow.size());
    for (const CylinderSeries& other : e.series[log].cylinders)
      d.q_return_total += other.return_flow;
    d.oil = e.series[log].oil;
    d.moving = c.driven && signals[log]->usable && (c.direction.array() == side);
    data.push_back(std::move(d));
    owner.push_back(log);
  }
  if (data.empty()) return result;
  const auto suspects =
      std::count_if(owner.begin(), owner.end(), [&](std::size_t log) { return log < e.suspects; });
  std::vector<BranchSplit> splits =
      split_branches(data, static_cast<std::size_t>(suspects), e.options.branches);
  for (std::size_t k = 0; k < owner.size(); ++k) result[owner[k]] = std::move(splits[k]);
  return result;
}

}  // namespace

const char* evidence_stage(EvidenceKind kind) {
  switch (kind) {
    case EvidenceKind::kForce:
      return "force";
    case EvidenceKind::kFlow:
      return "flow";
    case EvidenceKind::kPump:
      return "pump";
    default:
      return "pressure";
  }
}

std::string evidence_text(EvidenceKind kind, const std::string& at) {
  switch (kind) {
    case EvidenceKind::kForce:
      return "force of " + at;
    case EvidenceKind::kFlow:
      return "speed of " + at;
    case EvidenceKind::kReturnExtend:
      return "return pressure of " + at + " extending";
    case EvidenceKind::kReturnRetract:
      return "return pressure of " + at + " retracting";
    case EvidenceKind::kSupplyExtend:
      return "supply pressure of " + at + " extending";
    case EvidenceKind::kSupplyRetract:
      return "supply pressure of " + at + " retracting";
    case EvidenceKind::kPump:
      return "pressure of pump " + at;
  }
  return at;
}

const EvidenceChannel* Evidence::find(EvidenceKind kind, int index) const {
  for (const EvidenceChannel& c : channels) {
    if (c.kind == kind && c.index == index) return &c;
  }
  return nullptr;
}

VectorXd Evidence::filter(std::size_t log, EvidenceKind kind, const VectorXd& x) const {
  const Kernels& k = kernels_[log];
  const VectorXd& kernel = kind == EvidenceKind::kForce  ? k.force
                           : kind == EvidenceKind::kFlow ? k.speed
                                                         : k.pressure;
  return convolved(x, kernel, series[log].runs);
}

bool is_nonlinear_in_parameter(const Effect& effect) {
  return effect.changes_machine() && effect.info().place == EffectPlace::kMachine &&
         effect.info().parameters.size() == 1;
}

Eigen::MatrixXd Evidence::columns(const EffectAt& effect, std::span<const double> shape,
                                  const EvidenceChannel& channel, std::span<const double> about,
                                  ActingLogs where) const {
  const std::size_t first_log = where == ActingLogs::kReferences ? suspects : 0;
  const std::size_t last_log = where == ActingLogs::kSuspects ? suspects : series.size();
  const bool chord = !about.empty() && about[0] != 0.0 && channel.kind == EvidenceKind::kForce &&
                     is_nonlinear_in_parameter(*effect.effect);
  const std::vector<EvidenceKind> kinds = effect.effect->shows_in();
  if (std::find(kinds.begin(), kinds.end(), channel.kind) == kinds.end()) return {};
  Eigen::MatrixXd result;
  for (std::size_t log = first_log; log < last_log; ++log) {
    Eigen::MatrixXd raw;
    if (!effect.effect->columns(series[log], {channel.kind, channel.index}, effect.at, shape, raw))
      continue;
    if (where != ActingLogs::kAll) subtract_shared(log, effect, shape, channel, raw);
    if (chord) {
      raw = effect_series({effect.effect, effect.at, {about[0]}, {}, {}}, series[log], channel.kind,
                          channel.index) /
            about[0];
    }
    Eigen::MatrixXd through_force;  // effect of a sensor's error through the measured force
    if (effect.effect->info().stage == EffectStage::kSensor && channel.force_slope.size() > 0 &&
        !effect.effect->columns(series[log], {EvidenceKind::kForce, channel.index}, effect.at,
                                shape, through_force)) {
      through_force.resize(0, 0);
    }
    if (!effect.effect->columns_filtered()) {
      for (Index c = 0; c < raw.cols(); ++c) {
        raw.col(c) = filter(log, channel.kind, raw.col(c).unaryExpr([](double v) {
          return std::isfinite(v) ? v : 0.0;  // all rows are samples in which y is known
        }));
      }
    }
    if (result.size() == 0) result.setZero(channel.rows(), raw.cols());
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      if (channel.log[b] != static_cast<int>(log)) continue;
      for (Index r = channel.blocks[b].first; r < channel.blocks[b].last; ++r) {
        for (Index c = 0; c < raw.cols(); ++c) {
          double v = raw(channel.sample[static_cast<std::size_t>(r)], c);
          if (through_force.size() > 0) {
            v -= channel.force_slope[r] *
                 through_force(channel.sample[static_cast<std::size_t>(r)], c);
          }
          result(r, c) = std::isfinite(v) ? v : 0.0;
        }
      }
    }
  }
  if (result.size() > 0 && result.cwiseAbs().maxCoeff() == 0.0) return {};
  return result;
}

void Evidence::subtract_shared(std::size_t log, const EffectAt& effect,
                               std::span<const double> shape, const EvidenceChannel& channel,
                               Eigen::MatrixXd& columns) const {
  for (const AppliedEffect& known : options.shared) {
    if (known.effect != effect.effect || known.at != effect.at) continue;
    std::vector<double> before;
    bool on = false;  // a linear parameter that cannot be zero multiplies the whole law
    const std::vector<EffectParameter>& parameters = known.effect->info().parameters;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      if (!parameters[p].linear) before.push_back(known.values[p]);
      on = on || (parameters[p].linear && parameters[p].lower > 0.0);
    }
    Eigen::MatrixXd there;
    const bool other = !std::equal(before.begin(), before.end(), shape.begin(), shape.end());
    if (on && other &&
        known.effect->columns(series[log], {channel.kind, channel.index}, known.at, before, there))
      columns -= there;
    return;
  }
}

void Evidence::add_shared(EvidenceChannel& channel) const {
  channel.shared.clear();
  for (const AppliedEffect& effect : options.shared) {
    std::vector<double> linear, shape;
    const std::vector<EffectParameter>& parameters = effect.effect->info().parameters;
    for (std::size_t p = 0; p < parameters.size(); ++p)
      (parameters[p].linear ? linear : shape).push_back(effect.values[p]);
    Eigen::MatrixXd acting =
        columns({effect.effect, effect.at}, shape, channel, {}, ActingLogs::kAll);
    if (acting.size() == 0) continue;
    const Eigen::Map<const VectorXd> values(linear.data(), static_cast<Index>(linear.size()));
    channel.shared.push_back({effect.effect, acting * values});
    acting = acting_columns(acting);
    for (Index k = 0; k < acting.cols(); ++k) acting.col(k) /= acting.col(k).cwiseAbs().maxCoeff();
    Eigen::MatrixXd wider(channel.rows(), channel.baseline.cols() + acting.cols());
    wider << channel.baseline, acting;
    channel.baseline = std::move(wider);
  }
}

std::vector<AppliedEffect> effects_in_references(const CraneModel& model,
                                                 const std::vector<MachineSignals>& references) {
  const auto is_reference = [&](const DataSource& d) {
    return d.use == "train" &&
           std::any_of(references.begin(), references.end(),
                       [&](const MachineSignals& r) { return r.sha256 == d.sha256; });
  };
  std::vector<AppliedEffect> out = model.effects;
  std::erase_if(out, [&](const AppliedEffect& e) {
    const auto step =
        std::find_if(model.steps.rbegin(), model.steps.rend(),
                     [&](const ModelStep& s) { return s.added == e.key(model.machine); });
    return step != model.steps.rend() &&
           std::none_of(step->data.begin(), step->data.end(), is_reference);
  });
  return out;
}

Evidence collect_evidence(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                          const std::vector<MachineSignals>& references,
                          const std::vector<AppliedEffect>* in_references,
                          const EvidenceOptions& options) {
  Evidence e;
  e.options = options;
  const Machine& machine = model.machine;
  std::vector<const MachineSignals*> signals;
  signals.reserve(suspects.size() + references.size());
  for (const MachineSignals& s : suspects) signals.push_back(&s);
  for (const MachineSignals& s : references) signals.push_back(&s);
  e.suspects = suspects.size();
  e.known_ = model.effects;
  e.known_in_references_ = in_references != nullptr ? *in_references : model.effects;
  std::vector<double> gain_force, gain_pressure;
  for (const MachineSignals* s : signals) {
    const std::size_t log = e.series.size();
    e.series.push_back(make_series(model, *s));
    if (log >= e.suspects && in_references != nullptr)
      e.series[log].pumps = pumps_led_by(*in_references, e.series[log]);
    const int order = SmoothingOptions{}.order;
    Evidence::Kernels k;
    k.force = low_pass_of(s->step, s->window, order, 2);
    k.speed = low_pass_of(s->step, s->window, order, 1);
    k.pressure = low_pass_of(s->step, s->window, order, 0);
    if (options.whole_motions) k.force = k.speed = k.pressure = VectorXd::Ones(1);
    gain_force.push_back(k.force.norm());
    gain_pressure.push_back(k.pressure.norm());
    e.kernels_.push_back(std::move(k));
    e.window = std::max(e.window, s->window);
    e.stride = std::max(e.stride,
                        static_cast<int>(std::lround(s->window / s->step / options.rows_a_window)));
  }
  // half the filter's width, so that a row contains samples of its own motion only
  const auto margin_of = [&](std::size_t log) -> Index {
    if (options.whole_motions) return 0;
    return static_cast<Index>(std::lround(0.5 * signals[log]->window / signals[log]->step));
  };

  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const std::string& name = machine.cylinders[at].name;
    {  // force
      ChannelBuilder b(e);
      b.channel.kind = EvidenceKind::kForce;
      MeanNoise noise(options);
      for (std::size_t log = 0; log < signals.size(); ++log) {
        const CylinderSignals& c = signals[log]->cylinders[at];
        if (!c.has_force()) continue;
        const VectorXd y =
            e.filter(log, EvidenceKind::kForce, c.force - e.known(log, EvidenceKind::kForce, i)) -
            c.static_force;
        b.channel.raw.resize(signals.size());
        b.channel.raw[log] = c.force - c.static_force;
        for (const double f : c.static_force) {
          if (std::isfinite(f))
            b.channel.largest_force = std::max(b.channel.largest_force, std::abs(f));
        }
        b.add(log, c.moving && signals[log]->usable, y, Eigen::MatrixXd(y.size(), 0),
              margin_of(log));
        if (log < e.suspects) noise.add(c.force, gain_force[log]);
      }
      b.channel.index = i;
      b.channel.at = name;
      b.channel.unit = {"N", 1.0};
      b.channel.noise_floor = noise.value();
      b.channel.text = evidence_text(b.channel.kind, name);
      if (!b.finish(e.channels)) {
        e.notes.push_back(fmt::format(
            "{}: no measured force while it moves, force effects cannot be judged", name));
      }
    }
    {  // flow
      ChannelBuilder b(e);
      b.channel.kind = EvidenceKind::kFlow;
      std::vector<double> still;
      for (std::size_t log = 0; log < signals.size(); ++log) {
        const CylinderSignals& c = signals[log]->cylinders[at];
        if (!c.has_command()) continue;
        Eigen::MatrixXd base(c.command.size(), 2);
        base.col(0) = e.filter(log, EvidenceKind::kFlow, c.command.cwiseMax(0.0));
        base.col(1) = e.filter(log, EvidenceKind::kFlow, c.command.cwiseMin(0.0));
        const VectorXd y =
            c.speed - e.filter(log, EvidenceKind::kFlow, e.known(log, EvidenceKind::kFlow, i));
        b.add(log, signals[log]->usable && !signals[log]->edge, y, base, 0);
        for (Index k = 0; k < y.size(); ++k) {
          if (base(k, 0) == 0.0 && base(k, 1) == 0.0 && std::isfinite(y[k])) still.push_back(y[k]);
        }
      }
      b.channel.index = i;
      b.channel.at = name;
      b.channel.unit = {"mm/s", 1e-3};
      b.channel.noise_floor =
          still.size() > static_cast<std::size_t>(options.fewest_samples_at_rest)
              ? robust_std(Eigen::Map<VectorXd>(still.data(), static_cast<Index>(still.size())))
              : kNaN;
      b.channel.text = evidence_text(b.channel.kind, name);
      if (!b.finish(e.channels)) {
        e.notes.push_back(
            fmt::format("{}: no command is logged, valve effects cannot be judged", name));
      }
    }
    // pressures, by direction: return channel where the return line sets them, else supply channel
    std::vector<BranchSplit> splits[2];
    for (const int side : {1, -1}) splits[side > 0 ? 0 : 1] = branches_of(e, signals, at, side);
    for (const int side : {1, -1}) {
      for (const bool returning : {true, false}) {
        const EvidenceKind kind =
            returning ? (side > 0 ? EvidenceKind::kReturnExtend : EvidenceKind::kReturnRetract)
                      : (side > 0 ? EvidenceKind::kSupplyExtend : EvidenceKind::kSupplyRetract);
        ChannelBuilder b(e);
        b.channel.kind = kind;
        MeanNoise noise(options);
        for (std::size_t log = 0; log < signals.size(); ++log) {
          const CylinderSignals& c = signals[log]->cylinders[at];
          const CylinderSeries& s = e.series[log].cylinders[at];
          const BranchSplit& split = splits[side > 0 ? 0 : 1][log];
          if (c.pressure_a.size() == 0 || c.pressure_b.size() == 0 || split.return_line.size() == 0)
            continue;
          const VectorXd& raw = (side > 0) != returning ? c.pressure_a : c.pressure_b;
          const VectorXd y = e.filter(log, kind, raw - e.known(log, kind, i));
          const VectorXd& q = returning ? s.return_flow : s.flow;
          Eigen::MatrixXd base(y.size(), returning ? 3 : 5);
          const double q0 = kBaselineFlow, f0 = kBaselineForce;
          base.col(0).setOnes();
          base.col(1) = q / q0;
          base.col(2) = (q / q0).cwiseAbs2();
          if (!returning) {
            base.col(3) = steady_force(s) / f0;
            base.col(4) = (steady_force(s) / f0).cwiseProduct(q / q0);
          }
          b.add(log, returning ? split.return_line : split.counterbalance, y, base, margin_of(log));
          if (log < e.suspects) noise.add(raw, gain_pressure[log]);
        }
        b.channel.index = i;
        b.channel.at = name;
        b.channel.unit = {"bar", 1e5};
        b.channel.noise_floor = noise.value();
        b.channel.text = evidence_text(kind, name);
        if (b.finish(e.channels) && !returning)
          set_force_slope(e.channels.back(), e.suspects, options);
      }
    }
  }
  for (int p = 0; p < machine.pump_count(); ++p) {
    const auto at = static_cast<std::size_t>(p);
    ChannelBuilder b(e);
    b.channel.kind = EvidenceKind::kPump;
    MeanNoise noise(options);
    for (std::size_t log = 0; log < signals.size(); ++log) {
      const PumpSignals& s = signals[log]->pumps[at];
      const PumpSeries& series = e.series[log].pumps[at];
      if (s.pressure.size() == 0 || series.demand.size() == 0) continue;
      const VectorXd y =
          e.filter(log, EvidenceKind::kPump,
                   s.pressure - series.demand - e.known(log, EvidenceKind::kPump, p));
      b.add(log, signals[log]->usable && !signals[log]->edge, y, e.margins(log, p), 0);
      b.channel.raw.resize(signals.size());
      b.channel.raw[log] = s.pressure - series.demand;
      if (log < e.suspects) noise.add(s.pressure, gain_pressure[log]);
    }
    b.channel.index = p;
    b.channel.at = machine.pumps[at].name;
    b.channel.unit = {"bar", 1e5};
    b.channel.noise_floor = noise.value();
    b.channel.text = evidence_text(b.channel.kind, b.channel.at);
    if (!b.finish(e.channels)) {
      e.notes.push_back(fmt::format(
          "pump {}: its pressure or what it feeds is not measured, pump effects cannot be judged",
          b.channel.at));
    }
  }
  for (EvidenceChannel& channel : e.channels) e.add_shared(channel);
  return e;
}

}  // namespace sparflow
