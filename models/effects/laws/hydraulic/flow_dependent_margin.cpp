#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"

namespace sparflow {
namespace {

class FlowDependentMargin final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "flow_dependent_margin",
        .title = "flow-dependent load-sensing margin",
        .stage = EffectStage::kPump,
        .place = EffectPlace::kPump,
        .parameters = {{"k",
                        "bar/(l/min)^2",
                        units::kBarPerLpm2,
                        0.0,
                        0.2 * units::kBarPerLpm2,
                        7e-4 * units::kBarPerLpm2,
                        "increase of every margin per squared pump flow",
                        true,
                        {}}},
        .equation = "p_pump = max(standby, P_i + margin_i + k (sum of flows)^2)",
        .signals = {"pump pressure", "working pressures", "commands", "position"},
        .confused_with = {"line_loss", "pump_lag"},
        .separated_by = "one cylinder slow and fast, then two cylinders together",
        .citation =
            "P. Krus (1988), On Load Sensing Fluid Power Systems, Linkoping (margin and "
            "losses between pump and sensing point)",
        .form_error = 0.05,
        .in_motion = "pump: demand of every cylinder of this pump"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return pumps_of_type(machine, PumpType::kLoadSensing);
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kPump}; }

  template <class T>
  void add_demand_law(const Instant<T>& s, int at, std::span<const double> p,
                      std::span<T> out) const {
    const auto pump = static_cast<std::size_t>(at);
    const T rise = p[0] * s.pump_flow[pump] * s.pump_flow[pump];
    for (const int i : s.machine->pumps[pump].feeds) out[static_cast<std::size_t>(i)] += rise;
  }
  SPARFLOW_EFFECT_LAW(add_demand)
};

}  // namespace

std::unique_ptr<Effect> make_flow_dependent_margin() {
  return std::make_unique<FlowDependentMargin>();
}

}  // namespace sparflow
