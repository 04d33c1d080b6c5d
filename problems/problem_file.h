#pragma once
/// Reads a motion problem (YAML); every key is described in docs/problem_file.md.
#include <string>

#include "problems/problem.h"

namespace sparflow {

/// @param path the problem file; `machine` and `model` in it are relative to its folder, or the name of a
///   bundled machine
/// @param machine replaces the file's `machine`, for example by that of a fitted model; may be null
/// @throws InputError for any error in the file or in the machine file it names. Whether the tip goal
///   can be reached is not checked here, because that needs a planner.
MotionProblem load_problem(const std::string& path, const Machine* machine = nullptr);

/// The same from text. @param name of the text in messages  @param folder base of relative paths
MotionProblem parse_problem(const std::string& text, const std::string& name,
                            const std::string& folder, const Machine* machine = nullptr);

}  // namespace sparflow
