#pragma once
/// One run of the blind test: a log with a hidden effect from simulator/hidden_effects, what fit, diagnose and extend
/// make of it as a user would call them, and how far that is from the truth.
#include <cstdint>
#include <string>
#include <vector>

#include "studies/simple_ways.h"

namespace sparflow::bench {

/// How one log is drawn and who judges it.
struct BlindCase {
  std::string row;  ///< none, clear, small, outside, pairs, fault
  bool reference =
      false;  ///< with a log of the same machine without the effect; else from the training log alone
  std::uint64_t seed = 0;  ///< of machine, base laws, motions, effect and noise
  double seconds = 300.0;  ///< [s] of the training log; 50 rows a second
  double noise = 1.0;      ///< 1 = 0.8 bar, 0.3 mrad, 1 mm
  std::string only;        ///< this effect; empty = drawn
  std::string
      leave_out;  ///< columns the logs do not have: "rod", "payload", "commands", "oil", "pump"
  std::string judge = "ours";  ///< ours, truth (told the ids), bic, gp, correlation
  bool extend = true;          ///< also add what was named and judge it on the test log
  std::string
      folder;  ///< where the case's files are kept (row_seed/train.csv ...); empty = nowhere
};

/// What the search found, with what spoke for it.
struct NamedEffect {
  std::string key;
  double size = 0.0, over_form = 0.0;  ///< FoundEffect
  double gain = 0.0;                   ///< [nats]
};

struct BlindRun {
  BlindCase asked;
  std::string machine, truth, answer, verdict;
  std::string left_out;  ///< why there is no run; empty = there is one
  std::string details;   ///< the whole diagnosis and the true parameters
  bool top = false;      ///< the first named is the true id at the true place
  bool in_set = false;   ///< a true one is named or among the rivals of a named one
  bool all_found = false, exact = false;  ///< all true ones are named; and nothing else
  double set_size = 1.0;                  ///< named and rivals, by true effect
  double seconds = 0.0;                   ///< [s] wall, of the diagnosis
  double rows = 0.0;
  std::vector<NamedEffect> named;
  std::vector<double> errors;           ///< relative, of parameters
  std::vector<bool> covered;            ///< truth inside the 95 % interval
  std::vector<std::string> parameters;  ///< "pump_lag.tau", in the order of `covered`
  // Judged on the test log, which took no part. NaN where there is nothing to judge.
  double rms_ratio =
      0.0;  ///< RMS with what was named / with the true ids known; geometric mean over quantities
  double energy_before = 0.0;  ///< |predicted - measured| / measured, of all pumps together
  double energy_after = 0.0;
  bool changed = false;              ///< something was named and added
  bool made_worse = false;           ///< and the error on the test log rose
  std::string worse_by;              ///< which errors rose, in words
  std::vector<Swallowed> swallowed;  ///< judge gp

  bool good() const;
};

/// Never throws for a case that cannot be judged: see `left_out`.
BlindRun run_blind(const BlindCase& asked);

/// Seconds [wall] of the diagnosis of 15 000 rows with the whole catalogue; with nothing else running.
double time_of_diagnosis(std::uint64_t seed);

}  // namespace sparflow::bench
