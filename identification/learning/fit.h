#pragma once
/// Identifies a crane model from logs: a pressure model for each cylinder and direction, the margins and standby of each
/// pump, and the valve gains. Parts that the logs do not determine are not learned, and the result says what to record.
/// docs/fit_and_compare.md describes the method.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "identification/comparison/compare.h"
#include "identification/learning/gaussian_process/learn_pressure.h"
#include "identification/learning/learn_pump.h"
#include "identification/learning/learn_valve.h"
#include "identification/learning/learning_options.h"

namespace sparflow {

struct FitOptions {
  SignalOptions signals;
  /// Whether the logs' faulty channels and stretches are set aside.
  bool check_data = true;
  BadDataOptions bad_data;
  /// Physical effects of the model with fixed parameter values; pressure models, margins and gains are learned with their
  /// contributions subtracted.
  std::vector<AppliedEffect> effects;
  /// The effects as estimated without the held-out motions, for the error on those motions; empty = `effects`.
  std::vector<AppliedEffect> effects_held_out;
  LearnGpOptions gp;
  LoadsBeyondOptions loads;
  BranchCornerOptions corner;
  LearnPumpOptions pump;  ///< the machine file replaces its data-sheet standby and largest pressure
  LearnValveOptions valve;
  AutocorrelationOptions autocorrelation;
  /// Without test logs every n-th block of motion is held out to judge a model that is learned
  /// without them; the result is learned from all data. 0 = no such judgement.
  /// @threshold [blocks] 2..20; chosen: three quarters of the motions remain to learn from
  int hold_out_every = 4;
  /// Length of the blocks; a longer motion is cut into blocks of about this length.
  /// @threshold [s] 2..60; chosen: exceeds the correlation time of errors in a motion
  double hold_out_block_s = 8.0;
  /// Least number of held-out blocks for an error on held-out motions.
  /// @threshold [blocks] 1..20; chosen: a single motion says little about others
  int hold_out_least = 2;
  /// The samples of a pressure model are thinned to independent ones when the integrated
  /// autocorrelation of its residual reaches this many samples. 0 = never.
  /// @threshold [samples] 1..20; chosen: thinning takes every second sample at least
  double thin_from = 2.0;
  /// Least number of samples that remain, as far as there are as many.
  /// @threshold [samples] 50..5000; chosen: enough to represent the law, however strong their
  /// correlation
  double thin_least = 400.0;
  /// Largest change of a margin or standby at which these and the effects on the pump's pressure,
  /// which depend on each other, are settled.
  /// @threshold [Pa] 10..1e5; numerical: ends the alternate updates, at a hundredth of a bar
  double settled = 1e3;
  int threads = 0;  ///< 0 = one for each processor
  /// Whether signals and series of held-out motions stay in the result, for charts. Without them two million samples take
  /// a gigabyte less; all scores are the same.
  bool keep_held_out_series = true;
};

/// How one pressure model was learned.
struct ProcessFit {
  int cylinder = -1;
  bool extend = true;
  long offered = 0;              ///< available samples, driven in this direction
  double autocorrelation = 1.0;  ///< integrated, of the first fit's residual [samples]
  int step = 1;                  ///< every step-th sample was used
  GpReport report;               ///< of the last fit; `failure` says why there is no model
};

/// One valve section in one direction.
struct ValveFit {
  int cylinder = -1;
  bool extend = true;
  LearnedValve valve;
};

struct FitResult {
  CraneModel model;
  CompareResult train;                ///< with the bad data of these logs, which took no part
  std::optional<CompareResult> test;  ///< on the test logs
  std::optional<CompareResult>
      held_out;  ///< without test logs: on held-out blocks, by a model learned without them
  std::vector<ProcessFit> processes;
  std::vector<std::optional<LearnedPump>> pumps;  ///< by pump; its margins in the order of `feeds`
  std::vector<ValveFit> valves;                   ///< only those that could be learned
  std::vector<std::string>
      notes;  ///< what was not learned, why, and what to record; whole sentences
  double seconds = 0.0;

  std::string brief(bool timed = true) const;  ///< one line
  std::string full() const;                    ///< one screen
};

/// @param progress called with a share 0..1 and the current step, from one thread at a time; may be empty
/// @throws InputError when there is no log
FitResult fit(const Machine& machine, const std::vector<Log>& logs,
              const std::vector<Log>& test_logs = {}, const FitOptions& options = {},
              const std::function<void(double share, const std::string& what)>& progress = {});
/// The same, but each log is given back as soon as its signals are made: long logs are in memory once only.
FitResult fit(const Machine& machine, std::vector<Log>&& logs, std::vector<Log>&& test_logs,
              const FitOptions& options = {},
              const std::function<void(double share, const std::string& what)>& progress = {});

/// A model of forces and flows alone, with the options' effects: only the valve gains are learned, which takes a fraction
/// of the time that the pressure models take.
/// @param left_out [logs] masks of the samples that do not count; empty = none
CraneModel fit_forces_and_flows(const Machine& machine, const std::vector<MachineSignals>& signals,
                                const std::vector<Mask>& left_out, const FitOptions& options);

/// @return [logs] masks of the samples held out for FitResult; all false when fewer than two blocks of motion
///   could be held out
std::vector<Mask> held_out_samples(const std::vector<MachineSignals>& signals,
                                   const FitOptions& options);

/// @return [folds][logs] masks of the samples held out in each of `count` folds, which together are all motions; empty
///   where held_out_samples() has none
std::vector<std::vector<Mask>> held_out_folds(const std::vector<MachineSignals>& signals,
                                              const FitOptions& options, int count);

/// Data is held out by whole blocks of motion, because neighbouring rows are correlated.
/// @return motion segments in order of time, the long ones cut into equal parts of about `block_s`
std::vector<SampleRange> motion_blocks(const MachineSignals& signals, double block_s);

/// Number of correlated samples that carry as much information as one independent sample.
/// Source: A. Sokal, "Monte Carlo methods in statistical mechanics" (1997), ch. 3.
/// @param residual in order of time  @param position of each in the log; a step other than one ends a stretch
/// @return 1 + 2 sum of the autocorrelations up to the first that is gone
double integrated_autocorrelation(const Eigen::VectorXd& residual,
                                  const std::vector<Eigen::Index>& position,
                                  const AutocorrelationOptions& options = {});

}  // namespace sparflow
