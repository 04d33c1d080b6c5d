#pragma once
/// Motion problems with their models, read with their warnings on stderr; the rest is apps/tasks/motion_inputs.h.
#include <optional>
#include <string>

#include "apps/tasks/motion_inputs.h"

namespace sparflow::cli {

/// As the functions of apps/tasks/motion_inputs.h.
std::optional<ProblemAndModel> load_problem_with_model(const std::string& problem_path,
                                                       const std::string& model_path);
ProblemAndModel load_problem_and_model(const std::string& problem_path,
                                       const std::string& model_path);

}  // namespace sparflow::cli
