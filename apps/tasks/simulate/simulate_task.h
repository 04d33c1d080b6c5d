#pragma once
/// The work of `simulate`: a programme or a controller drives the dynamic plant, whose sensors write a log.
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/report/model_pages/simulation_page.h"
#include "apps/tasks/task.h"
#include "models/machine/machine.h"
#include "models/machine/trajectory.h"
#include "simulator/controllers/controller.h"
#include "simulator/plant/run/plant_run.h"

namespace sparflow {

/// Makes the controller of a run, which is asked for commands at each sample and given no task.
using ControllerOf =
    std::function<std::unique_ptr<control::Controller>(const control::Knowledge& knowledge)>;

struct SimulateTask {
  std::vector<std::string> effects;  ///< items of --effects, in their order
  std::string plant;                 ///< file with parameters of the plant; empty: none
  std::optional<plant::PlantParameters> parameters;  ///< in place of that file and of effects
  std::string programme = "operator";    ///< or "cycles", where none of the following is given
  std::string track, replay;             ///< files
  std::string motion;                    ///< proposed by `diagnose`: its words or its number
  std::optional<Trajectory> trajectory;  ///< to track
  ControllerOf controller;
  std::vector<double>
      start;              ///< of a controller, by joint [rad] or [m]; empty: middle of the ranges
  double seconds = 60.0;  ///< [s]
  double rate = 50.0;     ///< [Hz] samples
  double payload = std::numeric_limits<double>::quiet_NaN();  ///< [kg] NaN: of the file, or drawn
  std::uint64_t seed = 1;
  std::function<void()> searching;  ///< called when there is something that Ctrl-C would keep
};

/// What the plant did. Plain data.
struct Simulation {
  std::shared_ptr<const Machine> machine;
  std::uint64_t seed = 1;
  std::vector<std::string> effects;
  plant::EnergyLedger ledger;
  plant::RunStatus status = plant::RunStatus::kRunning;
  plant::PlantRun::Counts counts;
  std::string message;   ///< why the run ended early
  double time = 0.0;     ///< [s] of the plant
  double elapsed = 0.0;  ///< [s] of the computer
  bool interrupted = false;
  int rows = 0;         ///< of the log
  std::string log;      ///< CSV
  SimulationView view;  ///< channels with what was recorded; the rest by simulation_view()

  bool whole() const { return !interrupted && status == plant::RunStatus::kRunning; }
};

/// @throws UsageError where more than one of track, replay, motion, trajectory and controller is given
void check_one_programme(const SimulateTask& task);

/// @throws UsageError for a number outside its range (docs/commands.md)
void check_ranges(const SimulateTask& task);

/// @throws UsageError  @throws InputError for files and effects that are wrong
Simulation simulate_task(std::shared_ptr<const Machine> machine, const SimulateTask& task,
                         const Listener& listener);

std::string simulation_json(const Simulation& simulation);
/// One screen: errors against a recording, energies. @param log path of the log that was written; empty: none
std::string simulation_table(const Simulation& simulation, const std::string& log);
std::string simulation_headline(const Simulation& simulation);
/// What the page shows, with texts and energies.
SimulationView simulation_view(const Simulation& simulation);

}  // namespace sparflow
