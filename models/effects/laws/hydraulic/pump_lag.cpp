#include "models/effects/builtin.h"
#include "models/effects/memory.h"

namespace sparflow {
namespace {

class PumpLag final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "pump_lag",
        .title = "pump response lag",
        .stage = EffectStage::kPump,
        .place = EffectPlace::kPump,
        // The linear parameter switches the effect on or off; the time constant is searched.
        .parameters = {{"share",
                        "-",
                        1.0,
                        0.7,
                        1.35,
                        1.0,
                        "share of the demand's change that is delayed, about 1",
                        true,
                        {}},
                       {"tau",
                        "s",
                        1.0,
                        0.02,
                        2.0,
                        0.2,
                        "time constant",
                        false,
                        {0.03, 0.05, 0.08, 0.12, 0.17, 0.24, 0.34, 0.48, 0.7, 1.0}}},
        .equation = "tau dp/dt + p = demand",
        .signals = {"pump pressure", "working pressures", "commands"},
        .confused_with = {"sensor_delay"},
        .separated_by = "repeated steps of one cylinder",
        .citation = "Kumar, Dasgupta, Ghoshal (2015); first-order lag",
        .form_error = 0.1,
        .in_motion =
            "nothing: a planned motion's pump is at its demand; a lag of tenths of a second costs "
            "at falling demand what it saves at rising demand"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kPump}; }
  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kPump || measured.index != at) return false;
    const Eigen::VectorXd& demand = log.pumps[static_cast<std::size_t>(at)].demand;
    if (demand.size() == 0) return false;
    columns = first_order_lag(log, demand, shape[0]) - demand;
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_pump_lag() { return std::make_unique<PumpLag>(); }

}  // namespace sparflow
