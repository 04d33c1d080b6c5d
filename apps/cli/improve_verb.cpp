#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/diagnosis_inputs.h"
#include "apps/cli/verbs.h"
#include "apps/tasks/inputs.h"
#include "diagnosis/extension/extend.h"
#include "models/math/interruption.h"

namespace sparflow::cli {
namespace {

struct ImproveArguments {
  DiagnosisInputs inputs{"improve"};
  int max_steps = ExtendOptions{}.max_steps;
};

int run(const ImproveArguments& a) {
  const DiagnosisFiles files = a.inputs.read();
  tell_what_is_reference(files.model, files.logs, console_listener());
  ExtendOptions options;
  options.fit.threads = a.inputs.threads();
  options.max_steps = a.max_steps;
  options.date = today();
  options.diagnose.candidates = files.candidates;
  const std::unique_ptr<Journal> journal =
      a.inputs.open_journal(fmt::format("--max-steps {}", a.max_steps));
  options.journal = journal.get();
  finish_on_interrupt();
  const ExtendResult result = [&] {
    Progress progress("improve");
    return improve(files.model, files.logs, options, [&](double share, const std::string& what) {
      progress(share, what);
      if (interrupted()) throw Interruption();
    });
  }();
  write_extended(a.inputs, result);
  if (!result.interrupted) journal->remove();
  return result.interrupted ? kInterrupted : kDone;
}

}  // namespace

void add_improve_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<ImproveArguments>();
  CLI::App* verb = app.add_subcommand(
      "improve",
      "repeat diagnose and extend until no effect is missing; report the error after each step");
  a->inputs.add_model(*verb);
  a->inputs.add_logs(*verb, "logs to diagnose and learn from (CSV, MAT or a recording)");
  a->inputs.add_references(
      *verb,
      "reference logs of the same machine, recorded before the effect; the pressure "
      "models learned from them stay as they are");
  a->inputs.add_tests(*verb, "logs to judge the error on; absent: motions of --log are held out");
  a->inputs.add_output(*verb);
  verb->add_option("--max-steps", a->max_steps, "largest number of effects to add")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  a->inputs.add_candidates(*verb, "candidate effects");
  a->inputs.add_threads(*verb);
  a->inputs.add_rest(*verb);
  a->inputs.add_resume(*verb);
  verb->footer(
      "Examples:\n"
      "  sparflow improve --model crane.json --log train.csv --test test.csv -o crane2.json\n"
      "  sparflow improve --model crane.json --log today.csv --reference new_machine.csv "
      "-o crane2.json --report improve.html");
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
