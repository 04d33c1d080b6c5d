#pragma once
/// The stages of a comparison on one log; used by compare.cpp only.
#include <set>
#include <string>
#include <vector>

#include "identification/comparison/compare.h"

namespace sparflow {

struct ChainPass;

/// Compares one log with one model.
class Comparison {
 public:
  Comparison(const CraneModel& model, const MachineSignals& signals, const Mask* only)
      : model_(model), machine_(model.machine), signals_(signals), only_(only) {}

  /// @param notes gets the quantities that cannot be compared and why
  /// @return the series of all quantities that this log measures
  std::vector<ComparedSeries> series(std::set<std::string>& notes) const;

  /// Adds this log's energy to the scores [pumps].
  void energy(std::vector<EnergyScore>& scores) const;

 private:
  bool counts(Eigen::Index k) const {
    return signals_.usable[k] && (only_ == nullptr || (*only_)[k]);
  }
  bool process_learned(std::size_t i, int direction) const {
    const CylinderModel& c = model_.cylinders[i];
    return !(direction > 0 ? c.extend : c.retract).empty();
  }
  void force(std::size_t i, std::vector<ComparedSeries>& out, std::set<std::string>& notes) const;
  void flow(std::size_t i, std::vector<ComparedSeries>& out, std::set<std::string>& notes) const;
  void pressures(std::vector<ComparedSeries>& out, std::set<std::string>& notes) const;
  void judge_sample(Eigen::Index k, const MachineState& state, ChainPass& pass) const;
  /// @param speed gets signed speeds [m/s] with the flow that the valve gains give for the commands
  /// @return false where a command or a valve gain is missing
  bool speeds_from_commands(Eigen::Index k, const Pump& pump, std::vector<double>& speed) const;
  void pump_sample(Eigen::Index k, std::size_t p, const PumpState& state, ChainPass& pass) const;

  const CraneModel& model_;
  const Machine& machine_;
  const MachineSignals& signals_;
  const Mask* only_;
};

}  // namespace sparflow
