#include "apps/tasks/benchmark/benchmark_work.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "apps/tasks/argument_range.h"
#include "apps/tasks/inputs.h"
#include "models/math/error.h"
#include "models/math/journal.h"
#include "problems/bundled.h"
#include "simulator/benchmark/scenario_file.h"

namespace sparflow {
namespace {

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

/// The model of a file, read once and checked. @throws InputError
std::shared_ptr<const CraneModel> model_of_file(
    const std::string& path, const Listener& listener,
    std::map<std::string, std::shared_ptr<const CraneModel>>& known, BenchmarkWork& work) {
  std::shared_ptr<const CraneModel>& model = known[path];
  if (model) return model;
  model = std::make_shared<CraneModel>(read_model(path, listener));
  work.files.push_back(path);
  require_pressures(*model, path, "model");
  return model;
}

void load_models(const BenchmarkTask& a, const Listener& listener, BenchmarkWork& work) {
  std::size_t without = 0;
  std::map<std::string, std::shared_ptr<const CraneModel>> known;  // by path
  if (a.model) require_pressures(*a.model, a.model->machine.name, "model");
  for (const benchmark::Scenario& s : work.scenarios) {
    const std::string path = a.model_file.empty() ? s.model_path : a.model_file;
    work.model_of.push_back(a.model);
    if (!a.model && path.empty()) {
      ++without;
      continue;
    }
    if (!a.model) work.model_of.back() = model_of_file(path, listener, known, work);
    check_same_machine(s, *work.model_of.back(), a.model ? a.model->machine.name : path);
  }
  if (without > 0)
    listener.say_warning(
        fmt::format("{} of {} scenarios have no model; controllers that need one fail there: give "
                    "--model, or `model` in the scenario",
                    without, work.scenarios.size()));
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

std::vector<Entrant> entrants_of(const BenchmarkTask& a) {
  std::vector<Entrant> all;
  std::vector<std::string> names = a.controllers;
  if (names.empty() && !a.no_others) names = control::controller_names();
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
  for (const OwnController& own : a.own)
    all.push_back({own.name, own.words, nullptr, {}, "", own.make});
  for (const std::string& gain : a.gains) set_gain(gain, all);
  std::set<std::string> seen;
  for (const Entrant& e : all)
    if (!seen.insert(e.name).second)
      throw UsageError(fmt::format("benchmark: controller {} is given twice", e.name));
  return all;
}

/// That others are compared with: as asked for, else the tracked optimum, else the first.
std::string reference_of(const BenchmarkTask& a, const BenchmarkWork& work) {
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

}  // namespace

BenchmarkWork benchmark_work(const BenchmarkTask& a, const Listener& listener) {
  require_range("benchmark: --seeds", a.seeds, 0, 1000);
  require_range("benchmark: --step-budget", a.step_budget, 1e-3, 600.0);
  require_range_or("benchmark: --sway", a.sway_limit, 0.0, 0.1, 45.0);
  require_range("benchmark: --jobs", a.jobs, 0, 256);
  BenchmarkWork work;
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
  load_models(a, listener, work);
  for (std::size_t s = 0; s < work.scenarios.size(); ++s)
    for (std::size_t e = 0; e < work.entrants.size(); ++e)
      for (const std::uint64_t seed : work.scenarios[s].seeds) work.runs.push_back({s, e, seed});
  work.reference = reference_of(a, work);
  return work;
}

std::string benchmark_fingerprint(const BenchmarkWork& work, const BenchmarkTask& a) {
  std::string options = fmt::format("benchmark bound {} optimum {} seeds {} budget {}", !a.no_bound,
                                    !a.no_optimum, a.seeds, a.step_budget);
  if (a.sway_limit > 0.0) options += fmt::format(" sway {}", a.sway_limit);
  for (const Entrant& e : work.entrants)
    options += fmt::format("; {} = {} [{}]", e.name, e.words, fmt::join(e.gains, ", "));
  return run_fingerprint(work.files, options);
}

}  // namespace sparflow
