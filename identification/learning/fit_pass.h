#pragma once
/// One pass of learning on selected samples; used by fit.cpp, fit_processes.cpp and fit_supply.cpp only.
#include "identification/learning/fit.h"

namespace sparflow {

/// Signals of all logs and masks of the samples that count.
struct TrainingData {
  const std::vector<MachineSignals>* signals = nullptr;
  std::vector<Mask> counts;
};

/// The result of one pass of learning.
struct FitPass {
  CraneModel model;
  std::vector<ProcessFit> processes;
  std::vector<std::optional<LearnedPump>> pumps;
  std::vector<ValveFit> valves;
  std::vector<std::string> notes;
};

/// @return e.g. "boom extend"
std::string process_name(const Machine& machine, int cylinder, bool extend);

/// Learns the pressure models of every hydraulic cylinder in both directions.
void learn_processes(const TrainingData& data, const FitOptions& options, FitPass& pass,
                     const std::function<void(double, const std::string&)>& progress);
void learn_valves(const TrainingData& data, const LearnValveOptions& options, FitPass& pass);
/// Learns margins and standby; requires the pressure models.
void learn_pumps(const TrainingData& data, const FitOptions& options, FitPass& pass);

}  // namespace sparflow
