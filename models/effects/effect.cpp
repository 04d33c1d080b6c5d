#include "models/effects/effect.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "models/effects/hydraulics.h"
#include "models/effects/instant.h"
#include "models/machine/inertial_torque.h"
#include "models/machine/static_force.h"

namespace sparflow {
namespace {

using Matrix = Eigen::MatrixXd;

Matrix forces_of(const Machine& machine, const MachineSeries& log) {
  StaticForce statics(machine);
  const Eigen::Index n = log.samples();
  Matrix result(n, machine.cylinder_count());
  Eigen::VectorXd q(machine.joint_count());
  for (Eigen::Index i = 0; i < n; ++i) {
    q = log.q.row(i);
    if (!q.allFinite()) {
      result.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    statics.update(q.data(), log.payload[i], 0);
    result.row(i) = statics.force().transpose();
  }
  return result;
}

/// Inertial force of one cylinder over a log, for the whole of the machine's masses. [N]
Eigen::VectorXd inertial_forces_of(const Machine& machine, const MachineSeries& log, int cylinder) {
  const auto c = static_cast<std::size_t>(cylinder);
  const int joint = machine.cylinders[c].joint;
  Eigen::VectorXd result =
      Eigen::VectorXd::Constant(log.samples(), std::numeric_limits<double>::quiet_NaN());
  Eigen::VectorXd q, qd, qdd;
  for (Eigen::Index i = 0; i < log.samples(); ++i) {
    q = log.q.row(i);
    qd = log.qd.row(i);
    qdd = log.qdd.row(i);
    if (!q.allFinite() || !qd.allFinite() || !qdd.allFinite()) continue;
    try {
      result[i] = inertial_torque<double>(machine, q, qd, qdd, log.payload[i])[joint] /
                  log.cylinders[c].rate[i];
    } catch (const std::domain_error&) {
      continue;  // a four-bar does not close
    }
  }
  return result;
}

/// Typical values of an effect's linear parameters, which come first. [SI]
std::vector<double> typical_changes(const Effect& effect) {
  std::vector<double> sizes;
  for (const EffectParameter& parameter : effect.info().parameters)
    if (parameter.linear) sizes.push_back(parameter.typical);
  return sizes;
}

}  // namespace

const char* effect_stage_name(EffectStage stage) {
  switch (stage) {
    case EffectStage::kForce:
      return "force";
    case EffectStage::kFlow:
      return "flow";
    case EffectStage::kPressure:
      return "pressure";
    case EffectStage::kPump:
      return "pump";
    case EffectStage::kSensor:
      return "sensor";
  }
  return "";
}

std::vector<int> Effect::places(const Machine& machine) const {
  int count = 0;
  switch (info().place) {
    case EffectPlace::kMachine:
      return {-1};
    case EffectPlace::kJoint:
      count = machine.joint_count();
      break;
    case EffectPlace::kCylinder:
      count = machine.cylinder_count();
      break;
    case EffectPlace::kPump:
      count = machine.pump_count();
      break;
  }
  std::vector<int> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

std::vector<double> Effect::grid(const MachineSeries&, int, int shape_index) const {
  int k = 0;
  for (const EffectParameter& parameter : info().parameters) {
    if (!parameter.linear && k++ == shape_index) return parameter.grid;
  }
  return {};
}

bool Effect::columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
                     std::span<const double> shape, Eigen::MatrixXd& columns) const {
  const std::vector<EvidenceKind> kinds = shows_in();
  if (std::find(kinds.begin(), kinds.end(), measured.kind) == kinds.end()) return false;
  if (measured.kind != EvidenceKind::kForce && measured.kind != EvidenceKind::kPump) return false;
  const Eigen::Index n = log.samples();
  std::vector<double> p;
  Eigen::Index linear = 0;
  for (const EffectParameter& parameter : info().parameters) {
    if (parameter.linear) {
      ++linear;
      p.push_back(0.0);
    }
  }
  p.insert(p.end(), shape.begin(), shape.end());
  columns.setZero(n, linear);
  if (measured.kind == EvidenceKind::kForce && changes_machine()) {
    const Matrix nominal = forces_of(*log.machine, log);
    for (Eigen::Index k = 0; k < linear; ++k) {
      // The step is the typical value: exact for masses, the secant for angles.
      const double size = info().parameters[static_cast<std::size_t>(k)].typical;
      Machine changed = *log.machine;
      std::vector<double> unit = p;
      unit[static_cast<std::size_t>(k)] = size;
      change_machine(changed, at, unit);
      columns.col(k) =
          (forces_of(changed, log).col(measured.index) - nominal.col(measured.index)) / size;
    }
    return columns.array().abs().maxCoeff() > 0.0 || !columns.allFinite();
  }
  Instant<double> instant = make_instant(*log.machine);
  const auto count =
      static_cast<std::size_t>(measured.kind == EvidenceKind::kForce ? log.machine->cylinder_count()
                                                                     : log.machine->pump_count());
  std::vector<double> out(count), demand(static_cast<std::size_t>(log.machine->cylinder_count()));
  bool any = false;
  Eigen::MatrixXd asked;  // through the demand, which the pump may follow late
  if (measured.kind == EvidenceKind::kPump) asked.setZero(n, linear);
  const auto set_row = [&](Eigen::Index i) {
    fill_instant(log, i, instant);
    for (Eigen::Index k = 0; k < linear; ++k) {
      std::fill(out.begin(), out.end(), 0.0);
      std::fill(demand.begin(), demand.end(), 0.0);
      p[static_cast<std::size_t>(k)] = 1.0;
      if (measured.kind == EvidenceKind::kForce) {
        add_force(instant, at, p, out);
      } else {
        add_pump(instant, at, p, out);
        add_demand(instant, at, p, demand);
        const int leader = instant.leader[static_cast<std::size_t>(measured.index)];
        if (leader >= 0) asked(i, k) = demand[static_cast<std::size_t>(leader)];
        any = any || asked(i, k) != 0.0;
      }
      p[static_cast<std::size_t>(k)] = 0.0;
      columns(i, k) = out[static_cast<std::size_t>(measured.index)];
      any = any || columns(i, k) != 0.0;
    }
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    try {
      set_row(i);
    } catch (const std::
                 domain_error&) {  // the position is not known, or a four-bar does not close there
      columns.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
      std::fill(p.begin(), p.begin() + linear, 0.0);
    }
  }
  for (Eigen::Index k = 0; k < asked.cols(); ++k) {
    const double size = info().parameters[static_cast<std::size_t>(k)].typical;
    columns.col(k) += reaching_pump(log, measured.index, size * asked.col(k)) / size;
  }
  return any;
}

Matrix inertial_columns(const Effect& effect, const MachineSeries& log,
                        const MeasuredQuantity& measured, int at) {
  if (!effect.changes_machine() || measured.kind != EvidenceKind::kForce || log.inertia == 0.0)
    return {};
  const Eigen::VectorXd nominal = inertial_forces_of(*log.machine, log, measured.index);
  const std::vector<double> sizes = typical_changes(effect);
  Matrix columns(log.samples(), static_cast<Eigen::Index>(sizes.size()));
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    std::vector<double> values(effect.info().parameters.size(), 0.0);
    values[k] = sizes[k];
    Machine changed = *log.machine;
    effect.change_machine(changed, at, values);
    columns.col(static_cast<Eigen::Index>(k)) =
        log.inertia * (inertial_forces_of(changed, log, measured.index) - nominal) / sizes[k];
  }
  return columns;
}

std::string variant_text(const EffectParameter& p, double value) {
  for (std::size_t i = 0; i < p.variants.size(); ++i) {
    if (p.grid[i] == value) return p.variants[i];
  }
  return "";
}

std::string effect_key(const EffectInfo& info, const Machine& machine, int at) {
  const auto i = static_cast<std::size_t>(at);
  switch (info.place) {
    case EffectPlace::kMachine:
      return info.id;
    case EffectPlace::kJoint:
      return info.id + ":" + machine.joints[i].name;
    case EffectPlace::kCylinder:
      return info.id + ":" + machine.cylinders[i].name;
    case EffectPlace::kPump:
      return info.id + ":" + machine.pumps[i].name;
  }
  return info.id;
}

std::string AppliedEffect::key(const Machine& machine) const {
  return effect_key(effect->info(), machine, at);
}

}  // namespace sparflow
