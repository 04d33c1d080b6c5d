#pragma once
/// A log's signals as the physical effects see them, and what a model's effects say about a log.
#include "identification/signals/signals.h"
#include "models/chain/crane_model.h"
#include "models/effects/series.h"

namespace sparflow {

/// @param model gives machine, standby and margins (for the pumps' demand) and, by what its effects add to demands, the
///        cylinder that leads; must outlive the result
/// @param signals of the machine as its file says. Measured forces and chamber pressures are taken through the
///        position's filter; the demand is made of the pressures as logged. It is empty for a load-sensing pump
///        when a command or both chamber pressures of a cylinder it feeds are not logged, and NaN where the
///        chamber that is asked for is not measured.
MachineSeries make_series(const CraneModel& model, const MachineSignals& signals);

/// What these effects leave of each command (CylinderSeries::opening); make_series does it with the model's.
void set_openings(const std::vector<AppliedEffect>& effects, MachineSeries& series);

/// What one effect adds to the measured quantity `kind` of cylinder or pump `index`, by its parameters' values, not
/// filtered: exact for effects that are another machine, else the effect's columns times its linear parameters.
/// Force [N], rod speed [m/s] or pressure [Pa].
/// @return [samples]; empty when the effect does not touch this quantity or the log lacks what it needs
Eigen::VectorXd effect_series(const AppliedEffect& effect, const MachineSeries& log,
                              EvidenceKind kind, int index);

}  // namespace sparflow
