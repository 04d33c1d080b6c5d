#pragma once
/// Reads a motion problem (YAML); every key is described in docs/problem_file.md.
#include <functional>
#include <string>

#include "problems/problem.h"

namespace sparflow {

/// @param path the problem file; `machine` and `model` in it are relative to its folder, or the name of a
///   bundled machine
/// @param machine replaces the file's `machine`, for example by that of a fitted model; may be null
/// @throws InputError for any error in the file or in the machine file it names. Whether the tip goal
///   can be reached is not checked here, because that needs a planner.
MotionProblem load_problem(const std::string& path, const Machine* machine = nullptr);

/// Chooses the machine of a problem while its file is read: gets the path of the model that the file names, resolved and
/// empty when it names none. @return replaces the file's `machine`; null: the file's own; must live until it is read
using ChooseMachine = std::function<const Machine*(const std::string& model_path)>;

/// The same for a machine that depends on the model which the file names, so that the file is read once.
MotionProblem load_problem_with(const std::string& path, const ChooseMachine& choose);

/// The same from text. @param name of the text in messages  @param folder base of relative paths
MotionProblem parse_problem(const std::string& text, const std::string& name,
                            const std::string& folder, const Machine* machine = nullptr);

}  // namespace sparflow
