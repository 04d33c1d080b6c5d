#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/machine_pages/machine_from_log_page.h"
#include "apps/report/motion_pages/machine_page.h"
#include "apps/tasks/machine_from_log_task.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct MachineArguments {
  std::string machine;
  double payload = 0.0;
  int rows = 9;
  std::vector<std::string> posture;
  std::vector<std::string> logs, tests;  ///< of --from-log
  std::string mapping, out;
  Outputs outputs;
};

/// Completes a machine file with open values from logs. What is asked for stays open in the file that is written, so that
/// its answers can be filled in there.
int complete(const MachineArguments& a) {
  std::vector<NamedFile> inputs = named("--from-log", a.logs);
  for (const NamedFile& test : named("--test", a.tests)) inputs.push_back(test);
  inputs.push_back({"FILE", a.machine});
  inputs.push_back({"--mapping", a.mapping});
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--out", a.out});
  check_outputs_apart("machine", outputs, inputs);
  a.outputs.check();
  if (!a.out.empty()) check_writable(a.out);
  begin_work("reading logs for " + a.machine);
  const MachineFromLog found =
      machine_from_log_task({a.machine, a.logs, a.tests, a.mapping}, console_listener());
  if (!a.out.empty()) write_file_atomically(a.out, found.text);
  if (!a.outputs.json.empty()) a.outputs.write_json(machine_from_log_json(found));
  if (!a.outputs.report.empty()) machine_from_log_page(found).write(a.outputs.report);
  tell(machine_from_log_table(found));
  return found.complete() ? kDone : kNotSolved;
}

/// Replaces coordinates of the posture by those given as JOINT=VALUE. @throws UsageError
void set_posture(const Machine& machine, const std::vector<std::string>& given,
                 Eigen::VectorXd& posture) {
  for (const std::string& item : given) {
    const std::size_t equals = item.find('=');
    const int joint = machine.joint_index(item.substr(0, equals));
    char* end = nullptr;
    const double value =
        equals == std::string::npos ? 0.0 : std::strtod(item.c_str() + equals + 1, &end);
    if (joint < 0 || end == nullptr || *end != '\0') {
      std::vector<std::string> names;
      for (const Joint& j : machine.joints) names.push_back(j.name);
      throw UsageError(fmt::format(
          "machine: --at has \"{}\"; expected JOINT=VALUE [rad or m] with a joint of: {}", item,
          fmt::join(names, ", ")));
    }
    const Range& range = machine.joints[static_cast<std::size_t>(joint)].position;
    if (value < range.lo || value > range.hi) {
      throw UsageError(fmt::format("machine: --at {} is outside the joint's range, {:g} to {:g}",
                                   item, range.lo, range.hi));
    }
    posture[joint] = value;
  }
}

int run(const MachineArguments& a) {
  if (!a.logs.empty()) return complete(a);
  if (!a.out.empty() || !a.mapping.empty() || !a.tests.empty())
    throw UsageError("machine: --out, --test and --mapping belong to --from-log");
  check_outputs_apart("machine", a.outputs.files(), {{"FILE", a.machine}});
  a.outputs.check();
  MachineReview review;
  review.machine = load_machine(a.machine, &review.warnings);
  review.file = a.machine;
  review.payload = a.payload;
  review.rows = a.rows;
  review.posture = middle_posture(review.machine);
  set_posture(review.machine, a.posture, review.posture);
  for (const std::string& w : review.warnings) warn(w);
  if (!a.outputs.json.empty()) a.outputs.write_json(machine_json(review));
  if (!a.outputs.report.empty()) machine_page(review).write(a.outputs.report);
  tell(machine_table(review));
  return kDone;
}

}  // namespace

void add_machine_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<MachineArguments>();
  CLI::App* verb = app.add_subcommand("machine",
                                      "look at a machine file: drawing, stroke, lever arm and "
                                      "force over each joint; with logs, find "
                                      "the values that it leaves open");
  verb->add_option("machine", a->machine, "machine file (YAML)")->required()->type_name("FILE");
  verb->add_option("--payload", a->payload, "payload for the second column of forces")
      ->type_name("KG")
      ->check(number_from(0.0, 1e6))
      ->capture_default_str();
  verb->add_option("--at", a->posture,
                   "positions of the joints that stand still; absent: the middle of each range")
      ->type_name("JOINT=VALUE...");
  verb->add_option("--rows", a->rows, "rows of each table")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  verb->add_option("--from-log", a->logs,
                   "logs from which values that the file leaves open (unknown) are found")
      ->type_name("LOG...");
  verb->add_option("--test,-t", a->tests,
                   "logs that judge what was found; absent: parts of the logs are held out")
      ->type_name("LOG...");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  verb->add_option("--out,-o", a->out, "machine file to write; what is asked for stays open in it")
      ->type_name("FILE");
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
