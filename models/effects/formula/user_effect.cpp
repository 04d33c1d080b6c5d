#include "models/effects/formula/user_effect.h"

#include <fmt/format.h>

#include <algorithm>

#include "models/effects/formula/effect_file.h"
#include "models/effects/hydraulics.h"
#include "models/effects/instant.h"
#include "models/effects/registry.h"

namespace sparflow {
namespace {

class UserEffect final : public Effect {
 public:
  explicit UserEffect(UserEffectSpec spec) : spec_(std::move(spec)) {}

  const EffectInfo& info() const override { return spec_.info; }
  std::string definition() const override { return spec_.definition; }

  std::vector<int> places(const Machine& machine) const override {
    for (const std::string& joint : spec_.joints) {
      if (!joint.empty() && machine.joint_index(joint) < 0) return {};
    }
    const bool hydraulic = info().place == EffectPlace::kCylinder && !at_stage(EffectStage::kForce);
    return hydraulic ? hydraulic_cylinders(machine) : Effect::places(machine);
  }

  std::vector<EvidenceKind> shows_in() const override {
    if (at_stage(EffectStage::kForce)) return {EvidenceKind::kForce};
    if (at_stage(EffectStage::kFlow)) return {EvidenceKind::kFlow};
    if (at_stage(EffectStage::kPump)) return {EvidenceKind::kPump};
    return {EvidenceKind::kReturnExtend, EvidenceKind::kReturnRetract, EvidenceKind::kSupplyExtend,
            EvidenceKind::kSupplyRetract};
  }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    if (at_stage(EffectStage::kForce)) add(s, at, p, out);
  }
  template <class T>
  void add_pressure_law(const Instant<T>& s, int at, std::span<const double> p,
                        std::span<T> out) const {
    if (at_stage(EffectStage::kPressure)) add(s, at, p, out);
  }
  template <class T>
  void add_pump_law(const Instant<T>& s, int at, std::span<const double> p,
                    std::span<T> out) const {
    if (at_stage(EffectStage::kPump)) add(s, at, p, out);
  }
  SPARFLOW_EFFECT_LAW(add_force)
  SPARFLOW_EFFECT_LAW(add_pressure)
  SPARFLOW_EFFECT_LAW(add_pump)

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    const std::vector<EvidenceKind> kinds = shows_in();
    if (std::find(kinds.begin(), kinds.end(), measured.kind) == kinds.end()) return false;
    if (at >= 0 && at != measured.index) return false;
    const auto i = static_cast<std::size_t>(measured.index);
    const Cylinder* cylinder = at_stage(EffectStage::kPump) ? nullptr : &log.machine->cylinders[i];
    if (cylinder != nullptr && !at_stage(EffectStage::kForce) && !cylinder->hydraulic()) {
      return false;
    }
    std::vector<Eigen::VectorXd> logged(spec_.signals.size());
    for (std::size_t k = 0; k < logged.size(); ++k) {
      if (spec_.signals[k]->of_log == nullptr) continue;
      logged[k] = spec_.signals[k]->of_log(log, i);
      if (logged[k].size() == 0) return false;
    }
    const std::size_t linear = info().parameters.size() - shape.size();
    std::vector<double> p(linear, 0.0), signals(logged.size());
    p.insert(p.end(), shape.begin(), shape.end());
    Instant<double> instant = make_instant(*log.machine);
    columns.setZero(log.samples(), static_cast<Eigen::Index>(linear));
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      fill_instant(log, k, instant);
      read_signals(instant, measured.index, signals);
      for (std::size_t c = 0; c < logged.size(); ++c) {
        if (logged[c].size() > 0) signals[c] = logged[c][k];
      }
      const double scale = cylinder ? in_evidence(*cylinder, measured.kind, instant.side[i]) : 1.0;
      for (std::size_t c = 0; c < linear; ++c) {
        p[c] = 1.0;  // The derivative, because the law is proportional to these parameters.
        columns(k, static_cast<Eigen::Index>(c)) = scale * spec_.law.evaluate<double>(signals, p);
        p[c] = 0.0;
      }
    }
    return columns.array().isNaN().any() || columns.array().abs().maxCoeff() > 0.0;
  }

 private:
  bool at_stage(EffectStage stage) const { return info().stage == stage; }

  /// What one unit of the law adds to that evidence channel.
  static double in_evidence(const Cylinder& c, EvidenceKind kind, int side) {
    if (kind == EvidenceKind::kForce) return 1.0;
    if (kind == EvidenceKind::kFlow) return side < 0 ? -1.0 / c.area_rod() : 1.0 / c.area_piston();
    // A working pressure that is higher at the same load has its cause in the return chamber or in the supply chamber.
    const int back = return_side(kind);
    return back != 0 ? supply_area(c, back) / return_area(c, back) : 1.0;
  }

  /// The law's signals that an instant has. @param index of the cylinder, or of the pump at stage pump
  template <class T>
  void read_signals(const Instant<T>& s, int index, std::vector<T>& signals) const {
    SignalPlace at{*s.machine, 0, index};
    if (!at_stage(EffectStage::kPump)) {
      at.cylinder = static_cast<std::size_t>(index);
      at.pump = s.machine->pump_of_cylinder(index);
    }
    for (std::size_t k = 0; k < signals.size(); ++k) {
      const SignalInfo& signal = *spec_.signals[k];
      const std::string& joint = spec_.joints[k];
      if (!joint.empty()) at.joint = static_cast<std::size_t>(s.machine->joint_index(joint));
      if (!signal.in_motion()) continue;
      if constexpr (std::is_same_v<T, double>) {
        signals[k] = signal.value(s, at);
      } else {
        signals[k] = signal.jet(s, at);
      }
    }
  }

  template <class T>
  void add(const Instant<T>& s, int at, std::span<const double> p, std::span<T> out) const {
    if (!spec_.in_motion()) return;
    thread_local std::vector<T> signals;
    signals.resize(spec_.signals.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (at >= 0 && static_cast<std::size_t>(at) != i) continue;
      // At rest a law of the working pressure has no supply chamber to act on.
      if (at_stage(EffectStage::kPressure) && s.side[i] == 0) continue;
      read_signals(s, static_cast<int>(i), signals);
      out[i] += spec_.law.evaluate<T>(signals, p);
    }
  }

  UserEffectSpec spec_;
};

/// Adds all of them or, when one is refused, none.
std::vector<const Effect*> add_to_catalogue(const std::string& text, const std::string& file,
                                            const Machine* machine) {
  std::vector<std::string> built_in;
  for (const auto& effect : effect_catalogue()) {
    if (effect->definition().empty()) built_in.push_back(effect->info().id);
  }
  std::vector<UserEffectSpec> specs = parse_user_effects(text, file, machine, built_in);
  for (const UserEffectSpec& spec : specs) {
    const Effect* known = find_effect(spec.info.id);
    if (known == nullptr || known->definition() == spec.definition) continue;
    throw InputError(spec.where, fmt::format("effects[{}]", spec.info.id),
                     fmt::format("another definition of \"{0}\" is in use already, from another "
                                 "file or carried by the model: law \"{1}\" there, \"{2}\" here; "
                                 "make the two alike or choose another id, such as {0}_2",
                                 spec.info.id, known->info().equation, spec.info.equation));
  }
  std::vector<const Effect*> all;
  for (UserEffectSpec& spec : specs) {
    const Effect* known = find_effect(spec.info.id);
    all.push_back(
        known != nullptr ? known : add_user_effect(std::make_unique<UserEffect>(std::move(spec))));
  }
  return all;
}

}  // namespace

std::vector<const Effect*> register_user_effects(const std::string& text, const std::string& file,
                                                 const Machine& machine) {
  return add_to_catalogue(text, file, &machine);
}

std::vector<const Effect*> register_user_effects_file(const std::string& path,
                                                      const Machine* machine) {
  return add_to_catalogue(read_file(path), path, machine);
}

}  // namespace sparflow
