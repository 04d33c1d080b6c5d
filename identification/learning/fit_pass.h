#pragma once
/// One pass of learning on chosen samples; used by fit.cpp, fit_processes.cpp and fit_supply.cpp only.
#include "identification/learning/fit.h"

namespace sparflow {

/// What is learned from: signals of all logs and the samples of each that count.
struct TrainingData {
  const std::vector<MachineSignals>* signals = nullptr;
  std::vector<Mask> counts;
};

/// Everything one pass of learning leaves behind.
struct FitPass {
  CraneModel model;
  std::vector<ProcessFit> processes;
  std::vector<std::optional<LearnedPump>> pumps;
  std::vector<ValveFit> valves;
  std::vector<std::string> notes;
};

/// "boom extend"
std::string process_name(const Machine& machine, int cylinder, bool extend);

/// Working pressures of every hydraulic cylinder, both ways.
void learn_processes(const TrainingData& data, const FitOptions& options, FitPass& pass,
                     const std::function<void(double, const std::string&)>& progress);
void learn_valves(const TrainingData& data, FitPass& pass);
/// Margins and standby; needs the processes.
void learn_pumps(const TrainingData& data, const FitOptions& options, FitPass& pass);

}  // namespace sparflow
