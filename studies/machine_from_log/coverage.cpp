/// How often the 95 % intervals of machines from logs hold the truth, where logs have laws that the estimate lacks.
///   build/bench/machine_coverage --seeds 20 --seed 1
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "bench/program_options.h"
#include "identification/machine_from_log/machine_from_log.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"
#include "simulator/hidden_effects/hidden_effect.h"

namespace {

using namespace sparflow;

/// A bundled machine and the values that are blanked: words of its file and their replacement.
struct Blanked {
  const char* machine;
  std::vector<std::pair<std::string, std::string>> exchanges;
};

const std::vector<Blanked>& blanked_machines() {
  static const std::vector<Blanked> all = {
      {"loader_crane",
       {{"bore: 0.180", "bore: unknown"},
        {"rod: 0.115", "rod: unknown"},
        {"bore: 0.150", "bore: unknown"},
        {"rod: 0.100", "rod: unknown"},
        {"mass: 780, cog: [1.55, 0, 0.10]", "mass: unknown, cog: unknown"},
        {"mass: 560, cog: [1.25, 0, 0.05]", "mass: unknown, cog: unknown"}}},
      {"excavator",
       {{"bore: 0.120\n    rod: 0.085\n    parallel",
         "bore: unknown\n    rod: unknown\n    parallel"},
        {"bore: 0.140\n    rod: 0.100", "bore: unknown\n    rod: unknown"},
        {"mass: 1600, cog: [2.60, 0, 0.55]", "mass: 1600, cog: unknown"},
        {"mass: 830,  cog: [0.95, 0, 0.16]", "mass: 830, cog: unknown"}}},
      {"swing_crane",
       {{"bore: 0.125\n    rod: 0.080", "bore: unknown\n    rod: unknown"},
        {"bore: 0.110\n    rod: 0.070", "bore: unknown\n    rod: unknown"},
        {"mass: 310, cog: [1.45, 0.06, 0]", "mass: unknown, cog: unknown"},
        {"mass: 170, cog: [0.95, 0.03, 0]", "mass: unknown, cog: unknown"}}}};
  return all;
}

/// Effects of every hydraulic cylinder at once, and of the machine.
struct Laws {
  std::string name;
  std::vector<std::string> of_cylinders, of_machine;
  double size;
};

const std::vector<Laws>& law_sets() {
  static const std::vector<Laws> all = {
      {"none (noise alone)", {}, {}, 1.0},
      {"Coulomb, viscous, Stribeck",
       {"coulomb_friction", "viscous_friction", "stribeck_friction"},
       {"inertia"},
       1.0},
      {"Coulomb, load-dependent", {"coulomb_friction", "load_friction"}, {"inertia"}, 1.0},
      {"offset, compressibility, line loss",
       {"coulomb_friction", "pressure_offset", "compressibility", "line_loss"},
       {},
       1.0},
      {"all of them, half as strong",
       {"coulomb_friction", "viscous_friction", "stribeck_friction", "load_friction",
        "pressure_offset", "line_loss"},
       {"inertia"},
       0.5}};
  return all;
}

struct Score {
  int values = 0, held = 0;
  std::vector<double> widths;  ///< half widths relative to the truth
};
using Scores = std::map<std::string, Score>;  ///< by kind of value

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// What is true, and how large a value of its kind is, to which its interval is compared.
struct Truth {
  double value = 0.0, size = 0.0;
};

void count(Score& score, const FoundValue& found, const Truth& truth) {
  ++score.values;
  score.held += std::abs(found.value - truth.value) <= found.half_width;
  score.widths.push_back(found.half_width / truth.size);
}

/// Of a combination of masses; the size of a moment is the link's mass times the distance of its centre.
Truth true_combination(const Machine& truth, const FoundValue& found) {
  Truth sum;
  for (const MassTerm& term : found.terms) {
    const Link& link = truth.links[static_cast<std::size_t>(term.link)];
    const double size = link.mass * (term.axis < 0 ? 1.0 : link.cog.norm());
    sum.value += term.factor * link.mass * (term.axis < 0 ? 1.0 : link.cog[term.axis]);
    sum.size = std::max(sum.size, std::abs(term.factor) * size);
  }
  return sum;
}

void print(const std::string& where, const FoundValue& found, double truth) {
  fmt::print("{}: {}: {:.5g} ± {:.2g}, truth {:.5g}, {:.2f}\n", where, found.name, found.value,
             found.half_width, truth, (found.value - truth) / found.half_width);
}

struct Case {
  const Blanked& blanked;
  const Laws& laws;
  std::uint64_t seed;
  double seconds;
  double noise;  ///< of the sensors, relative to the usual
};

simulator::LogRequest request_of(const Case& c, const Machine& truth) {
  simulator::LogRequest request;
  request.machine = truth;
  request.crane_seed = request.motion_seed = c.seed;
  request.seconds = c.seconds;
  request.noise_factor = c.noise;
  for (const std::string& id : c.laws.of_machine) request.effects.push_back({id, "", 1.0});
  for (const std::string& id : c.laws.of_cylinders) {
    const std::vector<std::string> places = simulator::places_of(id, truth);
    for (const std::string& at : places) request.effects.push_back({id, at, c.laws.size});
  }
  return request;
}

void judge(const Case& c, const MachineFromLogOptions& options, bool verbose, Scores& scores) {
  const std::string path = bundled_file(fmt::format("machines/{}.yaml", c.blanked.machine));
  const Machine truth = load_machine(path);
  std::string text = read_file(path);
  for (const auto& [from, to] : c.blanked.exchanges) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw InputError({path, 0, 0}, "", "expected: " + from);
    text.replace(at, from.size(), to);
  }
  const simulator::GeneratedLog log = simulator::generate(request_of(c, truth));
  std::vector<LogColumn> columns;
  columns.reserve(log.names.size());
  for (std::size_t k = 0; k < log.names.size(); ++k)
    columns.push_back({log.names[k], log.columns[k]});
  const MachineSketch sketch = parse_sketch(text, path, "");
  const MachineFromLog found = machine_from_logs(
      sketch, {log_from_columns("simulated.csv", columns, sketch.machine)}, {}, options);
  const std::string where = fmt::format("{}, {}, {}", c.blanked.machine, c.laws.name, c.seed);
  for (const FoundValue& v : found.values) {
    const std::size_t dot = v.name.rfind('.');
    const std::string key = v.name.substr(dot + 1);
    if (key != "bore" && key != "rod") continue;
    const std::size_t open = v.name.find('[');
    const int i = truth.cylinder_index(v.name.substr(open + 1, dot - open - 2));
    const Cylinder& cylinder = truth.cylinders[static_cast<std::size_t>(i)];
    const double expected = key == "bore" ? cylinder.bore : cylinder.rod;
    count(scores[key + "s"], v, {expected, expected});
    if (verbose) print(where, v, expected);
  }
  for (const FoundValue& v : found.combinations) {
    const Truth expected = true_combination(truth, v);
    count(scores["masses"], v, expected);
    if (verbose) print(where, v, expected.value);
  }
  scores["asked"].values += static_cast<int>(found.questions.size());
  for (const MachineQuestion& q : found.questions) {
    if (verbose) fmt::print("{}: {}: {}\n", where, q.path, q.sentence);
  }
}

std::string cell(const Score& s) {
  if (s.values == 0) return "-";
  return fmt::format("{:.0f} % of {}, ± {:.2g} %", 100.0 * s.held / s.values, s.values,
                     100.0 * median(s.widths));
}

int run(int argc, char** argv) {
  bench::ProgramOptions app(
      "Share of 95 % intervals of machines from logs that hold the truth, and their median width");
  MachineFromLogOptions options;
  int seeds = 20;
  std::uint64_t first = 1;
  double seconds = 240.0, noise = 1.0;
  bool verbose = false;
  std::vector<std::string> machines = {"loader_crane", "excavator", "swing_crane"}, own;
  app.add("--seeds", seeds, "logs of each machine and set of laws");
  app.add("--seed", first, "first random seed");
  app.add("--seconds", seconds, "duration of a log [s]");
  app.add("--noise", noise, "noise of the sensors, relative to the usual");
  app.add("--machines", machines, "bundled machines");
  app.add("--model-error", options.model_error, "standard deviation of forces of unknown forms");
  app.add("--moving", options.moving, "speed from which a rod counts as moving [m/s]");
  app.add("--steady", options.steady, "share of the acceleration's limit up to which a row counts");
  app.add("--laws", own, "effects of every cylinder in place of the sets of the table");
  app.flag("-v,--verbose", verbose, "print every value");
  if (const auto code = app.parse(argc, argv)) return *code;
  const auto begin = std::chrono::steady_clock::now();
  fmt::print("| laws in the logs | bores | rods | masses, first moments | asked |\n");
  fmt::print("|---|---|---|---|---|\n");
  std::vector<Laws> sets = law_sets();
  if (!own.empty()) sets = {{fmt::format("{}", fmt::join(own, ", ")), own, {"inertia"}, 1.0}};
  for (const Laws& laws : sets) {
    Scores scores;
    for (const Blanked& blanked : blanked_machines()) {
      if (std::find(machines.begin(), machines.end(), blanked.machine) == machines.end()) continue;
      for (int k = 0; k < seeds; ++k)
        judge({blanked, laws, first + static_cast<std::uint64_t>(k), seconds, noise}, options,
              verbose, scores);
    }
    fmt::print("| {} | {} | {} | {} | {} |\n", laws.name, cell(scores["bores"]),
               cell(scores["rods"]), cell(scores["masses"]), scores["asked"].values);
    std::fflush(stdout);
  }
  fmt::print("seeds {} to {}, {:.0f} s\n", first, first + static_cast<std::uint64_t>(seeds) - 1,
             std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return sparflow::bench::run_program("machine_coverage", run, argc, argv);
}
