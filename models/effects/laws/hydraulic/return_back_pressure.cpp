#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"

namespace sparflow {
namespace {

class ReturnBackPressure final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "return_back_pressure",
        .title = "shared tank-line back pressure",
        .stage = EffectStage::kPressure,
        .place = EffectPlace::kMachine,
        // The typical value gives 12 bar at 120 l/min; the 20 l/min line of a mini excavator reaches 25 bar at
        // 6e-2 bar/(l/min)^2.
        .parameters = {{"k",
                        "bar/(l/min)^2",
                        units::kBarPerLpm2,
                        0.0,
                        0.1 * units::kBarPerLpm2,
                        8.3e-4 * units::kBarPerLpm2,
                        "loss coefficient of the common tank line, filter and cooler",
                        true,
                        {}}},
        .equation = "p_return = p_return(own flow) + k (sum of all return flows)^2",
        .signals = {"both chamber pressures", "position"},
        .confused_with = {"oil_temperature", "viscous_friction", "pressure_offset"},
        .separated_by =
            "moving another cylinder at the same time: the return pressure rises with the "
            "other's flow",
        .citation = "H. E. Merritt (1967), Hydraulic Control Systems, ch. 3 (turbulent losses)",
        .form_error = 0.07,
        .in_motion =
            "pressure: as a load larger by A_return times it where the supply pressure follows "
            "the load; nothing where a counterbalance valve sets the supply pressure"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override { return whole_circuit(machine); }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kReturnExtend, EvidenceKind::kReturnRetract, EvidenceKind::kReturnLine};
  }

  template <class T>
  void add_return_law(const Instant<T>& s, int, std::span<const double> p, std::span<T> out) const {
    T total = 0.0;
    for (const T& q : s.return_flow) total += q;
    const T back = p[0] * total * total;
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (s.side[i] != 0 && s.machine->cylinders[i].hydraulic()) out[i] += back;
    }
  }
  SPARFLOW_EFFECT_LAW(add_return)

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int,
               std::span<const double>, Eigen::MatrixXd& columns) const override {
    const bool line = measured.kind == EvidenceKind::kReturnLine;
    if (!line && return_side(measured.kind) == 0) return false;
    if (!line && !log.machine->cylinders[static_cast<std::size_t>(measured.index)].hydraulic())
      return false;
    columns = total_return_flow(log).array().square().matrix();
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_return_back_pressure() {
  return std::make_unique<ReturnBackPressure>();
}

}  // namespace sparflow
