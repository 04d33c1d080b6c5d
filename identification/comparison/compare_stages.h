#pragma once
/// The stages of a comparison on one log; used by compare.cpp only.
#include <set>
#include <string>
#include <vector>

#include "identification/comparison/compare.h"

namespace sparflow {

struct ChainPass;

/// One log against one model.
class Comparison {
 public:
  Comparison(const CraneModel& model, const MachineSignals& signals, const Mask* only)
      : model_(model), machine_(model.machine), signals_(signals), only_(only) {}

  /// All quantities that this log can judge. @param notes gets what it cannot
  std::vector<ComparedSeries> series(std::set<std::string>& notes) const;

  /// Adds this log's energy to the scores (one a pump).
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
  /// Signed speeds with flow from the command by the valve gains [m/s]. @return false where that cannot be told
  bool speeds_from_commands(Eigen::Index k, const Pump& pump, std::vector<double>& speed) const;
  void pump_sample(Eigen::Index k, std::size_t p, const PumpState& state, ChainPass& pass) const;

  const CraneModel& model_;
  const Machine& machine_;
  const MachineSignals& signals_;
  const Mask* only_;
};

}  // namespace sparflow
