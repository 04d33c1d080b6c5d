// Verdicts of `diagnose` on logs of dynamic plants, whose laws the program does not have: does it name what was changed
// between reference and suspect log, nothing where nothing was, and nothing untrue beside it? docs/references.md.
//   plant_verdicts [--plants 20] [--seed 1] [--seconds 200] [--changes 1] [--only EFFECT] [--no-reference]
//     [--without-settling] [-v] [--json FILE] [--logs FOLDER]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>

#include "bench/program_options.h"
#include "diagnosis/verdict/diagnose.h"
#include "identification/learning/fit.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "models/math/parallel.h"
#include "optimizer/solve/child_processes.h"
#include "simulator/plant/parameters/parameter_table.h"
#include "simulator/plant/run/plant_run.h"
#include "simulator/programmes/programmes.h"
#include "simulator/random/random.h"
#include "simulator/sensors/log_writer.h"
#include "studies/plants/change_in_noise.h"
#include "studies/plants/drawn_plant.h"
#include "studies/share.h"
#include "studies/trust/said_effect.h"

namespace sparflow::bench {
namespace {

using plant::PlantParameters;
using simulator::Random;

struct Arguments {
  int plants = 20, changes = 1;
  std::uint64_t seed = 1;
  double seconds = 200.0;
  std::string only, json, logs;
  bool no_reference = false, without_settling = false, without_support = false, verbose = false;
};

/// Change of a channel over its sensor's noise from which a change counts as one above a sensor's noise. Many rows show smaller ones.
/// @threshold [1] 0.1..10; chosen: in one stretch of 4 s at least, the change is as large as what the sensor scatters
constexpr double kVisible = 1.0;

/// A change of the plant, with what may be named for it.
struct Change {
  const char* name;
  const char* key;                 ///< of parameter_table.h; empty: the payload that the log tells
  double factor, plus;             ///< new value = factor * old + plus, in the table's unit
  std::vector<const char*> named;  ///< ids, each of them a right answer at the place
  std::vector<const char*> beside = {};  ///< ids that are true beside one of these, not alone
};

const std::vector<Change>& changes() {
  static const std::vector<Change> all = {
      // The plant's friction is LuGre's law, whose rigid limit is Coulomb's and whose slow limit is Dahl's. Its breakaway force is a
      // multiple of the dry friction (stiction_ratio), so that Stribeck's part grows with it.
      {"coulomb_friction",
       "coulomb_friction_N",
       2.5,
       0.0,
       {"coulomb_friction", "presliding"},
       {"stribeck_friction"}},
      {"viscous_friction", "viscous_friction_N_s_m", 5.0, 0.0, {"viscous_friction"}},
      {"leakage", "leakage_lpm_100bar", 1.0, 1.5, {"leakage"}},
      {"line_loss", "line_drop_bar", 3.0, 5.0, {"line_loss"}},
      {"valve_lag", "spool_frequency_Hz", 0.25, 0.0, {"valve_lag"}},
      {"valve_deadband", "dead_band_extend", 1.0, 0.06, {"valve_deadband"}},
      {"pump_lag", "response_s", 4.0, 0.2, {"pump_lag"}},
      {"flow_saturation", "max_flow_lpm", 0.5, 0.0, {"flow_saturation"}},
      {"pressure_offset", "pressure_offset_bar", 1.0, 4.0, {"pressure_offset"}},
      {"return_back_pressure", "tank_drop_bar", 4.0, 0.0, {"return_back_pressure"}},
      {"payload_error", "", 1.0, 0.0, {"payload_error", "unmodelled_mass"}},
  };
  return all;
}

/// The plant at an operator's work.
std::vector<plant::Record> worked(const Machine& machine, const PlantParameters& p,
                                  std::uint64_t seed, double seconds) {
  const auto work = plant::operator_work(machine, p, {seed, seconds, 0.02, std::nullopt});
  std::vector<plant::Record> records;
  plant::PlantRun run(machine, p, work->start(), work->start_payload());
  while (run.time() < seconds && run.status() == plant::RunStatus::kRunning) {
    const plant::ProgrammeStep step = work->step(run.record());
    if (step.end) break;
    if (step.payload) run.set_payload(*step.payload);
    plant::Record row = run.record();
    row.command = step.command;
    records.push_back(std::move(row));
    run.advance(step.command);
  }
  if (run.status() != plant::RunStatus::kRunning)
    throw InputError({}, "plant", "the run ended early: " + run.message());
  return records;
}

/// The log of this work. @param told factor of the payload that the log tells
std::string log_of(const Machine& machine, const PlantParameters& p,
                   std::vector<plant::Record> records, std::uint64_t seed, double told) {
  plant::LogWriter log(machine, p, seed, "");
  for (plant::Record& row : records) {
    row.payload *= told;
    log.add(row);
  }
  return log.text("");
}

struct Case {
  std::uint64_t seed = 0;
  std::string machine, change, verdict, answer, left_out;
  int hidden = 0, named = 0;  ///< changes, and how many of them are named
  bool right = false;
  double seconds = 0.0;
  ChangeInNoise shows;  ///< how far the hidden change shows at all
  std::vector<SaidEffect> said;
};

/// Hidden change and its place.
struct Hidden {
  const Change* change = nullptr;
  std::size_t place = 0;
  std::string at;
  std::string text() const { return at.empty() ? change->name : change->name + (":" + at); }
};

Hidden drawn_change(const Machine& machine, const std::vector<const Change*>& possible,
                    Random& random) {
  Hidden h;
  h.change = possible[static_cast<std::size_t>(random.below(static_cast<int>(possible.size())))];
  std::vector<std::size_t> hydraulic;
  for (std::size_t c = 0; c < machine.cylinders.size(); ++c)
    if (machine.cylinders[c].hydraulic()) hydraulic.push_back(c);
  if (*h.change->key == '\0') return h;
  const plant::ParameterRow& row = *plant::find_parameter(h.change->key);
  if (row.place == plant::Place::kCylinder) {
    h.place = hydraulic[static_cast<std::size_t>(random.below(static_cast<int>(hydraulic.size())))];
    h.at = machine.cylinders[h.place].name;
  } else if (row.place == plant::Place::kPump) {
    h.at = machine.pumps[0].name;
  }
  return h;
}

/// As many changes as asked for, each of another kind.
std::vector<Hidden> drawn_changes(const Machine& machine, const Arguments& a, Random& random) {
  std::vector<const Change*> possible;
  for (const Change& c : changes())
    if (a.only.empty() || a.only == c.name) possible.push_back(&c);
  std::vector<Hidden> out;
  while (std::ssize(out) < a.changes && !possible.empty()) {
    out.push_back(drawn_change(machine, possible, random));
    possible.erase(std::find(possible.begin(), possible.end(), out.back().change));
  }
  return out;
}

/// A plant with its changes.
struct Changed {
  PlantParameters plant;
  double told = 1.0;   ///< factor of the payload that its logs tell
  std::string values;  ///< before and after, for people
};

Changed with_changes(const PlantParameters& as_built, const std::vector<Hidden>& hidden) {
  Changed out{as_built, 1.0, ""};
  for (const Hidden& h : hidden) {
    if (!out.values.empty()) out.values += ", ";
    if (*h.change->key == '\0') {
      out.told = 0.8;
      out.values += "payload as told, times 0.8";
      continue;
    }
    const plant::ParameterRow& row = *plant::find_parameter(h.change->key);
    double& value = row.value(out.plant, h.place);
    const double before = value;
    value = h.change->factor * value + h.change->plus * row.scale;
    out.values += fmt::format("{} {:.4g} -> {:.4g} {}", row.key, before / row.scale,
                              value / row.scale, row.unit);
  }
  return out;
}

/// Whether an effect, given as id:place, is one of these ids at the place of the hidden change.
bool is_one_of(const std::vector<const char*>& ids, const Hidden& hidden, const std::string& key) {
  return std::any_of(ids.begin(), ids.end(), [&](const char* id) {
    if (key == id) return true;
    return key.rfind(std::string(id) + ":", 0) == 0 &&
           (hidden.at.empty() || key == std::string(id) + ":" + hidden.at);
  });
}

void judge(const Diagnosis& d, const std::vector<Hidden>& hidden, Case& c) {
  c.verdict = verdict_name(d.verdict);
  const auto names = [&](const std::string& key, const Hidden& h) {
    return is_one_of(h.change->named, h, key);
  };
  c.said = said_effects(d, [&](const std::string& key) {
    return std::any_of(hidden.begin(), hidden.end(),
                       [&](const Hidden& h) { return names(key, h); });
  });
  std::vector<Hidden> found;
  for (const Hidden& h : hidden)
    if (std::any_of(c.said.begin(), c.said.end(),
                    [&](const SaidEffect& s) { return names(s.key, h); }))
      found.push_back(h);
  c.said = said_effects(d, [&](const std::string& key) {
    return std::any_of(found.begin(), found.end(), [&](const Hidden& h) {
      return names(key, h) || is_one_of(h.change->beside, h, key);
    });
  });
  bool untrue = false;
  for (const SaidEffect& s : c.said) {
    c.answer += s.key + " ";
    untrue = untrue || !s.set_right;
  }
  c.hidden = static_cast<int>(hidden.size());
  c.named = static_cast<int>(found.size());
  c.right = hidden.empty() ? d.verdict == Verdict::kNone : found.size() == hidden.size() && !untrue;
  if (d.verdict == Verdict::kUnknown && d.unexplained) c.answer += "? " + d.unexplained->sentence;
  if (d.verdict == Verdict::kBadData && !d.set_aside.empty())
    c.answer +=
        "bad " + d.set_aside.front().channel + " " + bad_data_word(d.set_aside.front().kind);
}

/// Two cases of one plant: nothing changed, and what is hidden.
std::vector<Case> plant_cases(std::uint64_t seed, const Arguments& a) {
  constexpr const char* kMachines[] = {"loader_crane", "three_axis", "excavator", "swing_crane"};
  std::vector<Case> cases;
  Random random(seed, "plant verdicts");
  const char* name = kMachines[seed % std::size(kMachines)];
  try {
    const Machine machine =
        load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/" + name + ".yaml");
    const PlantParameters as_built = drawn_plant(machine, random);
    const std::vector<Hidden> hidden = drawn_changes(machine, a, random);
    const Changed changed = with_changes(as_built, hidden);
    std::string label;
    for (const Hidden& h : hidden) label += (label.empty() ? "" : " + ") + h.text();
    const auto log = [&](const PlantParameters& p, std::uint64_t work, double factor) {
      const std::uint64_t own = 100 * seed + work;
      const std::string text = log_of(machine, p, worked(machine, p, own, a.seconds), own, factor);
      const std::string file = fmt::format("plant{}_work{}.csv", seed, work);
      if (!a.logs.empty()) std::ofstream(a.logs + "/" + file) << text;
      return log_from_text(file, text, machine);
    };
    const std::vector<Log> reference = {log(as_built, 1, 1.0)};
    FitOptions fit_options;
    fit_options.hold_out_every = 0;
    const CraneModel model = fit(machine, reference, {}, fit_options).model;
    if (!a.logs.empty()) save_model(model, fmt::format("{}/plant{}_model.json", a.logs, seed));
    for (const bool clean : {true, false}) {
      Case c;
      c.seed = seed;
      c.machine = name;
      c.change = clean ? "none" : label;
      const Log suspect =
          log(clean ? as_built : changed.plant, clean ? 2 : 3, clean ? 1.0 : changed.told);
      DiagnoseOptions options;
      if (a.without_settling) options.evidence.mechanisms.switch_off(Mechanism::kSettling);
      if (a.without_support) options.evidence.mechanisms.switch_off(Mechanism::kCommonSupport);
      const Diagnosis d =
          diagnose(model, {suspect}, a.no_reference ? std::vector<Log>{} : reference, options);
      judge(d, clean ? std::vector<Hidden>{} : hidden, c);
      if (!clean)
        c.shows = change_in_noise(machine, {as_built, changed.plant, changed.told},
                                  worked(machine, changed.plant, 100 * seed + 3, a.seconds), seed);
      c.seconds = d.seconds;
      if (a.verbose && !clean) c.answer += "(" + changed.values + ")";
      if (a.verbose) c.answer += "\n" + d.table();
      cases.push_back(std::move(c));
    }
  } catch (const InputError& e) {
    Case c;
    c.seed = seed;
    c.machine = name;
    c.left_out = e.what();
    cases.push_back(std::move(c));
  }
  return cases;
}

/// The cases of a plant as bytes for the journal. The fields are bound by name, so that none is forgotten.
std::string packed(const std::vector<Case>& cases) {
  Packer p;
  p.number(static_cast<double>(cases.size()));
  for (const Case& c : cases) {
    const auto& [seed, machine, change, verdict, answer, left_out, hidden, named, right, seconds,
                 shows, said] = c;
    p.text(shows.channel).number(shows.ratio);
    p.number(static_cast<double>(seed)).text(machine).text(change).text(verdict);
    p.text(answer).text(left_out).number(hidden).number(named);
    p.number(right ? 1.0 : 0.0).number(seconds);
    p.number(static_cast<double>(said.size()));
    for (const SaidEffect& s : said) {
      p.text(s.key).number(s.probability).number(s.set_probability);
      p.number(s.right ? 1.0 : 0.0).number(s.set_right ? 1.0 : 0.0);
    }
  }
  return p.bytes();
}

std::vector<Case> unpacked_cases(const std::string& bytes) {
  Unpacker u(bytes);
  std::vector<Case> cases(static_cast<std::size_t>(u.number()));
  for (Case& c : cases) {
    auto& [seed, machine, change, verdict, answer, left_out, hidden, named, right, seconds, shows,
           said] = c;
    shows.channel = u.text();
    shows.ratio = u.number();
    seed = static_cast<std::uint64_t>(u.number());
    for (std::string* text : {&machine, &change, &verdict, &answer, &left_out}) *text = u.text();
    hidden = static_cast<int>(u.number());
    named = static_cast<int>(u.number());
    right = u.number() != 0.0;
    seconds = u.number();
    said.resize(static_cast<std::size_t>(u.number()));
    for (SaidEffect& s : said) {
      s.key = u.text();
      s.probability = u.number();
      s.set_probability = u.number();
      s.right = u.number() != 0.0;
      s.set_right = u.number() != 0.0;
    }
  }
  return cases;
}

std::string noise_text(const ChangeInNoise& c) {
  return c.channel.empty() ? std::string() : fmt::format("{:.2g} {}", c.ratio, c.channel);
}

/// Prints and counts the cases with changes, or those without.
nlohmann::json summary(const std::vector<Case>& all, bool clean) {
  int right = 0, count = 0, bad = 0, visible = 0, visible_right = 0, hidden = 0, named = 0,
      untrue = 0;
  for (const Case& c : all) {
    if ((c.change == "none") != clean) continue;
    ++count;
    right += c.right ? 1 : 0;
    bad += c.verdict == "bad_data" ? 1 : 0;
    hidden += c.hidden;
    named += c.named;
    untrue += static_cast<int>(std::count_if(c.said.begin(), c.said.end(),
                                             [](const SaidEffect& s) { return !s.set_right; }));
    if (c.shows.ratio < kVisible) continue;
    ++visible;
    visible_right += c.right ? 1 : 0;
  }
  const char* row =
      clean ? "nothing changed: verdict none" : "changes named, nothing untrue beside them";
  fmt::print("{:42} {:3} of {:3}   bad data {}\n", row, right, count, bad);
  nlohmann::json out = {
      {"right", right}, {"cases", count}, {"bad_data", bad}, {"untrue_effects", untrue}};
  if (clean) return out;
  fmt::print("{:42} {:3} of {:3}\n", "  of these, above a sensor's noise", visible_right, visible);
  fmt::print("{:42} {:3} of {:3}   untrue effects {}\n", "changes named, each by itself", named,
             hidden, untrue);
  out["visible"] = {{"right", visible_right}, {"cases", visible}, {"least_ratio", kVisible}};
  out["changes"] = {{"named", named}, {"hidden", hidden}};
  return out;
}

int run(const Arguments& a, Journal& journal) {
  std::mutex mutex;
  std::vector<Case> all;
  parallel(static_cast<std::size_t>(a.plants), [&](std::size_t i) {
    std::vector<Case> cases = unpacked_cases(journal.kept(fmt::format("plant {}", a.seed + i), [&] {
      return Journal::Part{packed(plant_cases(a.seed + i, a)), true};
    }));
    const std::lock_guard lock(mutex);
    for (Case& c : cases) {
      if (!c.left_out.empty()) {
        fmt::print("  left out: {} {}: {}\n", c.seed, c.machine, c.left_out);
        continue;
      }
      fmt::print("{} {:4} {:13} {:32} {:12} {:8} {}\n", c.right ? " " : "X", c.seed, c.machine,
                 c.change, noise_text(c.shows), c.verdict, c.answer);
      std::fflush(stdout);
      all.push_back(std::move(c));
    }
  });
  nlohmann::json json;
  for (const bool clean : {false, true}) json[clean ? "clean" : "hidden"] = summary(all, clean);
  std::vector<SaidEffect> said;
  for (const Case& c : all) said.insert(said.end(), c.said.begin(), c.said.end());
  if (!said.empty()) fmt::print("{}", reliability_text(said));
  json["said"] = said_json(said);
  if (!a.json.empty()) write_file_atomically(a.json, json.dump(1) + "\n");
  journal.remove();
  return 0;
}

int run_with(int argc, char** argv) {
  Arguments a;
  ProgramOptions app("verdicts on logs of dynamic plants");
  app.add("--plants", a.plants, "number of plants");
  app.add("--seed", a.seed, "of the first plant");
  app.add("--seconds", a.seconds, "of each log");
  app.add("--changes", a.changes, "hidden in one log, each of another kind");
  app.add("--only", a.only, "one kind of change alone");
  app.add("--json", a.json, "file for the counts");
  app.add("--logs", a.logs, "folder for the logs and the learned models");
  app.flag("--no-reference", a.no_reference, "diagnose without the reference log");
  app.flag("--without-settling", a.without_settling, "noise that does not settle after commands");
  app.flag("--without-common-support", a.without_support,
           "pressures outside the references' flows and forces are compared, too");
  app.flag("-v", a.verbose, "whole diagnoses");
  app.add_journal();
  if (const auto code = app.parse(argc, argv)) return *code;
  int kinds = 0;
  std::string names;
  for (const Change& c : changes()) {
    kinds += a.only.empty() || a.only == c.name ? 1 : 0;
    names += std::string(" ") + c.name;
  }
  if (kinds == 0)
    throw UsageError(
        fmt::format("--only {} is no change of a plant; expected one of{}", a.only, names));
  if (a.changes < 1 || a.changes > kinds)
    throw UsageError(
        fmt::format("--changes {} is not between 1 and {}, the kinds of change that may be drawn",
                    a.changes, kinds));
  if (!a.logs.empty() && !std::filesystem::is_directory(a.logs))
    throw UsageError("--logs needs a folder that exists");
  const std::unique_ptr<Journal> journal = app.journal({}, {"--json", "--plants"});
  return run(a, *journal);
}

}  // namespace
}  // namespace sparflow::bench

int main(int argc, char** argv) {
  return sparflow::bench::run_program("plant_verdicts", sparflow::bench::run_with, argc, argv);
}
