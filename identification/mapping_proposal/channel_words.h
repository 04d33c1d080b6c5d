#pragma once
/// What the name and the unit of a channel say about its meaning, in English and German words of the field. All scores are
/// log-odds [nat] that the channel has the meaning, against that it has another.
#include <string>
#include <vector>

#include "identification/log/log.h"

namespace sparflow {

/// Weights of words in names.
struct WordOptions {
  /// A word that belongs to one quantity alone ("Druck", "stroke").
  /// @threshold [nat] 1..5; chosen: such a word is wrong once in a dozen names
  double clear_word = 2.5;
  /// A letter or a word of several meanings ("p", "q", "load").
  /// @threshold [nat] 0.3..2; chosen: about one in three of such letters means something else
  double vague_word = 1.2;
  /// The name of the machine's part itself.
  /// @threshold [nat] 1..5; chosen: as a clear word, and a little more because machine file and log agree
  double part_name = 3.0;
  /// A synonym of the part's name ("Hubarm" for boom).
  /// @threshold [nat] 0.5..4; chosen: words of the field overlap between kinds of machines
  double part_synonym = 2.0;
  /// The name is one that the program knows without a mapping (docs/log_format.md).
  /// @threshold [nat] 4..20; chosen: it means that unless its values contradict
  double own_name = 8.0;
  /// A unit of the quantity, or of another.
  /// @threshold [nat] 1..5; chosen: a unit leaves a few of the quantities
  double right_unit = 2.0;
  /// A unit of another quantity.
  /// @threshold [nat] 2..12; chosen: units are rarely wrong, but copied headers exist
  double wrong_unit = 6.0;
};

/// A reason for or against a meaning.
struct WordEvidence {
  double log_odds = 0.0;  ///< [nat] positive speaks for the meaning
  std::string words;      ///< a clause that can stand in a sentence, "" when nothing is to be said
};

/// What a channel may be: a role of a log, or the speed of a part, which logs hold and the program computes itself.
enum class MeaningKind { kRole, kSpeed };

struct Meaning {
  Role role = Role::kCandidate;  ///< of a speed: kJointPosition or kStroke
  int index = -1;                ///< joint, cylinder or pump
  MeaningKind kind = MeaningKind::kRole;
  friend bool operator==(const Meaning&, const Meaning&) = default;
};

/// A unit as written, in SI.
struct ChannelUnit {
  enum class Of {
    kNothing,
    kTime,
    kAngle,
    kLength,
    kShare,
    kPressure,
    kForce,
    kFlow,
    kMass,
    kTemperature,
    kSpeed,
    kAngularSpeed,
    kOther
  };
  Of of = Of::kNothing;  ///< kNothing: no unit given; kOther: one that no quantity here has
  double factor = 1.0;   ///< SI = factor * number + offset
  double offset = 0.0;
  std::string word;  ///< usual spelling, for sentences
};

/// Reads the unit of a channel from what the file says, from brackets in the name, or from its last part ("CH01_bar").
ChannelUnit channel_unit(const std::string& name, const std::string& unit);

/// @return the units that a meaning's values may have where none is given, the usual first
const std::vector<ChannelUnit>& possible_units(const Meaning& meaning, const Machine& machine);

/// @return lower-case words of a name: split at signs, digits and capital letters, umlauts as ae, oe, ue, ss
std::vector<std::string> name_words(const std::string& name);

/// What name and unit of a channel say.
WordEvidence name_evidence(const std::string& name, const Meaning& meaning, const Machine& machine,
                           const WordOptions& options = {});
/// What the unit says. @param unit of `channel_unit`
WordEvidence unit_evidence(const ChannelUnit& unit, const Meaning& meaning, const Machine& machine,
                           const WordOptions& options = {});

/// What name and unit of a channel say without a machine: "pressure (bore side)"; "" when they say nothing.
std::string looks_like(const std::string& name, const ChannelUnit& unit);

/// "bore-side pressure of cylinder boom"
std::string meaning_words(const Meaning& meaning, const Machine& machine);

/// @return whether a name says that the channel is a temperature: "oil_C", "TempTank"
bool names_a_temperature(const std::string& name);

/// @return whether a name says that the column is a clock: "t", "Zeit [ms]", "timestamp"
bool names_a_clock(const std::string& name);

}  // namespace sparflow
