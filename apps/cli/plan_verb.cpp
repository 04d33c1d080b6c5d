#include "apps/cli/console.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/plan_page.h"
#include "models/math/error.h"
#include "problems/problem_file.h"

namespace sparflow::cli {
namespace {

struct PlanArguments {
  std::string problem, output;
  SeedOptions seeds;
  Outputs outputs;
};

int run(const PlanArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("plan", outputs, {{"--problem", a.problem}});
  check_writable(a.output);
  a.outputs.check();
  const MotionProblem problem = load_problem(a.problem);
  for (const std::string& w : problem.machine_warnings) warn(w);
  for (const std::string& n : problem.notes) note(n);
  const Seeds seeds = [&] {
    Progress progress("plan");
    return plan_task(problem, a.seeds, console_listener([&](double share, const std::string& what) {
                       progress(share, what);
                     }));
  }();
  tell(plan_table(problem, seeds));
  for (const std::string& r : seeds.refused) warn(r);
  if (!a.output.empty())
    write_file_atomically(a.output, plan_csv(problem.machine, seeds.paths.paths));
  if (!a.outputs.report.empty()) plan_page(problem, drawn_paths(seeds)).write(a.outputs.report);
  if (!a.outputs.json.empty()) a.outputs.write_json(plan_json(problem, seeds));
  return seeds.paths.status == SeedStatus::kFound ? kDone : kNotSolved;
}

}  // namespace

void add_plan_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<PlanArguments>();
  CLI::App* verb = app.add_subcommand(
      "plan", "find collision-free paths from start to goal (OMPL); energy is not considered");
  verb->add_option("--problem,-p", a->problem, "motion problem (YAML)")
      ->required()
      ->type_name("FILE");
  verb->add_option("--output,-o", a->output, "file for the waypoints of all paths (CSV)")
      ->type_name("PATHS.csv");
  verb->add_option("--paths", a->seeds.count, "largest number of paths")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb->add_option("--seconds", a->seeds.seconds, "time for the search [s]")
      ->check(number_from(1e-3, 1e6))
      ->capture_default_str();
  verb->add_option("--seed", a->seeds.random_seed, "random seed")->capture_default_str();
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
