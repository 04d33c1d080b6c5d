#include "apps/cli/motion_inputs.h"

#include "apps/cli/console.h"

namespace sparflow::cli {

std::optional<ProblemAndModel> load_problem_with_model(const std::string& problem_path,
                                                       const std::string& model_path) {
  return sparflow::load_problem_with_model(problem_path, model_path, console_listener());
}

ProblemAndModel load_problem_and_model(const std::string& problem_path,
                                       const std::string& model_path) {
  return sparflow::load_problem_and_model(problem_path, model_path, console_listener());
}

}  // namespace sparflow::cli
