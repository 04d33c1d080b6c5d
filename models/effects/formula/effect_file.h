#pragma once
/// Reads effects that a user describes in YAML, without a change of the program: `effects:` with an id, a stage, a law
/// over named signals and its parameters. Format and signals: docs/user_effects.md.
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
      true;  ///< known at the effect's stage of a planned motion; else only a log has it
};

struct UserParameter {
  std::string name, unit, meaning;
  double si = 1.0;                                 ///< SI value = shown value * si; degC stays degC
  double lower = 0.0, upper = 0.0, typical = 0.0;  ///< [SI]
  /// The law is jointly proportional to all parameters of which this is true; there is at least one.
  bool proportional = true;
  std::vector<double>
      grid;  ///< [SI] values to search from; empty for proportional ones, at least two for others
};

struct UserEffectSpec {
  std::string id, title;
  UserEffectStage stage = UserEffectStage::kForce;
  UserEffectPlace place = UserEffectPlace::kCylinder;
  Expression law;  ///< gives SI values; its parameters have the order of `parameters`
  std::vector<UserParameter> parameters;  ///< in file order
  std::vector<UserSignal> signals;        ///< in the order of law.signals()
  std::string equation;                   ///< one line of text; the law when the file gives none
  std::string citation, separated_by;     ///< may be empty
  std::vector<std::string> confused_with;
  FilePlace where;          ///< of the effect in its file
  std::string source_text;  ///< the whole file as read
  /// YAML text of this effect alone in a normal form, independent of the source's layout; a fitted model contains it, and
  /// two definitions are the same when it is.
  std::string definition;

  bool in_motion() const;  ///< every signal is known for a planned motion
};

/// @param file name of the text in messages
/// @param machine names and units of joints are checked against it; nullptr: any joint and any unit is accepted
/// @param reserved ids that are in use already, those of the catalogue
/// @throws InputError that gives place, key path, what was found, what was expected and what to do
std::vector<UserEffectSpec> parse_user_effects(const std::string& text, const std::string& file,
                                               const Machine* machine = nullptr,
                                               const std::vector<std::string>& reserved = {});
/// The same from a file. @throws InputError also when it cannot be read
std::vector<UserEffectSpec> load_user_effects(const std::string& path,
                                              const Machine* machine = nullptr,
                                              const std::vector<std::string>& reserved = {});

}  // namespace sparflow
