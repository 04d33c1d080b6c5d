/// Processor time of the estimated bounds that `sparflow optimize --bound` computes, for the best known motions of the
/// bundled reaches, without optimising them again.
///   bound_speed [--only PART] [--json OUT.json] [--against EARLIER.json]
/// With --against each reach is compared with the same one in a file that another program's run has written.
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/program_options.h"
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/bounds/energy_bound_time.h"
#include "optimizer/grid/driven_grid_path.h"
#include "problems/bundled.h"
#include "studies/reach_tasks.h"

namespace {

using namespace sparflow;

struct Figures {
  double path_s = 0.0, any_s = 0.0, timed_s = 0.0;  // processor times
  double any_J = 0.0, bound_J = 0.0;                // bound of any duration, and the larger one
  double seconds() const { return path_s + any_s + timed_s; }
};

double processor_time() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// The steps of `optimize --bound`, without a bound of the energy with its idle power.
Figures figures_of(const bench::ReachTask& task, double energy, double duration) {
  Figures f;
  double begin = processor_time();
  const auto lap = [&] {
    const double now = processor_time(), spent = now - begin;
    begin = now;
    return spent;
  };
  (void)driven_grid_path(*task.model, task.problem, duration);
  f.path_s = lap();
  const EnergyBound any = energy_bound(*task.model, task.problem);
  f.any_s = lap();
  f.any_J = f.bound_J = any.valid ? any.lower_bound_J : 0.0;
  const double limit = task.problem.duration.max;
  if (!any.valid || !std::isfinite(limit) || energy < 1.005 * any.lower_bound_J) return f;
  TimedBoundOptions options;
  options.any_duration = any.lower_bound_J;
  options.known_energy = energy;
  const TimedBound timed = energy_bound_at(*task.model, task.problem, limit, options);
  f.timed_s = lap();
  if (timed.valid) f.bound_J = std::max(f.bound_J, timed.value);
  return f;
}

nlohmann::json read(const std::string& path) {
  std::ifstream in(path);
  return nlohmann::json::parse(in);
}

int run(int argc, char** argv) {
  bench::ProgramOptions program("Processor time of the estimated bounds over the bundled reaches");
  std::string only, json, against;
  program.add("--only", only, "reaches whose name contains this");
  program.add("--json", json, "file for the figures");
  program.add("--against", against, "file of an earlier run to compare with");
  if (const auto code = program.parse(argc, argv)) return *code;
  const nlohmann::json known = read(bundled_file("best_known.json"));
  const nlohmann::json earlier = against.empty() ? nlohmann::json::object() : read(against);
  nlohmann::json all = nlohmann::json::object();
  bench::ModelCache models;
  fmt::print("{:<36} {:>11} {:>11} {:>7} {:>7} {:>7} {:>7} {:>7} {:>9}\n", "reach", "energy J",
             "bound J", "gap %", "path s", "any s", "timed s", "all s", "bound +%");
  double total = 0.0, before = 0.0, worst = 0.0;
  for (const bench::ReachTask& task : bench::bundled_tasks(only, models)) {
    const std::string name = std::filesystem::path(task.source).filename().string();
    const auto entry = known.find(name);
    if (entry == known.end() || !entry->contains("energy_J")) continue;
    const double energy = entry->at("energy_J").get<double>();
    const Figures f = figures_of(task, energy, entry->at("duration_s").get<double>());
    total += f.seconds();
    all[name] = {{"bound_J", f.bound_J}, {"any_J", f.any_J}, {"seconds", f.seconds()}};
    double change = 0.0;
    if (const auto old = earlier.find(name); old != earlier.end()) {
      const double was = old->at("bound_J").get<double>();
      change = was > 0.0 ? 100.0 * (f.bound_J / was - 1.0) : 0.0;
      before += old->at("seconds").get<double>();
      worst = std::min(worst, change);
    }
    fmt::print("{:<36} {:11.1f} {:11.1f} {:7.2f} {:7.2f} {:7.2f} {:7.2f} {:7.2f} {:9.4f}\n", name,
               energy, f.bound_J, 100.0 * (energy / f.bound_J - 1.0), f.path_s, f.any_s, f.timed_s,
               f.seconds(), change);
    std::fflush(stdout);
  }
  fmt::print("all: {:.1f} s of processor time", total);
  if (!against.empty())
    fmt::print(", {:.1f} s before; bounds fall by at most {:.4f} %", before, -worst);
  fmt::print("\n");
  if (!json.empty()) std::ofstream(json) << all.dump(1) << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return sparflow::bench::run_program("bound_speed", run, argc, argv);
}
