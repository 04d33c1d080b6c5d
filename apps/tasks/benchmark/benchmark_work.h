#pragma once
/// What a benchmark is made of: scenarios, models and controllers, read and checked.
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "apps/tasks/task.h"
#include "models/chain/crane_model.h"
#include "simulator/benchmark/scenario.h"
#include "simulator/controllers/controller.h"
#include "simulator/controllers/registry.h"

namespace sparflow {

/// A controller of the caller's own, which runs in this process, one run after another.
struct OwnController {
  std::string name, words;
  std::function<std::unique_ptr<control::Controller>(const control::Knowledge& knowledge)> make;
};

struct BenchmarkTask {
  std::vector<std::string> scenarios;    ///< files, or folders of them
  std::vector<std::string> controllers;  ///< of the registry; empty: all
  std::vector<std::string> processes;    ///< NAME=COMMAND
  std::vector<std::string> gains;        ///< CONTROLLER.GAIN=VALUE
  std::vector<OwnController> own;
  bool no_others = false;                   ///< no controller of the registry, where none is named
  std::string model_file;                   ///< empty: the one that each scenario names
  std::shared_ptr<const CraneModel> model;  ///< in place of files
  std::string reference;                    ///< empty: tracked_optimum, or the first
  int seeds = 0;                            ///< 0: those of the scenarios
  int jobs = 0;                             ///< runs at a time; 0: as many as there are processors
  double step_budget = 0.5;                 ///< [s] in which a process must answer
  bool no_bound = false, no_optimum = false;
  double sway_limit = 0.0;  ///< [deg] of the energy-optimal motions' payload; 0: none
  /// Called as a part of the work begins; gives whom the part tells its progress, from 0 to 1. May be empty.
  std::function<WorkProgress(const std::string& part)> begin;
};

/// A controller that takes part: one of the registry, a command, or the caller's own.
struct Entrant {
  std::string name, words;
  const control::ControllerInfo* info = nullptr;
  std::vector<double> gains;  ///< of a controller of the registry
  std::string command;        ///< of one that is a process
  std::function<std::unique_ptr<control::Controller>(const control::Knowledge& knowledge)> make =
      {};  ///< of the caller's own
};

struct BenchmarkRun {
  std::size_t scenario = 0, entrant = 0;
  std::uint64_t seed = 1;
};

struct BenchmarkWork {
  std::vector<benchmark::Scenario> scenarios;
  std::vector<std::shared_ptr<const CraneModel>> model_of;  ///< by scenario; null: none
  std::vector<Entrant> entrants;
  std::vector<BenchmarkRun> runs;
  std::vector<std::string> files;  ///< all that is read
  std::string reference;           ///< name of the controller that others are compared with
};

/// @throws UsageError  @throws InputError
BenchmarkWork benchmark_work(const BenchmarkTask& task, const Listener& listener);

/// All that results depend on; the number of jobs is not part of it.
std::string benchmark_fingerprint(const BenchmarkWork& work, const BenchmarkTask& task);

}  // namespace sparflow
