#include <fmt/format.h>

#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/tasks/simulate/simulate_task.h"
#include "models/math/error.h"
#include "simulator/plant/parameters/plant_effects.h"

namespace sparflow::cli {
namespace {

struct SimulateArguments {
  std::string machine, output;
  SimulateTask task;
  Outputs outputs;
};

void write_page(const SimulateArguments& a, const Simulation& s) {
  const SimulateTask& task = a.task;
  SimulationView view = simulation_view(s);
  view.provenance = {{"machine", a.machine},
                     {"plant", task.plant},
                     {"seed", std::to_string(task.seed)},
                     {"effects", fmt::format("{}", fmt::join(task.effects, " "))},
                     {"recording", task.track.empty() ? task.replay : task.track}};
  simulation_page(view).write(a.outputs.report);
}

int run(const SimulateArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("simulate", outputs,
                      {{"--machine", a.machine},
                       {"--plant", a.task.plant},
                       {"--track", a.task.track},
                       {"--replay", a.task.replay}});
  check_writable(a.output);
  a.outputs.check();
  check_one_programme(a.task);
  const auto machine = std::make_shared<Machine>(load_machine_with_warnings(a.machine));
  std::optional<Progress> progress;
  SimulateTask task = a.task;
  task.searching = [&] {
    finish_on_interrupt();
    progress.emplace("simulate");
  };
  const Simulation s = simulate_task(
      machine, task,
      console_listener([&](double share, const std::string& what) { (*progress)(share, what); }));
  progress.reset();
  write_file_atomically(a.output, s.log);
  if (!a.outputs.json.empty()) a.outputs.write_json(simulation_json(s));
  if (!a.outputs.report.empty()) write_page(a, s);
  tell(simulation_table(s, a.output));
  if (s.interrupted) return kInterrupted;
  return s.whole() ? kDone : kNotSolved;
}

}  // namespace

void add_simulate_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<SimulateArguments>();
  CLI::App* verb = app.add_subcommand(
      "simulate", "write measurements of a dynamic plant that knows no law of the model");
  verb->add_option("--machine,-m", a->machine, "machine file (YAML)")
      ->required()
      ->type_name("FILE");
  verb->add_option("--output,-o", a->output, "log to write (CSV)")
      ->required()
      ->type_name("LOG.csv");
  verb->add_option("--seconds", a->task.seconds, "duration [s]")
      ->check(number_from(0.1, 1e6))
      ->capture_default_str();
  verb->add_option("--seed", a->task.seed, "random seed of work and sensors")
      ->capture_default_str();
  verb->add_option("--rate", a->task.rate, "samples per second")
      ->check(CLI::Range(10.0, 1000.0))
      ->capture_default_str();
  verb->add_option("--effects", a->task.effects,
                   "switch effects: none, all, or NAME[:AT][=VALUE|=off], in their order; see "
                   "--list-effects")
      ->delimiter(',')
      ->type_name("ITEM,...");
  verb->add_option("--plant", a->task.plant, "parameters of the plant (YAML, section plant:)")
      ->type_name("FILE");
  verb->add_option("--programme", a->task.programme,
                   "operator: random work; cycles: pick, lift, slew, place, return")
      ->check(CLI::IsMember({"operator", "cycles"}))
      ->capture_default_str();
  verb->add_option("--track", a->task.track,
                   "track the joint positions of this motion or log (CSV)")
      ->type_name("FILE");
  verb->add_option("--replay", a->task.replay,
                   "replay the commands u_<cylinder> of this file (CSV)")
      ->type_name("FILE");
  verb->add_option("--motion", a->task.motion,
                   "drive a motion that `diagnose` proposes: its words or its number")
      ->type_name("WORDS");
  verb->add_option("--payload", a->task.payload, "payload; absent: that of the file, or drawn")
      ->type_name("KG")
      ->check(number_from(0.0, 1e6));
  verb->add_flag_callback(
      "--list-effects",
      [] {
        tell(plant::effects_help());
        throw CLI::Success();
      },
      "list the effects that can be switched, and end");
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
