#pragma once
/// Which cylinder leads a load-sensing pump in a log, with what effects add to the cylinders' demands.
#include <span>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/effects/series.h"

namespace sparflow {

/// What effects without memory add to what each cylinder asks of its pump. NaN where flow or pose is not known.
/// @return [samples x cylinders, Pa]; no rows when none of them acts there
Eigen::MatrixXd asked_by_effects(std::span<const AppliedEffect> effects, const MachineSeries& log);

/// The log's pumps as they are led when these effects act: `leader` asks for most with what they add, `demand` is what
/// it asks for without. So demand and the effects' columns together are the exact law at these parameters.
std::vector<PumpSeries> pumps_led_by(std::span<const AppliedEffect> effects,
                                     const MachineSeries& log);

}  // namespace sparflow
