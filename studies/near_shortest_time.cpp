/// Reaches near their shortest time, where cylinders must move together: do default settings find the shortest time, and
/// at 1.2 times that the least energy, that more extensive searches find?
///   build/bench/near_shortest_time [--random 44 --seed 1] [--json OUT.json]
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/program_options.h"
#include "models/math/error.h"
#include "optimizer/baselines/strategies_statistics.h"
#include "optimizer/solve/kept_work.h"
#include "studies/near_shortest_time_case.h"

namespace sparflow::bench {
namespace {

/// Distribution of an excess [-] over all reaches.
void print_excess(const char* what, const std::vector<double>& v, double allowed) {
  if (v.empty()) return;
  const auto kept = std::count_if(v.begin(), v.end(), [&](double x) { return x <= allowed; });
  fmt::print(
      "{}: median {:+.2f} %, 95th {:+.2f}, worst {:+.2f}; within {:g} %: {} of {} ({:.1f} %)\n",
      what, 100 * quantile(v, 0.5), 100 * quantile(v, 0.95), 100 * quantile(v, 1.0), 100 * allowed,
      kept, v.size(), 100.0 * static_cast<double>(kept) / static_cast<double>(v.size()));
}

/// Lists each search with its excess over the best of all: "default 7.29, strategies 7.29 +0.1 %, ...".
std::string found_text(const std::vector<ShortTimeFound>& found) {
  const double best = best_of(found);
  std::string text;
  for (const ShortTimeFound& f : found) {
    text += fmt::format("{}{}{}", text.empty() ? "" : ", ", f.search,
                        f.value > 0.0 ? fmt::format(" {:+.2f} % ({:.0f} s)",
                                                    100.0 * (f.value / best - 1.0), f.seconds)
                                      : " -");
  }
  return text;
}

/// Prints a reach as soon as it is finished, since all of them take an hour.
void print_reach(const ReachTask& task, const ShortTimeFigures& f) {
  const double shortest = best_of(f.times), least = best_of(f.energies);
  if (!(shortest > 0.0) || !(least > 0.0)) {
    fmt::print("{}: no motion found\n", task.problem.name);
  } else {
    fmt::print(
        "{}: shortest {:.3f} s (bound {:.2f}), energy {:.2f} kJ in {:.2f} s (bound {:.2f})\n"
        "  time: {}\n  energy: {}\n",
        task.problem.name, shortest, f.least_duration, least / 1e3, f.duration,
        f.least_energy / 1e3, found_text(f.times), found_text(f.energies));
  }
  std::fflush(stdout);
}

struct Excesses {
  std::vector<double> time, named, time_over_bound, energy, energy_over_bound;
  std::vector<double> programming;  // of the path of dynamic programming
  std::vector<double> seconds_time, seconds_energy;
  int unsolved = 0;
};

void add_reach(const ReachTask& task, const ShortTimeFigures& f, Excesses& all) {
  const double shortest = best_of(f.times), least = best_of(f.energies);
  if (!(shortest > 0.0) || !(least > 0.0)) {
    ++all.unsolved;
    return;
  }
  // A search that found nothing counts as an excess of 100 %.
  const auto excess = [](double value, double best) {
    return value > 0.0 ? value / best - 1.0 : 1.0;
  };
  all.time.push_back(excess(f.times[0].value, shortest));
  all.named.push_back(excess(f.times[1].value, shortest));
  all.energy.push_back(excess(f.energies[0].value, least));
  all.seconds_time.push_back(f.times[0].seconds);
  all.seconds_energy.push_back(f.energies[0].seconds);
  for (const ShortTimeFound& e : f.energies) {
    if (e.search == kDynamicProgramming && e.value > 0.0)
      all.programming.push_back(e.value / least - 1.0);
  }
  if (task.is_restricted()) return;
  if (f.least_duration > 0.0) all.time_over_bound.push_back(shortest / f.least_duration - 1.0);
  if (f.least_energy > 0.0) all.energy_over_bound.push_back(least / f.least_energy - 1.0);
}

void print_summary(const Excesses& all, double factor) {
  fmt::print("\nno motion found: {} of {}\n", all.unsolved,
             all.unsolved + static_cast<int>(all.time.size()));
  print_excess("shortest time, default over the best found", all.time, 0.02);
  print_excess("  shortest time named for an infeasible reach over the best found", all.named,
               0.02);
  print_excess("  best found over the estimated bound", all.time_over_bound, 0.02);
  print_excess(fmt::format("energy at {:g} times, default over the best found", factor).c_str(),
               all.energy, 0.03);
  print_excess("  path of dynamic programming over the best found", all.programming, 0.03);
  print_excess("  best found over the estimated bound", all.energy_over_bound, 0.03);
  if (all.seconds_time.empty()) return;
  fmt::print("seconds with default settings, median: shortest time {:.1f}, energy {:.1f}\n",
             quantile(all.seconds_time, 0.5), quantile(all.seconds_energy, 0.5));
}

nlohmann::json found_json(const std::vector<ShortTimeFound>& found) {
  nlohmann::json out = nlohmann::json::array();
  for (const ShortTimeFound& f : found) {
    out.push_back(
        {{"search", f.search}, {"value", f.value}, {"seconds", f.seconds}, {"from", f.from}});
  }
  return out;
}

int run(int argc, char** argv) {
  ProgramOptions app(
      "Reaches near their shortest time: default settings against more extensive searches");
  int random_count = 0, processes = 2;
  std::uint64_t seed = 1;
  std::string only, json;
  bool open = false;
  ShortTimeSettings settings;
  app.add("--random", random_count, "random reaches instead of the bundled ones");
  app.add("--seed", seed, "seed of the first random reach");
  app.add("--only", only, "bundled reaches whose name contains this");
  app.flag("--open", open, "only reaches without obstacles; each of the others takes many minutes");
  app.add("--factor", settings.factor,
          "duration of the energies, as a multiple of the shortest time")
      .positive();
  app.add("--paths", settings.paths, "seed paths of an extensive search").positive();
  app.add("--intervals", settings.intervals, "mesh intervals of an extensive search").positive();
  app.add("--searches", settings.seeds,
          "number of extensive searches, each with random paths of its own");
  app.add("--grid-nodes", settings.grid_nodes, "nodes of the joint grid").positive();
  app.flag("!--no-bound", settings.bounds, "leave out the estimated lower bounds");
  app.add("--json", json, "file for all results (JSON)");
  app.add("--processes", processes, "reaches in parallel").positive();
  app.add_journal();
  if (const auto code = app.parse(argc, argv)) return *code;
  ModelCache models;
  std::vector<ReachTask> tasks =
      random_count > 0 ? random_tasks(random_count, seed, models) : bundled_tasks(only, models);
  std::erase_if(tasks, [&](const ReachTask& task) {
    return !task.meant_feasible || (open && !task.problem.obstacles.empty());
  });
  const int count = static_cast<int>(tasks.size());
  const auto task = [&](int i) -> const ReachTask& { return tasks[static_cast<std::size_t>(i)]; };
  const std::unique_ptr<Journal> journal =
      app.journal(files_of(tasks, models), {"--processes", "--json"});
  KeptWork work;
  work.count = count;
  work.at_once = processes;
  work.name = [&](int i) { return fmt::format("reach {}", task(i).problem.name); };
  work.work = [&](int i) { return pack_short_time(short_time_of(task(i), settings)); };
  const std::vector<ChildResult> results =
      run_kept(work, *journal, [&](int i, int done, const ChildResult& r) {
        if (r.ok) print_reach(task(i), unpack_short_time(r.bytes));
        fmt::print(stderr, "{}/{}\n", done, count);
      });
  Excesses all;
  nlohmann::json out = nlohmann::json::object();
  for (int i = 0; i < count; ++i) {
    const ChildResult& r = results[static_cast<std::size_t>(i)];
    if (!r.ok) fmt::print(stderr, "{} failed: {}\n", task(i).problem.name, r.error);
    const ShortTimeFigures f = r.ok ? unpack_short_time(r.bytes) : ShortTimeFigures{};
    add_reach(task(i), f, all);
    out[task(i).problem.name] = {{"times", found_json(f.times)},
                                 {"energies", found_json(f.energies)},
                                 {"duration_s", f.duration},
                                 {"least_duration_s", f.least_duration},
                                 {"least_energy_J", f.least_energy}};
  }
  print_summary(all, settings.factor);
  if (!json.empty()) write_file_atomically(json, out.dump(1) + "\n");
  journal->remove();
  return 0;
}

}  // namespace
}  // namespace sparflow::bench

int main(int argc, char** argv) {
  return sparflow::bench::run_program("near_shortest_time", sparflow::bench::run, argc, argv);
}
