#pragma once
/// Finds the load-sensing leader of each pump at each sample of a log, with the effects' contributions to the demands.
#include <span>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/effects/series.h"

namespace sparflow {

/// Contributions of the effects without memory to the demand of each cylinder.
/// @return [samples x cylinders] [Pa], NaN where flow or pose is unknown; no rows when no effect acts on a demand
Eigen::MatrixXd asked_by_effects(std::span<const AppliedEffect> effects, const MachineSeries& log);

/// Recomputes the log's pumps for these effects: `leader` has the highest demand with the effects' contributions, `demand`
/// is that cylinder's demand without them. The demand and the effects' columns then add up to the exact law at these
/// parameter values. `following` is set as below.
std::vector<PumpSeries> pumps_led_by(std::span<const AppliedEffect> effects,
                                     const MachineSeries& log);

/// The log's pumps with the lag (PumpSeries::following) that these effects have; leaders stay.
std::vector<PumpSeries> pumps_with_lags_of(std::span<const AppliedEffect> effects,
                                           const MachineSeries& log);

}  // namespace sparflow
