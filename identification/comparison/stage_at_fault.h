#pragma once
/// Where an error arises. Every stage is fed twice: with what the stage before predicts, and with what was measured
/// there. The second leaves its own error; the difference of the two is what it inherits.
///   force     from the pose: all its own
///   flow      from the command: all its own
///   pressure  p(Q, F) with F by the model             against  with F measured (pA A_A - pB A_B, filtered)
///   pump      demands by predicted working pressures  against  by measured ones
#include <string>
#include <vector>

#include "models/chain/crane_model.h"

namespace sparflow {

struct CompareResult;

/// One quantity's error split in two, in `unit` of the field.
struct StageSplit {
  std::string stage, at;
  std::string regime;  ///< "extend" or "retract" for pressures, else ""
  std::string words;   ///< "force of boom"
  std::string unit;
  double error = 0.0;      ///< RMS of predicted - measured
  double own = 0.0;        ///< RMS with the stage before as measured
  double inherited = 0.0;  ///< RMS of what the stage before's error changes
  double noise =
      0.0;  ///< [unit] of its sensor (and of the speed, where it is one), at rest of fast change
  double spread = 0.0;  ///< standard deviation of the measured
  long n = 0;
  /// Own error (or that along the chain, where it is less) beyond noise over the measured spread, 0 = as good as can be.
  double severity = 0.0;
  /// Learned together with the errors of the stage before, which it cancels.
  bool makes_up() const { return own > 2.0 * error && inherited > 2.0 * error; }
};

struct StageAtFault {
  std::vector<StageSplit> stages;  ///< in the order of the chain; only those that could be split
  int fault = -1;                  ///< index into stages; -1 = none stands out
  /// One sentence: "The error arises in the force of boom: 20.3 kN of its own; the working pressure of boom extending
  /// inherits 9.8 of its 10.1 bar, its own error is 0.9 bar."
  std::string sentence;
};

struct StageAtFaultOptions {
  /// Own error beyond noise below this share of the measured spread is no fault.
  double least_severity = 0.05;
};

StageAtFault find_stage_at_fault(const CraneModel& model, const CompareResult& result,
                                 const StageAtFaultOptions& options = {});

}  // namespace sparflow
