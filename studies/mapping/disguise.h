#pragma once
/// Logs whose channels bear other names and units, in another order and among channels that mean nothing, with the truth.
#include <string>
#include <vector>

#include "identification/mapping_proposal/mapping_proposal.h"
#include "simulator/random/random.h"

namespace sparflow::study {

/// What a log's header tells.
enum class Names {
  kGerman,       ///< "Druck Kolben Hubarm [bar]"
  kEnglish,      ///< "Boom Bore Pressure (psi)"
  kAbbreviated,  ///< "PT_BOO_CAP"
  kUnitsOnly,    ///< "ch07", with a unit
  kAnonymous     ///< "ch07"
};

struct Disguise {
  Names names = Names::kGerman;
  bool other_units = true;  ///< psi, deg, mm, mA
  bool distractors = true;  ///< engine speed, voltage, coolant, two delayed and noisy copies
};

struct TrueMeaning {
  Meaning meaning;
  int channel = -1;
  double factor = 1.0;  ///< SI of one unit; 0 = not judged (commands)
};

struct DisguisedLog {
  TimedChannels file;
  std::vector<TrueMeaning> truth;
};

/// @param columns of a log in the program's names ("pA_boom_bar")
DisguisedLog disguised_log(const std::vector<LogColumn>& columns, const Machine& machine,
                           const Disguise& disguise, simulator::Random random);

}  // namespace sparflow::study
