#pragma once
/// Runs the dynamic plant in time: commands in, all that happens out. Controllers, benchmarks and `sparflow simulate` stand on
/// this. Integration is by CVODES (BDF with Newton's method and a dense Jacobian); commands are held between two samples.
/// Stops and jumps of the command are events: the integrator stops at them and begins anew.
/// Source: Hindmarsh et al. (2005), SUNDIALS, ACM Trans. Mathematical Software 31(3).
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simulator/plant/system/plant_system.h"

namespace sparflow::plant {

struct RunOptions {
  /// Time between two samples of the command, and between two records. [s]
  /// @threshold [s] 0.001..0.1; chosen: logs of working machines have 10 to 100 samples a second
  double sample_time = 0.02;
  /// Relative error that the integrator allows each state in a step.
  /// @threshold [-] 1e-8..1e-2; numerical: halving it changes the pump's energy by less than 0.1 % (plant_run_test)
  double relative_tolerance = 1e-4;
  /// Change of a command between two samples from which the integrator begins anew.
  /// @threshold [-] 0.01..1; numerical: below it the error control follows without a new start
  double command_jump = 0.2;
  /// Longest step of the integrator.
  /// @threshold [s] 0.001..1; numerical: no opening of a valve is stepped over
  double longest_step = 0.02;
  /// Time in which a payload is taken or put down: as a sling tightens, the crane's load grows.
  /// @threshold [s] 0..10; chosen: a payload that appeared at once would make the pressures ring as no work does
  double payload_time = 0.8;
};

/// Energies since the start [J]. `pump_work` = sum of losses + change of `stored`, up to the integrator's error.
struct EnergyLedger {
  std::vector<double> pump_work;  ///< by pump: ideal work on its oil
  std::vector<double>
      delivered;  ///< by pump: integral of pressure times flow into the valves, as a log would tell it
  std::vector<double> pump_loss;                           ///< by pump: leakage and relief valve
  std::vector<std::array<double, kLosses>> cylinder_loss;  ///< by cylinder and place
  double tank_loss = 0.0, swing_loss = 0.0;
  double drive_work = 0.0;  ///< of drives without hydraulics
  double payload_exchange =
      0.0;              ///< energy that payloads brought when taken, or took when put down
  double stored = 0.0;  ///< change since the start
  double total_loss() const;
  double input() const;  ///< work of pumps and drives, and payload exchange
  double imbalance() const { return input() - total_loss() - stored; }
};

/// True values at one sample; vectors in the order of the machine file. SI.
struct Record {
  double t = 0.0;
  std::vector<double> q, qd;                   ///< by joint
  std::vector<double> command;                 ///< by cylinder, -1..1
  std::vector<double> spool;                   ///< by cylinder, position -1..1
  std::vector<double> pressure_a, pressure_b;  ///< [Pa] in the chambers
  std::vector<double> force;                   ///< [N] on the joint's side, positive extends
  std::vector<double> flow;                    ///< [m^3/s] from the pump, positive to the bore side
  std::vector<double> pump_pressure, pump_flow;  ///< [Pa], [m^3/s] by pump
  double tank_pressure = 0.0, oil_temperature = 0.0, payload = 0.0;
  double swing_1 = 0.0, swing_2 = 0.0;  ///< [rad] of a hanging payload
};

/// Why a run ended.
enum class RunStatus { kRunning, kKinematicsEnd, kIntegratorFailed };

/// One plant that advances in time. Movable, not thread-safe.
class PlantRun {
 public:
  /// @param q joint positions of the machine file at the start, at rest @param payload [kg]
  PlantRun(const Machine& machine, const PlantParameters& parameters, std::vector<double> q,
           double payload, RunOptions options = {});
  ~PlantRun();
  PlantRun(PlantRun&&) noexcept;

  /// Advances by one sample time with this command [-1..1] by cylinder.
  RunStatus advance(const std::vector<double>& command);
  /// Advances without a new start of the integrator by any time [s].
  RunStatus advance(const std::vector<double>& command, double duration);
  /// From now on the payload goes to this one [kg], linearly within RunOptions::payload_time.
  void set_payload(double payload);

  const Record& record() const;
  const EnergyLedger& ledger() const;
  double time() const;
  RunStatus status() const;
  const std::string& message() const;  ///< one sentence when the run ended
  const std::vector<double>& state() const;
  PlantSystem& system();
  /// Work of the integrator so far.
  struct Counts {
    long steps = 0, evaluations = 0, jacobians = 0, starts = 0;
  };
  Counts counts() const;

 private:
  struct Integrator;
  std::unique_ptr<Integrator> i_;
};

/// Command source: given what happened last, the commands until the next sample. An empty vector ends the run.
using CommandSource = std::function<std::vector<double>(const Record&)>;

struct RunResult {
  std::vector<Record> records;  ///< the first is the start
  EnergyLedger ledger;
  RunStatus status = RunStatus::kRunning;
  std::string message;
};

/// Runs `duration` seconds, or until the source ends the run.
RunResult run_plant(PlantRun& plant, const CommandSource& source, double duration);

}  // namespace sparflow::plant
