#pragma once
/// A model's effects on a log: what each stage of fitting and comparing adds to the law without effects.
#include "identification/signals/signals.h"
#include "models/chain/crane_model.h"

namespace sparflow {

/// Fills what the effects say into the signals (model_force, pressure_effect, ... of identification/signals/signals.h). With
/// effects that are another machine, lengths, rates, speeds and flows become that machine's as well; the static
/// force stays the machine file's. Effects with memory work on the log as it is; laws without memory are evaluated
/// sample by sample with the model's own force. Pumps' effects build on the predicted demand where the model
/// knows the processes, else on that of the measured pressures. May be called again, with another model.
/// @param signals of the machine as its file says
void apply_effects(const CraneModel& model, MachineSignals& signals);

/// What the chain is to be asked for at one sample: signed speed that makes it see flow and direction of the signals
/// [m/s], total force [N], what effects add to working pressure, demand and return chamber [Pa].
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

/// What the effects add to the working pressure at one sample, by the process of the side asked for: of the return
/// chamber what reaches the supply, and what acts on the supply itself. [Pa]
double working_pressure_effect(const CraneModel& model, const MachineSignals& signals, int cylinder,
                               Eigen::Index k);

/// signal[k], 0 for an empty one: effects that are not there.
inline double or_zero(const Eigen::VectorXd& signal, Eigen::Index k) {
  return signal.size() == 0 ? 0.0 : signal[k];
}

}  // namespace sparflow
