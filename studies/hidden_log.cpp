/// Writes a case folder of simulated measurements with a hidden effect: reference.csv, train.csv, test.csv,
/// machine.yaml, truth.json.  build/bench/hidden_log --effects coulomb_friction:boom=1,pump_lag --seed 7 -o DIR
#include <fmt/format.h>

#include "bench/program_options.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"
#include "simulator/hidden_effects/hidden_effect.h"
#include "simulator/hidden_effects/random_machine.h"
#include "simulator/hidden_effects/visibility.h"

namespace {

using namespace sparflow;
using namespace sparflow::simulator;

Machine chosen_machine(const std::string& name, std::uint64_t seed) {
  if (name != "random") return load_machine(name);
  std::vector<Machine> drawings;
  for (const char* file : {"loader_crane", "hmf_2020_k4", "swing_crane_two_pumps", "excavator"})
    drawings.push_back(load_machine(bundled_file(fmt::format("machines/{}.yaml", file))));
  // The loader crane is in the list twice, because example logs of it exist.
  drawings.push_back(drawings.front());
  drawings[1].pumps.front().type = PumpType::kLoadSensing;
  return random_machine(drawings, seed);
}

/// Parses "id", "id:at", "id=size", "id:at=size" or "id:at=size/law". @throws UsageError
HiddenEffect parse_effect(std::string text, double size) {
  HiddenEffect effect;
  effect.size = size;
  const auto cut = [&text](char mark) {
    const std::size_t at = text.find(mark);
    if (at == std::string::npos) return std::string();
    std::string rest = text.substr(at + 1);
    text.resize(at);
    return rest;
  };
  try {
    const std::string law = cut('/');
    if (!law.empty()) effect.law = std::stoi(law);
    const std::string own = cut('=');
    if (!own.empty()) effect.size = std::stod(own);
  } catch (const std::exception&) {
    throw UsageError("--effects: expected id[:at][=size][/law], got \"" + text + "\"");
  }
  effect.at = cut(':');
  effect.id = text;
  return effect;
}

void print_catalogue() {
  for (const EffectDescription& e : effect_descriptions()) {
    fmt::print("{:24} {:9} {:8} {}\n{:24} laws: {}\n", e.id, e.place,
               e.in_catalogue ? "" : "outside", e.parameters, "", fmt::join(e.laws, " | "));
  }
}

int run(int argc, char** argv) {
  bench::ProgramOptions app("Simulated measurements of a crane with a hidden effect");
  std::string machine = "random", folder;
  std::vector<std::string> effects, without;
  std::uint64_t seed = 1;
  double size = 1.0;
  bool list = false;
  CaseRequest request;
  app.add("--machine", machine, "machine file, or random");
  app.add("--effects", effects, "id[:at][=size][/law],...; absent: nothing is hidden");
  app.add("--size", size, "size of the effects; 1 = clear, 0.333 = small");
  app.add("--seed", seed, "random seed of crane, machine and motions");
  app.add("--seconds", request.log.seconds, "duration of reference and training log [s]");
  app.add("--test-seconds", request.test_seconds, "duration of the test log [s]");
  app.add("--noise", request.log.noise_factor, "sensor noise, 1 = 0.8 bar");
  app.add("--rate", request.log.rate, "rows per second [Hz], 5..200");
  app.add("--without", without, "columns to leave out: commands, pB, pump, payload, oil");
  app.flag("--strokes", request.log.channels.strokes,
           "log strokes x_<cylinder>_m instead of joint positions");
  app.flag("--list", list, "print the table of effects and their laws");
  app.add("-o,--out", folder, "case folder");
  if (const auto code = app.parse(argc, argv)) return *code;
  if (list) {
    print_catalogue();
    return 0;
  }
  if (folder.empty()) throw UsageError("give -o DIR, the folder for the case");
  for (const std::string& channel : without) {
    LogChannels& has = request.log.channels;
    bool* column = channel == "commands"  ? &has.commands
                   : channel == "pB"      ? &has.pressure_b
                   : channel == "pump"    ? &has.pumps
                   : channel == "payload" ? &has.payload
                   : channel == "oil"     ? &has.oil
                                          : nullptr;
    if (!column)
      throw UsageError("--without: expected commands, pB, pump, payload or oil, got " + channel);
    *column = false;
  }
  request.log.machine = chosen_machine(machine, seed);
  request.log.crane_seed = request.log.motion_seed = seed;
  for (const std::string& text : effects) request.log.effects.push_back(parse_effect(text, size));
  const GeneratedCase logs = generate_case(request);
  write_case(request, logs, folder);
  for (const HiddenTruth& t : logs.train.truth) {
    fmt::print("{}{}{} size {:g}, law {} ({})\n", t.id, t.at.empty() ? "" : ":", t.at, t.size,
               t.law, t.law_name);
    for (const HiddenParameter& p : t.parameters)
      fmt::print("  {} = {:.6g} {}, text-book equivalent {:.6g}\n", p.name, p.value, p.unit,
                 p.equivalent);
  }
  for (const Visibility& v : visibility(case_logs(request).train, false)) {
    fmt::print("  shows most in the {}: {:.2g} times its noise for {:.3g} s{}\n", v.channel, v.size,
               v.seconds, visible(v) ? "" : "; not visible enough for the blind test");
  }
  fmt::print("{}: {}, {} + {} + {} rows\n", folder, request.log.machine.name, logs.reference.rows(),
             logs.train.rows(), logs.test.rows());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return sparflow::bench::run_program("hidden_log", run, argc, argv);
}
