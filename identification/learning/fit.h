#pragma once
/// Learns everything of a crane model from logs: a pressure process for each cylinder and direction, each
/// pump's margins and standby, the valve gains. What the logs do not show is not learned, and the result says
/// what to record. docs/fit_and_compare.md has the method.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "identification/comparison/compare.h"
#include "identification/learning/gaussian_process/learn_pressure.h"
#include "identification/learning/learn_pump.h"
#include "identification/learning/learn_valve.h"

namespace sparflow {

struct FitOptions {
  SignalOptions signals;
  /// Physical effects of the model to be learned, with their values, which stay as they are: processes, margins and
  /// gains are learned around them.
  std::vector<AppliedEffect> effects;
  /// The same as estimated without the held-out motions, for an honest figure; empty = `effects`.
  std::vector<AppliedEffect> effects_held_out;
  LearnGpOptions gp;
  LearnPumpOptions
      pump;  ///< standby of the data sheet and largest pressure come from the machine file
  /// Without test logs: every so many-th block of motion is held out for an honest figure, then everything is
  /// fitted again on all data. 0 = do not.
  int hold_out_every = 4;
  double hold_out_block_s = 8.0;  ///< [s] a longer motion is cut into blocks of about this length
  /// A process' samples are thinned to what is independent when its residual's integrated autocorrelation
  /// reaches this many samples. 0 = never.
  double thin_from = 2.0;
  int threads = 0;  ///< 0 = one for each processor
};

/// How one process was learned.
struct ProcessFit {
  int cylinder = -1;
  bool extend = true;
  long offered = 0;              ///< samples driven in this direction
  double autocorrelation = 1.0;  ///< integrated, of the first fit's residual [samples]
  int step = 1;                  ///< every so many-th sample was used
  GpReport report;               ///< of the last fit; `failure` says why there is no process
};

/// One valve section in one direction.
struct ValveFit {
  int cylinder = -1;
  bool extend = true;
  LearnedValve valve;
};

struct FitResult {
  CraneModel model;
  CompareResult train;
  std::optional<CompareResult> test;  ///< on the test logs
  std::optional<CompareResult>
      held_out;  ///< without test logs: blocks the model of that figure never saw
  std::vector<ProcessFit> processes;
  std::vector<std::optional<LearnedPump>> pumps;  ///< by pump; its margins in the order of `feeds`
  std::vector<ValveFit> valves;                   ///< those learned
  std::vector<std::string>
      notes;  ///< what was not learned, why, and what to record; whole sentences
  double seconds = 0.0;

  std::string brief() const;  ///< one line
  std::string full() const;   ///< one screen
};

/// @param progress called with a share 0..1 and what is being done, from one thread at a time; may be empty
/// @throws InputError when there is no log
FitResult fit(const Machine& machine, const std::vector<Log>& logs,
              const std::vector<Log>& test_logs = {}, const FitOptions& options = {},
              const std::function<void(double share, const std::string& what)>& progress = {});

/// Samples held out for the figure of `FitResult::held_out`, one mask a log; all false when fewer than two motions
/// could be held out.
std::vector<Mask> held_out_samples(const std::vector<MachineSignals>& signals,
                                   const FitOptions& options);

/// Blocks of motion in time order: motion segments, the long ones cut into equal parts of about `block_s`.
/// Whatever is held out is held out by whole blocks, never by rows: neighbouring rows are alike.
std::vector<SampleRange> motion_blocks(const MachineSignals& signals, double block_s);

/// 1 + 2 sum of the autocorrelations up to the first below 0.05: how many samples one independent one is
/// worth. Source: A. Sokal, "Monte Carlo methods in statistical mechanics" (1997), ch. 3.
/// @param residual in order  @param position of each in the log; a jump of other than one ends a stretch
double integrated_autocorrelation(const Eigen::VectorXd& residual,
                                  const std::vector<Eigen::Index>& position);

}  // namespace sparflow
