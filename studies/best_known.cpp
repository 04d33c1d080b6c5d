#include "studies/best_known.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "models/files/model_file.h"
#include "models/math/error.h"

namespace sparflow::bench {

using nlohmann::json;

namespace {

/// Writes into an entry which program found it with which model.
void put_mark(json& entry, const json& model) {
  entry["model"] = model;
  entry["program"] = std::string("sparflow ") + program_version();
}

}  // namespace

void write_optima(const std::string& path, const std::vector<ReachTask>& tasks,
                  const std::vector<ReachFigures>& figures) {
  json all = json::object();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const ReachFigures& f = figures[i];
    if (f.left_out) continue;
    json& entry = all[tasks[i].problem.name];
    entry = {{"named", f.named}, {"worst", f.worst}, {"solve_s", f.comparison.solve_s}};
    const StrategyOutcome* best = f.optimum();
    if (best == nullptr) continue;
    entry["shortest_s"] = f.comparison.shortest;
    entry["duration_s"] = best->duration;
    for (const StrategyOutcome& o : f.comparison.row("equal")->outcomes) {
      if (o.found() && o.kind != kMinimumTime) entry["energies_J"][o.kind] = o.energy.total;
    }
    entry["lower_bound_J"] = f.bound;
    entry["lower_bound_any_time_J"] = f.slow_bound;
    entry["unlimited_time_J"] = f.unlimited;
    if (f.grid_path > 0.0) entry["grid_path_J"] = f.grid_path;
  }
  write_file_atomically(path, all.dump(1) + "\n");
}

void write_best_known(const std::string& path, const std::vector<ReachTask>& tasks,
                      const std::vector<ReachFigures>& figures) {
  json known = json::object();
  if (std::ifstream in(path); in) known = json::parse(in, nullptr, false);
  if (known.is_discarded() || !known.is_object()) known = json::object();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const std::string& file = tasks[i].problem.file;
    const std::string name = file.substr(file.find_last_of('/') + 1);
    if (name.empty() || figures[i].left_out) continue;
    const StrategyOutcome* best = figures[i].optimum();
    json& entry = known[name];
    const json mark = {{"file", tasks[i].mark.file}, {"sha256", tasks[i].mark.sha256}};
    if (entry.is_object() && entry.value("model", json()) != mark) entry = json();
    if (best == nullptr) {
      if (entry.is_null()) {
        entry = {{"status", "infeasible"}, {"why", figures[i].named}};
        put_mark(entry, mark);
      }
      continue;
    }
    const bool known_energy =
        entry.is_object() && entry.contains("energy_J") && !entry["energy_J"].is_null();
    const bool same_time = known_energy && std::abs(entry.value("duration_s", 0.0) -
                                                    best->duration) <= 1e-9 * best->duration;
    double bound = figures[i].bound, shortest = figures[i].comparison.shortest;
    if (same_time) bound = std::max(bound, entry.value("lower_bound_J", 0.0));
    constexpr double kLeastGain = 1e-6;  // [-] relative improvement; a smaller one is rounding
    const double known_shortest = known_energy ? entry.value("shortest_s", shortest) : shortest;
    if (shortest > (1.0 - kLeastGain) * known_shortest) shortest = known_shortest;
    if (known_energy && best->energy.total >= entry["energy_J"].get<double>()) {
      if (same_time && bound > 0.0) entry["lower_bound_J"] = bound;
      entry["shortest_s"] = shortest;
      continue;
    }
    entry = {{"status", "optimal"},
             {"energy_J", best->energy.total},
             {"duration_s", best->duration},
             {"shortest_s", shortest},
             {"share_moving", best->energy.share_moving},
             {"from", best->detail}};
    put_mark(entry, mark);
    for (const StrategyOutcome& o : figures[i].comparison.row("equal")->outcomes) {
      if (o.found() && o.kind != kOptimal && o.kind != kMinimumTime)
        entry["baselines_J"][o.kind] = o.energy.total;
    }
    if (bound > 0.0) entry["lower_bound_J"] = bound;
    if (figures[i].unlimited > 0.0) entry["unlimited_time_J"] = figures[i].unlimited;
  }
  write_file_atomically(path, known.dump(1) + "\n");
}

}  // namespace sparflow::bench
