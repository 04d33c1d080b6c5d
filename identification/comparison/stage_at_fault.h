#pragma once
/// Splits errors, so that the ranking (error_ranking.h) can tell the stage in which an error arises. Every stage is evaluated twice: with the prediction of the stage before as
/// input, and with the measurement there. The second gives its own error; the difference of the two is inherited.
///   force     from the pose: all of the error is its own
///   flow      from the command: all of the error is its own
///   pressure  p(Q, F) with F by the model             against  with F measured (pA A_A - pB A_B, filtered)
///   pump      demands by predicted working pressures  against  by measured ones
#include <string>
#include <vector>

#include "models/chain/crane_model.h"

namespace sparflow {

struct CompareResult;
struct ErrorRanking;

/// The error of one quantity split into own and inherited error, in `unit`.
struct StageSplit {
  std::string stage, at;
  std::string regime;  ///< "extend" or "retract" for pressures, else ""
  std::string words;   ///< "force of boom"
  std::string unit;
  double error = 0.0;      ///< RMS of predicted - measured
  double own = 0.0;        ///< RMS with measured inputs
  double inherited = 0.0;  ///< RMS of the change that the error of the stage before causes
  double noise = 0.0;      ///< [unit] noise of its sensor (sensor_noise); 0 for flows
  double spread = 0.0;     ///< standard deviation of the measured values
  long n = 0;
  /// Whether the stage was learned together with the errors of the stage before and compensates them.
  bool compensates = false;
};

struct StageAtFault {
  std::vector<StageSplit> stages;  ///< in the order of the chain; only those that could be split
  int fault = -1;                  ///< index into stages; -1 = none
  /// One sentence: "The error arises in the force of boom: 20.3 kN of its own; the working pressure of boom extending
  /// inherits 9.8 of its 10.1 bar, its own error is 0.9 bar."
  std::string sentence;
};

struct StageAtFaultOptions {
  /// Least own and least inherited error, over the error along the chain, for a stage to compensate
  /// the errors before it.
  /// @threshold [1] 1..10; chosen: two errors that partly cancel have to be clearly larger than
  /// what is left of them
  double compensation_ratio = 2.0;
  /// Least inherited error, as a share of the own error (at the stage at fault) or of the error (at
  /// the following stage), to be mentioned.
  /// @threshold [1] 0..1; chosen: a smaller part is of no use to the reader
  double mentioned_share = 0.25;
};

/// Splits the errors of all quantities, in the order of the chain; names no stage.
std::vector<StageSplit> split_stages(const CraneModel& model, const CompareResult& result,
                                     const StageAtFaultOptions& options = {});

/// Names the stage at fault: the one that the ranking says (ErrorRanking::at_fault).
void name_stage_at_fault(const ErrorRanking& ranking, StageAtFault& fault,
                         const StageAtFaultOptions& options = {});

}  // namespace sparflow
