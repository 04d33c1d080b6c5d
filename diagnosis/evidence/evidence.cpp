#include "diagnosis/evidence/evidence.h"

#include <algorithm>
#include <cmath>

#include "identification/signals/low_pass.h"
#include "identification/signals/series.h"
#include "models/effects/valve_flow.h"

namespace sparflow {

using Eigen::Index;
using Eigen::VectorXd;

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
    case EvidenceKind::kReturnLine:
      return "pressure of the return line";
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

VectorXd Evidence::behind_force(std::size_t log, int cylinder, const VectorXd& x) const {
  if (kernels_.empty()) return x;  // channels that were not made from logs
  const VectorXd& kernel = kernels_[log].behind_force[static_cast<std::size_t>(cylinder)];
  return kernel.size() > 1 ? convolved(x, kernel, series[log].runs) : x;
}

bool is_nonlinear_in_parameter(const Effect& effect) {
  return effect.changes_machine() && effect.info().place == EffectPlace::kMachine &&
         effect.info().parameters.size() == 1;
}

bool is_linearised(const Effect& effect) {
  return is_nonlinear_in_parameter(effect) || effect.depends_on_size();
}

bool is_replaced_when_changed(const Effect& effect) {
  const std::vector<EffectParameter>& parameters = effect.info().parameters;
  return std::any_of(parameters.begin(), parameters.end(),
                     [](const EffectParameter& p) { return p.linear && p.lower > 0.0; });
}

SectionPool Evidence::sections(const EffectAt& effect, std::span<const double> shape,
                               const EvidenceChannel& channel,
                               std::span<const double> about) const {
  SectionPool pool;
  for (std::size_t log = 0; log < series.size() && series.size() > 1; ++log) {
    pool.begin(log);
    Eigen::MatrixXd ignored;
    if (effect.effect->columns(series[log], {channel.kind, channel.index, about, &pool}, effect.at,
                               shape, ignored) &&
        pool.empty())
      break;  // the effect fits no section
  }
  pool.complete();
  return pool;
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
  SectionPool pool = sections(effect, shape, channel, about);
  for (std::size_t log = first_log; log < last_log; ++log) {
    Eigen::MatrixXd raw;
    pool.begin(log);
    const Eigen::MatrixXd inertial =
        inertial_columns(*effect.effect, series[log], {channel.kind, channel.index}, effect.at);
    bool through_flow = false;  // over the return edge
    if (!effect.effect->columns(
            series[log], {channel.kind, channel.index, about, pool.empty() ? nullptr : &pool},
            effect.at, shape, raw)) {
      through_flow = channel.flow_slope.size() > 0 && channel.index == effect.at &&
                     effect.effect->return_edge_flow(series[log], effect.at, shape, raw);
      if (!through_flow) raw.resize(0, 0);
    }
    if (raw.size() == 0) {
      if (inertial.size() == 0) continue;
      raw.setZero(inertial.rows(), inertial.cols());  // a mass that turns about a vertical axis
    }
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
    if (inertial.size() > 0)
      raw += inertial.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
    if (channel.kind == EvidenceKind::kForce) {
      for (Index c = 0; c < raw.cols(); ++c)
        raw.col(c) =
            behind_force(log, channel.index,
                         raw.col(c).unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; }));
    }
    if (result.size() == 0) result.setZero(channel.rows(), raw.cols());
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      if (channel.log[b] != static_cast<int>(log)) continue;
      for (Index r = channel.blocks[b].first; r < channel.blocks[b].last; ++r) {
        for (Index c = 0; c < raw.cols(); ++c) {
          double v = raw(channel.sample[static_cast<std::size_t>(r)], c);
          if (through_flow) v *= channel.flow_slope[r];
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
    const std::vector<EffectParameter>& parameters = known.effect->info().parameters;
    for (std::size_t p = 0; p < parameters.size(); ++p)
      if (!parameters[p].linear) before.push_back(known.values[p]);
    Eigen::MatrixXd there;
    const bool other = !std::equal(before.begin(), before.end(), shape.begin(), shape.end());
    if (!is_replaced_when_changed(*known.effect) || !other) return;
    SectionPool pool = sections({known.effect, known.at}, before, channel, {});
    pool.begin(log);
    if (known.effect->columns(series[log],
                              {channel.kind, channel.index, {}, pool.empty() ? nullptr : &pool},
                              known.at, before, there))
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
    VectorXd together = acting * values;
    acting = acting_columns(acting);
    channel.shared.push_back(
        {{effect.effect, effect.at}, std::move(together), channel.baseline.cols(), acting.cols()});
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

std::vector<EffectAt> effects_not_in(const CraneModel& model) {
  std::vector<EffectAt> out;
  for (const EffectAt& c : candidates(model.machine)) {
    const bool known =
        std::any_of(model.effects.begin(), model.effects.end(),
                    [&](const AppliedEffect& e) { return e.effect == c.effect && e.at == c.at; });
    if (!known) out.push_back(c);
  }
  return out;
}

}  // namespace sparflow
