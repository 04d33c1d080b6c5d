/// How often the proposed mapping is right, by machine and by what the header tells, and whether its confidence is.
///   build/bench/mapping_study --seeds 10 --seed 101 [--real ../shared/data] [--dump FILE]
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <map>

#include "bench/program_options.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"
#include "simulator/hidden_effects/hidden_effect.h"
#include "simulator/hidden_effects/random_machine.h"
#include "studies/mapping/disguise.h"

namespace {

using namespace sparflow;
using namespace sparflow::study;

struct Judged {
  std::string machine, names;
  Meaning meaning;
  double margin = 0.0, confidence = 0.0;
  bool proposed = false, exists = false, right = false, unit_right = false;
  std::string note;
};

const char* names_word(Names n) {
  switch (n) {
    case Names::kGerman:
      return "German";
    case Names::kEnglish:
      return "English";
    case Names::kAbbreviated:
      return "abbreviated";
    case Names::kUnitsOnly:
      return "units only";
    default:
      return "anonymous";
  }
}

/// Position and stroke are one thing where the linkage is direct.
bool same_meaning(const Meaning& a, const Meaning& b, const Machine& machine) {
  if (a == b) return true;
  const auto joint = [&](const Meaning& m) {
    return m.role == Role::kStroke ? machine.cylinders[static_cast<std::size_t>(m.index)].joint
                                   : m.index;
  };
  const auto place = [](const Meaning& m) {
    return m.role == Role::kStroke || m.role == Role::kJointPosition;
  };
  if (!place(a) || !place(b) || a.kind != MeaningKind::kRole || b.kind != MeaningKind::kRole)
    return false;
  if (joint(a) != joint(b)) return false;
  const int c = machine.cylinder_of_joint(joint(a));
  return c >= 0 && std::holds_alternative<DirectLinkage>(
                       machine.cylinders[static_cast<std::size_t>(c)].linkage);
}

void judge(const DisguisedLog& log, const Machine& machine, const std::string& names,
           const ProposalOptions& options, std::vector<Judged>* all) {
  const MappingProposal p = propose_mapping(log.file, machine, options);
  std::vector<bool> met(p.meanings.size(), false);
  const auto channel_name = [&](int m) {
    return log.file.recording.channels[static_cast<std::size_t>(m)].name;
  };
  for (const TrueMeaning& t : log.truth) {
    Judged j;
    j.machine = machine.name;
    j.names = names;
    j.meaning = t.meaning;
    j.exists = true;
    for (std::size_t k = 0; k < p.meanings.size(); ++k) {
      const MeaningProposal& m = p.meanings[k];
      if (met[k] || m.channel < 0 || !same_meaning(m.meaning, t.meaning, machine)) continue;
      met[k] = true;
      j.proposed = true;
      j.margin = m.margin;
      j.confidence = m.confidence;
      j.right = m.channel == t.channel;
      j.unit_right = t.factor == 0.0 || std::abs(m.factor / t.factor - 1.0) < 0.02;
      if (!j.right)
        j.note = fmt::format("{} instead of {}", channel_name(m.channel), channel_name(t.channel));
      break;
    }
    if (!j.proposed) j.note = fmt::format("none instead of {}", channel_name(t.channel));
    all->push_back(std::move(j));
  }
  for (std::size_t k = 0; k < p.meanings.size(); ++k) {
    const MeaningProposal& m = p.meanings[k];
    if (met[k] || m.channel < 0 || m.meaning.kind != MeaningKind::kRole) continue;
    // A role that the log does not have, proposed.
    all->push_back({machine.name, names, m.meaning, m.margin, m.confidence, true, false, false,
                    false,
                    fmt::format("{} for a role that is not logged", channel_name(m.channel))});
  }
}

/// The machine as its file may be: masses as weighed or drawn, a tenth off.
Machine drawn(Machine machine, simulator::Random random) {
  for (Link& link : machine.links) link.mass *= 1.0 + random.uniform(-0.1, 0.1);
  return machine;
}

struct SimulatedCase {
  std::string file;  ///< bundled machine
  std::uint64_t seed = 1;
  double seconds = 150.0;
};

void simulated(const SimulatedCase& c, const std::vector<Names>& kinds,
               const ProposalOptions& options, std::vector<Judged>* all) {
  const auto& [file, seed, seconds] = c;
  simulator::Random random(seed, file);
  simulator::LogRequest request;
  Machine machine = load_machine(bundled_file(fmt::format("machines/{}.yaml", file)));
  simulator::MachineVariation variation;
  request.machine = simulator::vary_machine(machine, variation, seed);
  request.crane_seed = request.motion_seed = seed;
  request.seconds = seconds;
  request.channels.strokes = random.chance(0.3);
  const simulator::GeneratedLog log = simulator::generate(request);
  std::vector<LogColumn> columns;
  columns.reserve(log.names.size());
  for (std::size_t k = 0; k < log.names.size(); ++k)
    columns.push_back({log.names[k], log.columns[k]});
  const Machine given = drawn(request.machine, simulator::Random(seed, "drawn"));
  for (const Names names : kinds) {
    Disguise disguise;
    disguise.names = names;
    judge(disguised_log(columns, given, disguise, simulator::Random(seed, names_word(names))),
          given, names_word(names), options, all);
  }
}

void real(const std::string& folder, const std::vector<Names>& kinds,
          const ProposalOptions& options, std::vector<Judged>* all) {
  struct Real {
    const char *machine, *log;
  };
  const std::vector<Real> logs = {{"hmf_2020_k4", "hmf_2020_k4/Dual1SineRun_230425.csv"},
                                  {"hmf_2020_k4", "hmf_2020_k4/Dual2SineTest_230425.csv"},
                                  {"hmf_2020_k4", "hmf_2020_k4/MainSineTest_230425.csv"},
                                  {"hmf_2020_k4", "hmf_2020_k4/JibSineTest_230425.csv"},
                                  {"three_axis", "foreign_plant/ref1.csv"},
                                  {"three_axis", "foreign_plant/clean1.csv"},
                                  {"emps", "emps/estimation.csv"},
                                  {"lab_crane", "lab_crane/friction.csv"}};
  for (const Real& r : logs) {
    std::string file;
    if (std::string(r.machine) == "lab_crane") {
      file = folder + "/../machines/lab_crane.yaml";
    } else {
      file = bundled_file(fmt::format("machines/{}.yaml", r.machine));
    }
    const Machine machine = load_machine(file);
    const TimedChannels channels = read_timed_channels(folder + "/" + r.log);
    std::vector<LogColumn> columns;
    columns.push_back({"t_s", channels.recording.channels.front().time});
    for (const RecordedChannel& c : channels.recording.channels)
      columns.push_back({c.name, c.values});
    for (const Names names : kinds) {
      Disguise disguise;
      disguise.names = names;
      disguise.distractors = false;
      std::vector<Judged> own;
      judge(disguised_log(columns, machine, disguise, simulator::Random(7, names_word(names))),
            machine, names_word(names), options, &own);
      for (Judged& j : own) {
        j.machine = r.log;
        all->push_back(std::move(j));
      }
    }
  }
}

void print_table(const std::vector<Judged>& all) {
  std::map<std::string, std::map<std::string, std::array<int, 3>>> table;
  for (const Judged& j : all) {
    if (!j.exists) continue;
    for (const std::string& row : {j.machine, std::string("~ all")}) {
      std::array<int, 3>& cell = table[row][j.names];
      ++cell[0];
      cell[1] += j.right;
      cell[2] += j.right && j.unit_right;
    }
  }
  for (const auto& [machine, cells] : table) {
    fmt::print("{:40}", machine);
    for (const auto& [names, n] : cells) {
      fmt::print("  {} {:.1f} % ({:.1f} with unit) of {}", names, 100.0 * n[1] / n[0],
                 100.0 * n[2] / n[0], n[0]);
    }
    fmt::print("\n");
  }
  fmt::print("confidence        proposals  right\n");
  for (const auto& [lo, hi] :
       std::vector<std::pair<double, double>>{{0.9, 1.01}, {0.7, 0.9}, {0.5, 0.7}, {0.0, 0.5}}) {
    int n = 0, right = 0;
    for (const Judged& j : all) {
      if (!j.proposed || j.confidence < lo || j.confidence >= hi) continue;
      ++n;
      right += j.right;
    }
    fmt::print("{:.2f} to {:.2f}  {:9}  {:.1f} %\n", lo, std::min(hi, 1.0), n,
               n > 0 ? 100.0 * right / n : 0.0);
  }
}

int run(int argc, char** argv) {
  bench::ProgramOptions app("How often proposed mappings are right");
  int seeds = 5;
  std::uint64_t first = 1;
  double seconds = 150.0;
  std::string real_folder, dump;
  std::vector<std::string> machines = {"loader_crane", "hmf_2020_k4_load_sensing",
                                       "swing_crane",  "excavator",
                                       "three_axis",   "swing_crane_two_pumps"};
  bool verbose = false;
  app.add("--seeds", seeds, "logs of each machine");
  app.add("--seed", first, "first random seed");
  app.add("--seconds", seconds, "duration of a log [s]");
  app.add("--machines", machines, "bundled machines");
  app.add("--real", real_folder, "folder of real logs; then no simulated ones");
  app.add("--dump", dump, "file for margin and outcome of every proposal");
  app.flag("-v,--verbose", verbose, "print every wrong proposal");
  if (const auto code = app.parse(argc, argv)) return *code;
  const std::vector<Names> kinds = {Names::kGerman, Names::kEnglish, Names::kAbbreviated,
                                    Names::kUnitsOnly, Names::kAnonymous};
  const ProposalOptions options;
  std::vector<Judged> all;
  const auto begin = std::chrono::steady_clock::now();
  if (!real_folder.empty()) {
    real(real_folder, kinds, options, &all);
  } else {
    for (const std::string& machine : machines) {
      for (int k = 0; k < seeds; ++k)
        simulated({machine, first + static_cast<std::uint64_t>(k), seconds}, kinds, options, &all);
    }
  }
  if (verbose) {
    for (const Judged& j : all) {
      if (j.right) continue;
      fmt::print("{} {} role {} {}: {} (confidence {:.2f}, margin {:.2f})\n", j.machine, j.names,
                 static_cast<int>(j.meaning.role), j.meaning.index, j.note, j.confidence, j.margin);
    }
  }
  if (!dump.empty()) {
    std::ofstream out(dump);
    for (const Judged& j : all) {
      if (j.proposed) out << fmt::format("{} {} {}\n", j.margin, j.right ? 1 : 0, j.names);
    }
  }
  print_table(all);
  fmt::print("seeds {} to {}, {:.0f} s\n", first, first + static_cast<std::uint64_t>(seeds) - 1,
             std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return sparflow::bench::run_program("mapping_study", run, argc, argv);
}
