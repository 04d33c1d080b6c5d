#pragma once
/// Reads effects that a user describes in YAML, without a change of the program: `effects:` with an id, a stage, a law
/// over named signals and its parameters. Format and signals: docs/user_effects.md.
#include <string>
#include <vector>

#include "models/effects/formula/law.h"
#include "models/effects/formula/user_signals.h"

namespace sparflow {

struct UserEffectSpec {
  /// As in the catalogue; its signals are those of the law, in the law's order.
  EffectInfo info;
  Law law;  ///< gives SI values; its parameters have the order of info.parameters
  std::vector<const SignalInfo*> signals;  ///< in the order of law.signals()
  std::vector<std::string> joints;         ///< that these signals name, "" for others
  FilePlace where;                         ///< of the effect in its file
  /// YAML text of this effect alone in a normal form, independent of the source's layout; a fitted model contains it, and
  /// two definitions are the same when it is.
  std::string definition;

  bool in_motion() const;  ///< every signal is known at the effect's stage of a planned motion
};

/// @param file name of the text in messages
/// @param machine names and units of joints are checked against it; nullptr: any joint and any unit is accepted
/// @param reserved ids that are in use already, those of the catalogue
/// @throws InputError that gives place, key path, what was found, what was expected and what to do
std::vector<UserEffectSpec> parse_user_effects(const std::string& text, const std::string& file,
                                               const Machine* machine = nullptr,
                                               const std::vector<std::string>& reserved = {});

/// The unit of what a law of the stage gives.
Dimension stage_dimension(EffectStage stage);

}  // namespace sparflow
