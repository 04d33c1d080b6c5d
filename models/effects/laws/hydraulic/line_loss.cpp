#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"

namespace sparflow {
namespace {

/// The position of the chamber's pressure sensor decides which channel shows the loss. With a sensor at the cylinder the
/// pump pressure contains the loss while this cylinder is the load-sensing leader. With a sensor at the valve the
/// measured force contains A_supply times the loss, and the pump adds nothing. A log shows one of the two, never both.
class LineLoss final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "line_loss",
        .title = "supply-line pressure loss",
        .stage = EffectStage::kPump,
        .place = EffectPlace::kCylinder,
        .parameters = {{"k",
                        "bar/(l/min)^2",
                        units::kBarPerLpm2,
                        0.0,
                        0.2 * units::kBarPerLpm2,
                        2e-3 * units::kBarPerLpm2,
                        "turbulent part",
                        true,
                        {}},
                       {"k1",
                        "bar/(l/min)",
                        units::kBarPerLpm,
                        0.0,
                        2.0 * units::kBarPerLpm,
                        0.1 * units::kBarPerLpm,
                        "laminar part",
                        true,
                        {}},
                       {"at_valve",
                        "-",
                        1.0,
                        0.0,
                        1.0,
                        0.0,
                        "0: pressure sensors at the cylinder, 1: at the valve",
                        false,
                        {0.0, 1.0},
                        true}},
        .equation =
            "dp = k Q^2 + k1 Q; p_pump += dp while the cylinder is the load-sensing leader, or "
            "(sensor at the valve) p_supply += dp and F += A_supply dp",
        .signals = {"pump pressure or chamber pressures", "commands", "position"},
        .confused_with = {"flow_dependent_margin", "viscous_friction", "oil_temperature"},
        .separated_by =
            "steps of this cylinder at three flows, alone and while another cylinder is the "
            "load-sensing leader",
        .citation =
            "H. E. Merritt (1967), Hydraulic Control Systems, ch. 3 (laminar and turbulent "
            "losses in lines)",
        .form_error = 0.2,
        .in_motion =
            "pump: demand of the cylinder (sensors at the cylinder), or force and with it "
            "working pressure (sensors at the valve)"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kPump, EvidenceKind::kForce};
  }

  template <class T>
  void add_demand_law(const Instant<T>& s, int at, std::span<const double> p,
                      std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    if (!at_valve(p)) out[i] += loss(s.flow[i], p);
  }
  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    if (!at_valve(p) || s.side[i] == 0) return;
    out[i] += loss(s.flow[i], p) * (s.side[i] * supply_area(s.machine->cylinders[i], s.side[i]));
  }
  SPARFLOW_EFFECT_LAW(add_demand)
  SPARFLOW_EFFECT_LAW(add_force)

 private:
  static bool at_valve(std::span<const double> p) { return p[2] >= 0.5; }
  template <class T>
  static T loss(const T& flow, std::span<const double> p) {
    return flow * (p[0] * flow + p[1]);
  }
};

}  // namespace

std::unique_ptr<Effect> make_line_loss() { return std::make_unique<LineLoss>(); }

}  // namespace sparflow
