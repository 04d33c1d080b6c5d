#pragma once
/// Compares a model with measurements stage by stage: the inputs of each stage are measured or computed from the measured
/// pose, so that an error appears at the stage where it arises.
///   force     static force by virtual work            against  pA A_A - pB A_B, or the log's force
///   flow      valve gain * |u|                        against  area * dx/dt
///   flow_sensor  area * dx/dt                         against  the log's flow
///   pressure  p(Q, F), Q from speed, F static         against  the pressure of the supply chamber
///   pump      max of demands and standby, from the same  against  the pump's pressure
///   energy    the integral of pump pressure * flow, Q from speed in both
/// Stages without measurement are not compared, and a note says so. docs/fit_and_compare.md has the equations.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "identification/comparison/compare_regions.h"
#include "identification/comparison/error_ranking.h"
#include "identification/comparison/residual_tests.h"
#include "identification/comparison/stage_at_fault.h"
#include "identification/comparison/worst_segments.h"
#include "identification/data_checks/bad_data.h"
#include "identification/data_checks/sensor_slips.h"
#include "identification/signals/signals.h"
#include "models/chain/crane_model.h"

namespace sparflow {

/// A unit for display: SI value = number * si.
struct FieldUnit {
  std::string name;
  double si = 1.0;
};

/// One compared quantity over one log; SI, [samples], NaN where it is not compared.
struct ComparedSeries {
  std::string stage;  ///< force, flow, flow_sensor, pressure, pump
  std::string at;     ///< cylinder or pump
  FieldUnit unit;     ///< unit for display
  Eigen::VectorXd measured, predicted;
  /// Predicted standard deviation of one measurement, noise included; empty where the model has none.
  Eigen::VectorXd deviation;
  /// Samples outside the flows and loads of the pressure model's training data; empty for other stages.
  Mask extrapolated;
  /// Regime of each compared sample: index into `regimes`.
  Eigen::VectorXi regime;
  std::vector<std::string>
      regimes;  ///< {"extend", "retract"}; of a pump "standby" and its load-sensing leaders

  Eigen::VectorXd residual() const { return predicted - measured; }
};

/// Scores of one quantity over all logs, SI; e = predicted - measured.
struct StageScore {
  std::string stage, at;
  std::string regime;  ///< "extend" or "retract" for pressures, else ""
  FieldUnit unit;
  double rmse = 0.0;
  double bias = 0.0;         ///< mean e
  double fit_percent = 0.0;  ///< 100 (1 - |e| / |measured - mean|); NaN when nothing varies
  double within_95_percent =
      0.0;  ///< share of samples inside the predicted 95 % interval; NaN if none
  /// Of a pressure: share of samples outside the flows and loads of its training data, and their share of the squared
  /// error; NaN for other stages.
  double extrapolated_percent = 0.0;
  double extrapolated_error_percent = 0.0;
  long n = 0;
};

/// Energy that a pump delivered over all logs, with the flow from measured speed in both. [J]
struct EnergyScore {
  std::string pump;
  double measured = 0.0;
  double predicted = 0.0;
  double relative_error = 0.0;  ///< (predicted - measured) / measured
  /// Prediction of the whole chain from commands alone (flow by valve gains); absent without commands or gains.
  std::optional<double> from_commands;
  double duration = 0.0;  ///< [s] of samples counted
};

/// One log with all its compared series, for the charts.
struct LogComparison {
  MachineSignals signals;
  std::vector<ComparedSeries> series;
};

/// Thresholds of the notes and of offsets that need no region.
struct CompareNoteOptions {
  /// Least percentage of samples outside the training data for a note on extrapolation.
  /// @threshold [%] 0..100; chosen: extrapolation is frequent
  double extrapolated_percent = 5.0;
  /// Least share of the squared error of these samples over their share of the samples.
  /// @threshold [1] 1..10; chosen: their error is above average
  double extrapolated_ratio = 1.25;
  /// Least share of the squared error that is the mean's, for an offset everywhere.
  /// @threshold [1] 0..1; chosen: the offset is the larger part of the error. A note on an offset sends the reader to a
  /// sensor's zero, which cannot mend an error whose larger part varies
  double offset_share = 0.5;
  /// Least share of the samples whose error has the offset's sign.
  /// @threshold [1] 0.5..1; chosen: normal noise has the other sign in one sample of ten beside an offset of 1.3 of its
  /// standard deviations; beside a smaller one an error may also follow the motion
  double one_sided_share = 0.9;
};

struct CompareOptions {
  SignalOptions signals;
  BadDataOptions bad_data;
  RegionOptions regions;
  bool find_regions = true;
  /// Residual tests, stage at fault, errors by regime, worst segments; requires `find_regions`.
  bool find_causes = true;
  ResidualTestOptions tests;  ///< its blocks are those of all statements on motions
  RankingOptions ranking;
  StageAtFaultOptions fault;
  WorstSegmentOptions segments;
  CompareNoteOptions notes;
};

/// A bad channel and the log it is in.
struct BadChannelOfLog {
  std::string file;
  BadChannel bad;
  bool in_errors = false;  ///< whether it stays in the errors that are stated, else it is set aside
};

/// A sensor connected or named wrongly, and the log it is in.
struct SlipOfLog {
  std::string file;
  SensorSlip slip;
};

struct CompareResult {
  long samples = 0;
  std::vector<StageScore> scores;  ///< in the order of the stages, then of the machine
  std::vector<EnergyScore> energy;
  ErrorRanking ranking;                ///< by which all outputs name and order the errors
  std::vector<WorstRegion> worst;      ///< in the order of the ranking
  ResidualTests tests;                 ///< systematic errors, with controlled false alarms
  StageAtFault fault;                  ///< split errors, and the stage at fault by the ranking
  std::vector<RegimeError> regimes;    ///< errors by regime, with 95 % intervals
  std::vector<WorstSegment> segments;  ///< motions with the largest errors, in that order
  /// Filled by `compare` and `fit`, which have the logs.
  std::vector<BadChannelOfLog> bad_data;
  std::vector<SlipOfLog> slips;    ///< sensors connected or named wrongly, where regions are sought
  std::vector<std::string> notes;  ///< what was not compared, and why; whole sentences
  std::vector<LogComparison> logs;

  const StageScore* find(const std::string& stage, const std::string& at,
                         const std::string& regime = "") const;

  // The .cpp file defines these, so that they are compiled once.
  CompareResult();
  CompareResult(const CompareResult&);
  CompareResult(CompareResult&&) noexcept;
  CompareResult& operator=(const CompareResult&);
  CompareResult& operator=(CompareResult&&) noexcept;
  ~CompareResult();
};

CompareResult compare(const CraneModel& model, const std::vector<Log>& logs,
                      const CompareOptions& options = {});

/// The same, but each log is given back as soon as its signals are made: long logs are in memory once only.
CompareResult compare(const CraneModel& model, std::vector<Log>&& logs,
                      const CompareOptions& options = {});

/// Ranks the errors anew and orders regions and motions by the ranking, as after a change of `scores`.
void rank(const Machine& machine, CompareResult& result, const CompareOptions& options = {});

/// Removes all stages but these, as where a machine file alone is compared, and ranks what is left.
void keep_stages(const Machine& machine, const std::vector<std::string>& stages,
                 CompareResult& result);

/// Compares with signals that exist already.
/// @param only [logs] mask of the samples that count; empty = all
CompareResult compare_signals(const CraneModel& model, std::vector<MachineSignals> signals,
                              const std::vector<Mask>& only, const CompareOptions& options = {});

/// One result of several that were compared on different samples, as of the folds of a cross-validation. It has the logs of
/// all, and scores over all samples; energies, regions and tests stay empty.
CompareResult join_results(const Machine& machine, std::vector<CompareResult> parts);

/// @return signals on which a residual of this series may depend, for the search and for charts: pose, speed, load,
///   payload, temperature and the log's columns without a known meaning, as far as the log has them
std::vector<RegimeSignal> regime_signals(const Machine& machine, const MachineSignals& signals,
                                         const ComparedSeries& series);

/// Calls `visit` with each of them in turn, so that only one is in memory at a time.
void for_each_regime_signal(const Machine& machine, const MachineSignals& signals,
                            const ComparedSeries& series,
                            const std::function<void(RegimeSignal&&)>& visit);

/// @param data "train", "test" or "held out"  @return the scores in the form of the model file
std::vector<StageQuality> stage_quality(const CompareResult& result, const std::string& data);

/// Machine-readable result; keys as in docs/fit_and_compare.md.
std::string compare_json(const CompareResult& result);

/// One sentence without full stop: that of the ranking, after bad data where there are any.
std::string compare_headline(const CompareResult& result);

/// One screen for a terminal.
std::string compare_table(const CompareResult& result);

}  // namespace sparflow
