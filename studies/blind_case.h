#pragma once
/// One run of the blind test: a log with a hidden effect from simulator/hidden_effects, the results of fit, diagnose
/// and extend on it as a user would call them, and their difference from the truth.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/verdict/diagnose.h"
#include "studies/baseline_methods.h"
#include "studies/trust/said_effect.h"

namespace sparflow::bench {

/// How one log is drawn and by which method it is diagnosed.
struct BlindCase {
  std::string row;  ///< none, clear, small, outside, pairs, fault
  /// Whether there is a reference log of the machine without the effect; else only the training log is used.
  bool reference = false;
  std::uint64_t seed = 0;  ///< of machine, base laws, motions, effect and noise
  double seconds = 300.0;  ///< [s] of the training log, at 50 Hz
  double noise = 1.0;      ///< [-] 1 = standard deviations of 0.8 bar, 0.3 mrad, 1 mm
  std::string only;        ///< id of the effect; empty = drawn
  std::string
      leave_out;  ///< columns that the logs lack: "rod", "payload", "commands", "oil", "pump"
  std::string judge = "ours";  ///< method: ours, truth (is given the ids), bic, gp, correlation
  bool extend = true;          ///< also add the named effects and judge them on the test log
  std::string folder;  ///< for the case's files (row_seed/train.csv ...); empty = not written
};

/// An effect that the search found, with its evidence.
struct NamedEffect {
  std::string key;
  double size = 0.0, over_form = 0.0;  ///< as in FoundEffect
  double gain = 0.0;                   ///< [nats]
};

struct BlindRun {
  BlindCase asked;
  std::string machine, truth, answer, verdict;
  std::string left_out;                   ///< why the case could not be run; empty = it was run
  std::string details;                    ///< text of the diagnosis, and the true parameters
  bool top = false;                       ///< the first named effect has the true id and place
  bool in_set = false;                    ///< a true effect is named or is a rival of a named one
  bool broken_found = false;              ///< the channel of the broken sensor was set aside
  bool all_found = false, exact = false;  ///< all true effects are named; and no others
  double set_size = 1.0;  ///< number of named effects and rivals for each true effect
  double seconds = 0.0;   ///< [s] wall time of the diagnosis
  double rows = 0.0;
  std::vector<NamedEffect> named;
  std::vector<SaidEffect> said;         ///< what a user reads, with its probability
  std::vector<double> errors;           ///< [-] relative errors of parameters
  std::vector<bool> covered;            ///< whether the 95 % interval contains the true value
  std::vector<std::string> parameters;  ///< "pump_lag.tau", in the order of `covered`
  // The following are judged on the test log, which took no part; NaN where there is nothing to judge.
  /// [-] RMS with the named effects over RMS with the true effects; geometric mean over quantities.
  double rms_ratio = 0.0;
  double energy_before = 0.0;  ///< [-] |predicted - measured| / measured, all pumps together
  double energy_after = 0.0;   ///< [-] the same with the named effects
  bool changed = false;        ///< effects were named and added
  bool made_worse = false;     ///< the error on the test log rose thereby
  std::string worse_by;        ///< names the errors that rose
  std::vector<AbsorbedError> absorbed;  ///< of method gp

  /// Whether the answer is right for the case's row.
  bool good() const;
};

/// A run as bytes for a journal, without what was asked; the same program must read them.
std::string pack_run(const BlindRun& run);
BlindRun unpack_run(const BlindCase& asked, const std::string& bytes);

/// A case that is drawn and fitted once and can be diagnosed in several ways.
class PreparedCase {
 public:
  /// @throws InputError when the case cannot be fitted
  explicit PreparedCase(const BlindCase& asked);
  ~PreparedCase();
  PreparedCase(const PreparedCase&) = delete;
  PreparedCase& operator=(const PreparedCase&) = delete;

  /// Diagnosis by the method of the program, judged without the test log.
  BlindRun diagnosed(const DiagnoseOptions& options) const;
  /// The evidence of that diagnosis.
  Evidence evidence(const DiagnoseOptions& options) const;

  struct Crane;

 private:
  BlindCase asked_;
  std::unique_ptr<Crane> crane_;
};

/// Runs one case. A case that cannot be judged throws nothing but sets `left_out`.
BlindRun run_blind(const BlindCase& asked);

/// Wall time [s] of the diagnosis of 15 000 rows with the whole catalogue, when nothing else runs.
double time_of_diagnosis(std::uint64_t seed);

}  // namespace sparflow::bench
