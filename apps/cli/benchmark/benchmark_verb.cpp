#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <set>

#include "apps/cli/benchmark/benchmark_text.h"
#include "apps/cli/benchmark/learned_machine.h"
#include "apps/cli/benchmark/optimal_motions.h"
#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "models/math/error.h"
#include "optimizer/solve/kept_work.h"
#include "problems/bundled.h"
#include "simulator/benchmark/closed_loop.h"
#include "simulator/benchmark/scenario_file.h"
#include "simulator/controllers/foreign_process.h"
#include "simulator/controllers/registry.h"

namespace sparflow::cli {
namespace {

struct BenchmarkArguments {
  std::vector<std::string> scenarios, controllers, processes, gains;
  std::string model, csv, reference;
  int seeds = 0, jobs = 0;
  double step_budget = 0.5;
  bool no_bound = false, no_optimum = false;
  Outputs outputs;
};

/// A controller that takes part: one of the registry, or a command.
struct Entrant {
  std::string name, words;
  const control::ControllerInfo* info = nullptr;
  std::vector<double> gains;  ///< of a controller of the registry
  std::string command;        ///< of one that is a process
};

/// One run.
struct Run {
  std::size_t scenario = 0, entrant = 0;
  std::uint64_t seed = 1;
};

struct Work {
  std::vector<benchmark::Scenario> scenarios;
  std::vector<const CraneModel*> model_of;                    ///< by scenario; null: none
  std::map<std::string, std::unique_ptr<CraneModel>> models;  ///< by path
  std::vector<Entrant> entrants;
  std::vector<Run> runs;
  std::vector<std::string> files;  ///< all that is read
};

/// Replaces each folder by its .yaml files in the order of their names.
std::vector<std::string> scenario_files(const std::vector<std::string>& given) {
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  for (const std::string& path : given) {
    std::error_code error;
    if (!fs::is_directory(path, error)) {
      files.push_back(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path))
      if (entry.path().extension() == ".yaml") inside.push_back(entry.path().string());
    if (inside.empty()) throw InputError({path, 0, 0}, "", "no scenario (*.yaml) in this folder");
    std::sort(inside.begin(), inside.end());
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

/// @throws InputError where the model is of another machine
void check_same_machine(const benchmark::Scenario& s, const CraneModel& model,
                        const std::string& path) {
  const Machine &a = s.machine, &b = model.machine;
  bool same = a.joints.size() == b.joints.size() && a.cylinders.size() == b.cylinders.size() &&
              a.pumps.size() == b.pumps.size();
  for (std::size_t k = 0; same && k < a.joints.size(); ++k)
    same = a.joints[k].name == b.joints[k].name;
  for (std::size_t k = 0; same && k < a.cylinders.size(); ++k)
    same = a.cylinders[k].name == b.cylinders[k].name;
  if (same) return;
  throw InputError({path, 0, 0}, "machine",
                   fmt::format("the model is of machine {}, with other joints or cylinders than "
                               "{} of scenario {}; fit a model of that machine",
                               b.name, a.name, s.id));
}

void load_models(const BenchmarkArguments& a, Work& work) {
  std::set<std::string> without;
  for (const benchmark::Scenario& s : work.scenarios) {
    const std::string path = a.model.empty() ? s.model_path : a.model;
    work.model_of.push_back(nullptr);
    if (path.empty()) {
      without.insert(s.id);
      continue;
    }
    std::unique_ptr<CraneModel>& model = work.models[path];
    if (!model) {
      model = std::make_unique<CraneModel>(load_model_with_warnings(path));
      work.files.push_back(path);
      if (!model->complete())
        throw InputError({path, 0, 0}, "model",
                         fmt::format("the model has no working pressure for {}; fit it on a log in "
                                     "which that movement occurs",
                                     fmt::join(model->missing(), ", ")));
    }
    check_same_machine(s, *model, path);
    work.model_of.back() = model.get();
  }
  if (!without.empty())
    warn(
        fmt::format("{} of {} scenarios have no model; controllers that need one fail there: give "
                    "--model, or `model` in the scenario",
                    without.size(), work.scenarios.size()));
}

/// Sets one gain, as CONTROLLER.GAIN=VALUE says. @throws UsageError
void set_gain(const std::string& text, std::vector<Entrant>& all) {
  const std::size_t dot = text.find('.'), equals = text.find('=');
  char* end = nullptr;
  const double value =
      equals == std::string::npos ? std::nan("") : std::strtod(text.c_str() + equals + 1, &end);
  if (dot == std::string::npos || equals == std::string::npos || dot > equals || *end != '\0' ||
      !std::isfinite(value))
    throw UsageError(
        fmt::format("benchmark: --gain got \"{}\"; expected CONTROLLER.GAIN=VALUE", text));
  const std::string controller = text.substr(0, dot), name = text.substr(dot + 1, equals - dot - 1);
  for (Entrant& e : all) {
    if (e.name != controller || e.info == nullptr) continue;
    std::vector<std::string> known;
    for (std::size_t k = 0; k < e.info->gains.size(); ++k) {
      const control::Gain& g = e.info->gains[k];
      known.emplace_back(g.name);
      if (g.name != name) continue;
      if (value < g.lowest || value > g.highest)
        throw UsageError(fmt::format("benchmark: --gain {}: expected {} to {} [{}]", text, g.lowest,
                                     g.highest, g.unit));
      e.gains[k] = value;
      return;
    }
    throw UsageError(fmt::format("benchmark: {} has no gain \"{}\"; it has {}", controller, name,
                                 fmt::join(known, ", ")));
  }
  throw UsageError(fmt::format("benchmark: --gain {}: no such controller runs", text));
}

std::vector<Entrant> entrants_of(const BenchmarkArguments& a) {
  std::vector<Entrant> all;
  std::vector<std::string> names = a.controllers;
  if (names.empty()) names = control::controller_names();
  for (const std::string& name : names) {
    const control::ControllerInfo* info = control::find_controller(name);
    if (info == nullptr) {
      const std::vector<std::string> known = control::controller_names();
      const std::string near = nearest_word(name, known);
      throw UsageError(fmt::format("benchmark: no controller \"{}\"{}; there are {}", name,
                                   near.empty() ? "" : ", did you mean " + near + "?",
                                   fmt::join(known, ", ")));
    }
    all.push_back({name, std::string(info->words), info, {}, ""});
    for (const control::Gain& g : info->gains) all.back().gains.push_back(g.value);
  }
  for (const std::string& p : a.processes) {
    const std::size_t equals = p.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == p.size())
      throw UsageError(fmt::format("benchmark: --process got \"{}\"; expected NAME=COMMAND", p));
    all.push_back({p.substr(0, equals),
                   "process: " + p.substr(equals + 1),
                   nullptr,
                   {},
                   p.substr(equals + 1)});
  }
  for (const std::string& gain : a.gains) set_gain(gain, all);
  std::set<std::string> seen;
  for (const Entrant& e : all)
    if (!seen.insert(e.name).second)
      throw UsageError(fmt::format("benchmark: controller {} is given twice", e.name));
  return all;
}

Work load_work(const BenchmarkArguments& a) {
  Work work;
  work.entrants = entrants_of(a);
  std::map<std::string, std::string> file_of;
  for (const std::string& file : scenario_files(a.scenarios)) {
    benchmark::Scenario s = benchmark::load_scenario(file, bundled_file);
    const auto [known, fresh] = file_of.emplace(s.id, file);
    if (!fresh)
      throw InputError({file, 0, 0}, "id",
                       fmt::format("\"{}\" is the id of {} as well; give each scenario its own",
                                   s.id, known->second));
    for (const std::string& path : {s.file, s.machine_path, s.plant_path})
      if (!path.empty()) work.files.push_back(path);
    if (a.seeds > 0) {
      s.seeds.clear();
      for (int k = 1; k <= a.seeds; ++k) s.seeds.push_back(static_cast<std::uint64_t>(k));
    }
    work.scenarios.push_back(std::move(s));
  }
  load_models(a, work);
  for (std::size_t s = 0; s < work.scenarios.size(); ++s)
    for (std::size_t e = 0; e < work.entrants.size(); ++e)
      for (const std::uint64_t seed : work.scenarios[s].seeds) work.runs.push_back({s, e, seed});
  return work;
}

/// All that results depend on; the number of jobs is not part of it.
std::string fingerprint(const Work& work, const BenchmarkArguments& a) {
  std::string options = fmt::format("benchmark bound {} optimum {} seeds {} budget {}", !a.no_bound,
                                    !a.no_optimum, a.seeds, a.step_budget);
  for (const Entrant& e : work.entrants)
    options += fmt::format("; {} = {} [{}]", e.name, e.words, fmt::join(e.gains, ", "));
  return run_fingerprint(work.files, options);
}

std::vector<OptimalMotions> all_motions(const Work& work, const BenchmarkArguments& a,
                                        const OptimalMotionOptions& options, Journal& journal) {
  KeptWork parts;
  parts.count = static_cast<int>(work.scenarios.size());
  parts.at_once = a.jobs > 0 ? a.jobs : usable_processors();
  parts.name = [&](int i) {
    return "optimum of " + work.scenarios[static_cast<std::size_t>(i)].id;
  };
  parts.work = [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    OptimalMotions none;
    if (work.model_of[k] == nullptr || a.no_optimum) {
      none.legs.resize(1);
      none.legs[0].message = a.no_optimum ? "it was left out" : "there is no model";
      return packed(none);
    }
    return packed(optimal_motions(work.scenarios[k], *work.model_of[k], options));
  };
  parts.complete = [](const std::string&) { return !interrupted(); };
  parts.stop = interrupted;
  Progress progress("benchmark: optimal motions");
  const std::vector<ChildResult> results =
      run_kept(parts, journal, [&](int i, int done, const ChildResult&) {
        progress(static_cast<double>(done) / parts.count,
                 work.scenarios[static_cast<std::size_t>(i)].id);
      });
  std::vector<OptimalMotions> all;
  for (const ChildResult& r : results) {
    if (r.ok) {
      all.push_back(motions_from(r.bytes));
      continue;
    }
    all.emplace_back();
    all.back().legs.resize(1);
    all.back().legs[0].message = r.error;
  }
  return all;
}

benchmark::Row one_run(const Work& work, const Run& run, const OptimalMotions& motions,
                       const OptimalMotionOptions& options, double step_budget) {
  const benchmark::Scenario& s = work.scenarios[run.scenario];
  const Entrant& e = work.entrants[run.entrant];
  const CraneModel* model = work.model_of[run.scenario];
  const control::SectionValves valves(model != nullptr ? learned_sections(*model)
                                                       : control::sections_of(s.machine));
  std::optional<LearnedPower> power;
  std::optional<ScenarioMotions> source;
  if (model != nullptr) {
    power.emplace(*model);
    source.emplace(s, *model, motions, options);
  }
  benchmark::LoopOptions loop;
  loop.stop = interrupted;
  control::Knowledge know;
  know.machine = &s.machine;
  know.valves = &valves;
  know.power = power ? &*power : nullptr;
  know.motions = source ? &*source : nullptr;
  know.sample_time = loop.sample_time;
  control::ForeignOptions foreign;
  foreign.step_budget = step_budget;
  return benchmark::run_closed_loop(
      s, e.name,
      [&]() -> std::unique_ptr<control::Controller> {
        return e.info != nullptr ? e.info->make(know, e.gains)
                                 : control::foreign_controller(know, e.command, foreign);
      },
      run.seed, loop);
}

/// Optimal motions by scenario, and how they were computed.
struct Planned {
  OptimalMotionOptions options;
  std::vector<OptimalMotions> motions;
};

/// Runs everything that the journal lacks.
/// @param broken gets the number of processes that ended without a result
std::vector<benchmark::Row> all_rows(const Work& work, const BenchmarkArguments& a,
                                     const Planned& planned, Journal& journal, int& broken) {
  const auto run = [&](int i) -> const Run& { return work.runs[static_cast<std::size_t>(i)]; };
  KeptWork parts;
  parts.count = static_cast<int>(work.runs.size());
  parts.at_once = a.jobs > 0 ? a.jobs : usable_processors();
  parts.name = [&](int i) {
    return fmt::format("run of {} by {}, seed {}", work.scenarios[run(i).scenario].id,
                       work.entrants[run(i).entrant].name, run(i).seed);
  };
  parts.work = [&](int i) {
    return benchmark::packed(
        one_run(work, run(i), planned.motions[run(i).scenario], planned.options, a.step_budget));
  };
  parts.complete = [](const std::string& bytes) {
    return benchmark::row_from(bytes).reason != "interrupted";
  };
  parts.stop = interrupted;
  const int before = finished_before(parts, journal);
  if (before > 0) note(fmt::format("{} of {} runs were finished before", before, parts.count));
  Progress progress("benchmark");
  const std::vector<ChildResult> results =
      run_kept(parts, journal, [&](int i, int done, const ChildResult&) {
        progress(static_cast<double>(done) / parts.count,
                 fmt::format("{}, {}", work.scenarios[run(i).scenario].id,
                             work.entrants[run(i).entrant].name));
      });
  std::vector<benchmark::Row> rows;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i].ok) {
      rows.push_back(benchmark::row_from(results[i].bytes));
      continue;
    }
    benchmark::Row row;
    row.scenario = work.scenarios[work.runs[i].scenario].id;
    row.controller = work.entrants[work.runs[i].entrant].name;
    row.seed = work.runs[i].seed;
    row.reason = interrupted() ? "interrupted" : results[i].error;
    broken += interrupted() ? 0 : 1;
    rows.push_back(row);
  }
  return rows;
}

/// That others are compared with: as asked for, else the tracked optimum, else the first.
std::string reference_of(const BenchmarkArguments& a, const Work& work) {
  const auto there = [&](const std::string& name) {
    return std::any_of(work.entrants.begin(), work.entrants.end(),
                       [&](const Entrant& e) { return e.name == name; });
  };
  if (!a.reference.empty()) {
    if (there(a.reference)) return a.reference;
    throw UsageError(
        fmt::format("benchmark: --reference {} is none of the controllers that run", a.reference));
  }
  return there("tracked_optimum") ? "tracked_optimum" : work.entrants.front().name;
}

int run(const BenchmarkArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--csv", a.csv});
  outputs.push_back({"the journal", a.outputs.journal()});
  Work work = load_work(a);
  std::vector<NamedFile> inputs = {{"--model", a.model}};
  for (const std::string& file : work.files) inputs.push_back({"a scenario", file});
  check_outputs_apart("benchmark", outputs, inputs);
  check_writable(a.csv);
  a.outputs.check();
  BenchmarkResult result;
  result.reference = reference_of(a, work);
  const std::unique_ptr<Journal> journal =
      a.outputs.open_journal("benchmark", fingerprint(work, a));
  finish_on_interrupt();
  Planned planned;
  planned.options.bound = !a.no_bound;
  planned.options.interrupted = interrupted;
  planned.motions = all_motions(work, a, planned.options, *journal);
  const std::vector<OptimalMotions>& motions = planned.motions;
  int broken = 0;
  result.rows = all_rows(work, a, planned, *journal, broken);
  for (std::size_t s = 0; s < work.scenarios.size(); ++s) {
    const std::string& id = work.scenarios[s].id;
    if (motions[s].found()) {
      result.promises[id] = {motions[s].energy(), motions[s].bound()};
    } else {
      result.no_promise[id] = motions[s].message();
    }
  }
  for (const Entrant& e : work.entrants) {
    result.controllers.push_back(e.name);
    result.words.push_back(e.words);
  }
  result.summary =
      benchmark::summarise(result.rows, result.controllers, result.reference, result.promises);
  result.interrupted = interrupted();
  result.scenarios = std::move(work.scenarios);
  if (!a.outputs.json.empty()) a.outputs.write_json(benchmark_json(result));
  if (!a.csv.empty()) write_file_atomically(a.csv, benchmark_csv(result));
  if (!a.outputs.report.empty()) {
    BenchmarkView view = benchmark_view(result);
    view.provenance = {{"model", a.model},
                       {"scenarios", fmt::format("{}", fmt::join(a.scenarios, " "))}};
    benchmark_page(view).write(a.outputs.report);
  }
  if (!interrupted() && broken == 0) journal->remove();
  tell(benchmark_table(result));
  if (interrupted()) return kInterrupted;
  const bool any = std::any_of(result.rows.begin(), result.rows.end(),
                               [](const benchmark::Row& r) { return r.done; });
  return any && broken == 0 ? kDone : kNotSolved;
}

std::string controllers_help() {
  std::string text = "Controllers:\n";
  for (const control::ControllerInfo& info : control::controllers()) {
    text += fmt::format("  {:<22} {}\n", info.name, info.words);
    for (const control::Gain& g : info.gains)
      text += fmt::format("  {:<22}   {} = {:g}{}{}\n", "", g.name, g.value,
                          g.unit == "-" ? "" : " ", g.unit == "-" ? "" : g.unit);
  }
  return text;
}

}  // namespace

void add_benchmark_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<BenchmarkArguments>();
  CLI::App* verb = app.add_subcommand(
      "benchmark", "compare controllers on the dynamic plant: true energy, time, errors");
  verb->add_option("SCENARIO", a->scenarios, "scenarios (YAML), or folders of them")
      ->required()
      ->type_name("FILE|DIR");
  verb->add_option("--controllers", a->controllers, "names, separated by commas; absent: all")
      ->delimiter(',')
      ->type_name("NAME");
  verb->add_option("--process", a->processes,
                   "a controller of your own: a program that reads and writes lines of JSON "
                   "(docs/benchmark.md)")
      ->type_name("NAME=COMMAND");
  verb->add_option("--model", a->model, "fitted model; absent: the one that each scenario names")
      ->type_name("MODEL.json");
  verb->add_option("--reference", a->reference,
                   "controller that others are compared with; absent: tracked_optimum, or the "
                   "first")
      ->type_name("NAME");
  verb->add_option("--seeds", a->seeds,
                   "runs of each controller in each scenario; absent: the scenario's seeds")
      ->check(CLI::Range(1, 1000));
  verb->add_option("--step-budget", a->step_budget,
                   "time in which a program of your own must answer a step")
      ->type_name("S")
      ->check(number_from(1e-3, 600.0))
      ->capture_default_str();
  verb->add_option("--gain", a->gains, "another value for a gain of a controller; repeatable")
      ->type_name("CONTROLLER.GAIN=VALUE");
  verb->add_flag("--no-optimum", a->no_optimum,
                 "leave the energy-optimal motions out; controllers that follow one fail");
  verb->add_flag("--no-bound", a->no_bound, "leave the lower bounds of the energy out");
  verb->add_option("--jobs,--processes", a->jobs,
                   "runs at the same time; absent: as many as there are processors")
      ->check(CLI::Range(1, 256));
  verb->add_option("--csv", a->csv, "all rows as a table")->type_name("FILE.csv");
  a->outputs.add_to(*verb);
  a->outputs.add_resume_to(*verb);
  verb->footer(controllers_help());
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
