#pragma once
/// Effects a user describes in YAML, without touching the program: `effects:` with an id, a stage, a law over
/// named signals and its parameters. Format and signals: docs/user_effects.md.
#include <string>
#include <utility>
#include <vector>

#include "models/effects/formula/expression.h"
#include "models/effects/formula/user_signals.h"
#include "models/machine/machine.h"
#include "models/math/error.h"

namespace sparflow {

struct UserSignal {
  SignalKind kind = SignalKind::kSpeed;
  std::string name;      ///< as in the law: "v", "q.boom"
  std::string joint;     ///< "boom", empty for others
  int joint_index = -1;  ///< -1 when no machine was given
  bool in_motion =
      true;  ///< known at the effect's stage of a planned motion; else a log alone has it
};

struct UserParameter {
  std::string name, unit, meaning;
  double si = 1.0;                                 ///< SI value = shown value * si; degC stays degC
  double lower = 0.0, upper = 0.0, typical = 0.0;  ///< [SI]
  /// The law is proportional to the group of all parameters of which this is true; it is never empty.
  bool proportional = true;
  std::vector<double>
      grid;  ///< [SI] values to search from; empty for proportional ones, at least two for others
};

struct UserEffectSpec {
  std::string id, title;
  UserEffectStage stage = UserEffectStage::kForce;
  UserEffectPlace place = UserEffectPlace::kCylinder;
  Expression law;                         ///< value in SI; parameters in the order of `parameters`
  std::vector<UserParameter> parameters;  ///< in file order
  std::vector<UserSignal> signals;        ///< in the order of law.signals()
  std::string equation;                   ///< one line of text; the law when the file gives none
  std::string citation, separated_by;     ///< may be empty
  std::vector<std::string> confused_with;
  FilePlace where;          ///< of the effect in its file
  std::string source_text;  ///< the whole file as read
  /// A file with this effect alone, in one form whatever the layout of the source: what a fitted model carries, and
  /// what tells whether two definitions are the same.
  std::string definition;

  bool in_motion() const;  ///< every signal is known for a planned motion
};

/// @param file how messages call the text
/// @param machine names and units of joints are checked against it; nullptr: any joint, any unit passes
/// @param reserved ids that are taken already, those of the catalogue
/// @throws InputError with place, key path, what was found, what was expected and what to do
std::vector<UserEffectSpec> parse_user_effects(const std::string& text, const std::string& file,
                                               const Machine* machine = nullptr,
                                               const std::vector<std::string>& reserved = {});
/// The same from a file. @throws InputError also when it cannot be read
std::vector<UserEffectSpec> load_user_effects(const std::string& path,
                                              const Machine* machine = nullptr,
                                              const std::vector<std::string>& reserved = {});

}  // namespace sparflow
