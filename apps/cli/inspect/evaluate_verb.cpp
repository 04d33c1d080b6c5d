#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/tasks/evaluate_task.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct EvaluateArguments {
  std::string model, motion, problem, mapping, output;
  double payload = -1.0;
  double rate = 0.0;
  Outputs outputs;
};

int run(const EvaluateArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("evaluate", outputs,
                      {{"MOTION.csv", a.motion},
                       {"--model", a.model},
                       {"--problem", a.problem},
                       {"--mapping", a.mapping}});
  check_writable(a.output);
  a.outputs.check();
  ProblemAndModel both;
  const bool by_problem = !a.problem.empty();
  if (by_problem) {
    both = load_problem_and_model(a.problem, a.model);
    require_one_move("evaluate", both.problem);
  } else if (a.model.empty()) {
    throw UsageError("evaluate: give --model MODEL.json, or --problem FILE that names a model");
  } else {
    both.model = load_model_with_warnings(a.model);
  }
  const CraneModel& model = both.model;
  begin_work("reading " + a.motion);
  OwnMotion motion = load_own_motion(a.motion, model.machine, a.mapping, console_listener());
  EvaluateTask task;
  task.payload = a.payload;
  const Evaluated done =
      evaluate_task(model, by_problem ? &both.problem : nullptr, std::move(motion), task);
  if (!a.output.empty()) write_file_atomically(a.output, evaluated_csv(model, done, a.rate));
  if (!a.outputs.json.empty())
    a.outputs.write_json(evaluation_json(model, done.problem, done.evaluation));
  if (!a.outputs.report.empty())
    evaluation_page(model, done.problem, done.evaluation).write(a.outputs.report);
  tell(evaluation_table(model, done.problem, done.evaluation));
  return !by_problem || limits_kept(done.evaluation) ? kDone : kVerification;
}

}  // namespace

void add_evaluate_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<EvaluateArguments>();
  CLI::App* verb =
      app.add_subcommand("evaluate", "price a motion of your own: energy, losses, limits");
  verb->add_option("motion", a->motion,
                   "motion (CSV) of optimize, or a log or table with t_s and q_<joint> or "
                   "x_<cylinder>_m")
      ->required()
      ->type_name("MOTION.csv");
  verb->add_option("--model", a->model, "fitted model; absent: the one that the problem names")
      ->type_name("MODEL.json");
  verb->add_option(
          "--problem,-p", a->problem,
          "motion problem (YAML) whose limits, obstacles, payload, duration, start and goal judge "
          "the motion; exit code 5 when it breaks one")
      ->type_name("FILE");
  verb->add_option("--payload", a->payload, "payload; absent: that of the problem or of the log")
      ->type_name("KG")
      ->check(number_from(0.0, 1e6));
  verb->add_option("--output,-o", a->output,
                   "motion with flows, pressures, strokes and commands to write (CSV)")
      ->type_name("MOTION.csv");
  verb->add_option("--rate", a->rate, "rows per second of --output; absent: as in the motion")
      ->type_name("HZ")
      ->check(number_from(0.1, 1e5));
  verb->add_option("--mapping", a->mapping,
                   "mapping file for tables with other column names (YAML)")
      ->type_name("FILE");
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
