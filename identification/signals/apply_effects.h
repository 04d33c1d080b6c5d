#pragma once
/// Applies a model's effects to the signals of a log: the terms that they add at each stage of fitting and comparing.
#include "identification/signals/signals.h"
#include "models/chain/crane_model.h"

namespace sparflow {

/// The same log seen through a machine with the model's effects: their contributions (model_force, pressure_effect, ... of
/// signals.h) stand in a new value, in place of those of any other model. Effects that change the machine also replace lengths, rates, speeds and flows by those of the changed machine; the static force remains
/// that of the machine file. Effects with memory are evaluated on the log's time series; laws without memory sample by
/// sample with the model's own force. Effects on a pump start from the predicted demand where the pressure models are
/// learned, else from the demand of the measured pressures.
/// @param signals of the machine as its file describes it, with or without effects
MachineSignals with_effects(const CraneModel& model, MachineSignals signals);

/// Inputs of the chain at one sample: the signed speed that gives the signals' flow and direction [m/s], the total
/// force [N], and the effects' contributions to working pressure, demand and return chamber [Pa].
struct ChainInputs {
  explicit ChainInputs(std::size_t cylinders)
      : speed(cylinders),
        force(cylinders),
        pressure(cylinders),
        demand(cylinders),
        back(cylinders) {}
  void set(const MachineSignals& signals, Eigen::Index k);
  const MachineState& evaluate(Chain& chain, bool with_std = false) const;
  std::vector<double> speed, force, pressure, demand, back;  ///< by cylinder
};

/// @return [Pa] contribution of the effects to the working pressure at one sample: those on the supply chamber, and the
///   part of those on the return chamber that the pressure model of the commanded direction transmits to the supply
double working_pressure_effect(const CraneModel& model, const MachineSignals& signals, int cylinder,
                               Eigen::Index k);

/// @return signal[k]; 0 for an empty signal, which stands for no effect
inline double or_zero(const Eigen::VectorXd& signal, Eigen::Index k) {
  return signal.size() == 0 ? 0.0 : signal[k];
}

}  // namespace sparflow
