#pragma once
/// Converts a log's signals to the series on which effects are evaluated, and evaluates effects on them.
#include "identification/signals/signals.h"
#include "models/chain/crane_model.h"
#include "models/effects/series.h"

namespace sparflow {

/// Measured forces and chamber pressures are smoothed by the position's filter; the pumps' demand uses the pressures as
/// logged. The demand of a load-sensing pump is empty when a command or both chamber pressures of a cylinder it feeds are
/// not logged, and NaN where the supply chamber's pressure is not measured. The result owns its machine.
/// @param model gives machine, standby, margins and, with the demands of its effects, the load-sensing leader
/// @param signals of the machine as its file describes it
MachineSeries make_series(const CraneModel& model, const MachineSignals& signals);

/// The same series with the valve openings (CylinderSeries::opening) that these effects leave of the commands;
/// `make_series` computes them with the model's effects.
MachineSeries with_openings(const std::vector<AppliedEffect>& effects, MachineSeries series);

/// The same series with what the valves reach by the law of these effects: openings, passed flows, and their product
/// (CylinderSeries::reached). `make_series` computes them with the model's effects.
MachineSeries with_reached(const std::vector<AppliedEffect>& effects, MachineSeries series);

/// The same series with the shares of the valves' flow that the pressure drop passes by the law of these effects
/// (CylinderSeries::passed); `make_series` computes them with the model's effects.
MachineSeries with_passed_flows(const std::vector<AppliedEffect>& effects, MachineSeries series);

/// Contribution of one effect, at its parameter values, to the measured quantity `kind` of cylinder or pump `index`, not
/// filtered: exact for effects that change the machine, else the effect's columns times its linear parameters.
/// @return [samples] force [N], rod speed [m/s] or pressure [Pa]; empty when the effect does not act on this quantity or
///   the log lacks a signal that it needs
Eigen::VectorXd effect_series(const AppliedEffect& effect, const MachineSeries& log,
                              EvidenceKind kind, int index);

}  // namespace sparflow
