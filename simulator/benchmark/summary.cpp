#include "simulator/benchmark/summary.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "simulator/random/random.h"

namespace sparflow::benchmark {
namespace {

/// Means over a scenario's seeds. NaN: a seed failed, or nothing is known.
struct Mean {
  double energy = kNotKnown, time = kNotKnown, path = kNotKnown, end = kNotKnown;
};
using Means = std::map<std::string, Mean>;  // by scenario

Means means_of(const std::vector<Row>& rows, const std::string& controller) {
  std::map<std::string, std::vector<const Row*>> of;
  for (const Row& r : rows)
    if (r.controller == controller) of[r.scenario].push_back(&r);
  Means means;
  for (const auto& [scenario, runs] : of) {
    Mean& m = means[scenario];
    if (!std::all_of(runs.begin(), runs.end(), [](const Row* r) { return r->done; })) continue;
    const auto mean = [&runs = runs](double Row::*value) {
      double sum = 0.0;
      for (const Row* r : runs) sum += r->*value;
      return sum / static_cast<double>(runs.size());
    };
    m = {mean(&Row::energy), mean(&Row::time), mean(&Row::tip_error_path),
         mean(&Row::tip_error_end)};
  }
  return means;
}

/// Mean ranks by controller: 1 is the least energy, ties share their ranks, failures share the last ones.
std::map<std::string, double> ranks(const std::map<std::string, Means>& all, double tie) {
  std::set<std::string> scenarios;
  for (const auto& [controller, means] : all)
    for (const auto& [scenario, mean] : means) scenarios.insert(scenario);
  std::map<std::string, double> sum;
  std::map<std::string, int> count;
  for (const std::string& scenario : scenarios) {
    const auto energy = [&](const Means& means) {
      const auto at = means.find(scenario);
      return at == means.end() || !std::isfinite(at->second.energy)
                 ? std::numeric_limits<double>::infinity()
                 : at->second.energy;
    };
    for (const auto& [controller, means] : all) {
      if (!means.contains(scenario)) continue;
      const double own = energy(means);
      double rank = 1.0;
      for (const auto& [other, others] : all) {
        if (other == controller || !others.contains(scenario)) continue;
        const double e = energy(others);
        const bool same = e == own || (std::isfinite(own) && std::abs(e - own) <= tie * own);
        rank += same ? 0.5 : e < own ? 1.0 : 0.0;
      }
      sum[controller] += rank;
      ++count[controller];
    }
  }
  for (auto& [controller, value] : sum) value /= count[controller];
  return sum;
}

void add_pairs(const Means& own, const Means& reference, const SummaryOptions& o,
               ControllerSummary& s) {
  std::vector<double> share, later, path, end;
  int dearer = 0;
  for (const auto& [scenario, mean] : own) {
    const auto at = reference.find(scenario);
    if (at == reference.end() || !std::isfinite(at->second.energy) || !std::isfinite(mean.energy))
      continue;
    share.push_back(mean.energy / at->second.energy - 1.0);
    dearer += share.back() > o.tie ? 1 : 0;
    later.push_back(mean.time - at->second.time);
    path.push_back(mean.path - at->second.path);
    end.push_back(mean.end - at->second.end);
  }
  if (!share.empty()) s.dearer = dearer / static_cast<double>(share.size());
  s.against = estimate(share, o);
  s.later = estimate(later, o);
  s.path_above = estimate(path, o);
  s.end_above = estimate(end, o);
}

void add_medians(const std::vector<Row>& rows, ControllerSummary& s) {
  std::vector<const Row*> done;
  for (const Row& r : rows) {
    if (r.controller != s.controller) continue;
    ++s.runs;
    s.step_worst = std::max(s.step_worst, r.step_worst);
    s.runs_breaking_limits += r.limits.empty() ? 0 : 1;
    if (r.done) {
      done.push_back(&r);
    } else {
      ++s.failed;
    }
  }
  const auto median = [&](double Row::*value) {
    std::vector<double> v;
    v.reserve(done.size());
    for (const Row* r : done) v.push_back(r->*value);
    return median_of(v);
  };
  s.energy = median(&Row::energy);
  s.pump_work = median(&Row::pump_work);
  s.time = median(&Row::time);
  s.tip_path = median(&Row::tip_error_path);
  s.tip_end = median(&Row::tip_error_end);
  s.sway = median(&Row::sway);
  s.peak_pressure = median(&Row::peak_pressure);
  s.roughness = median(&Row::roughness);
  s.step_median = median(&Row::step_median);
}

}  // namespace

double median_of(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return kNotKnown;
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

Estimate estimate(std::vector<double> values, const SummaryOptions& o) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  Estimate e;
  e.n = static_cast<int>(values.size());
  e.median = median_of(values);
  if (e.n < 2) return e;
  simulator::Random random(o.seed, "bootstrap");
  std::vector<double> medians, draw(values.size());
  for (int k = 0; k < o.draws; ++k) {
    for (double& d : draw) d = values[static_cast<std::size_t>(random.below(e.n))];
    medians.push_back(median_of(draw));
  }
  std::sort(medians.begin(), medians.end());
  const auto at = [&](double level) {
    return medians[static_cast<std::size_t>(level * static_cast<double>(medians.size() - 1))];
  };
  e.lower = at(0.025);  // no threshold: the ends of a 95 % interval
  e.upper = at(0.975);
  return e;
}

std::vector<ControllerSummary> summarise(const std::vector<Row>& rows,
                                         const std::vector<std::string>& controllers,
                                         const std::string& reference,
                                         const std::map<std::string, Promise>& promises,
                                         const SummaryOptions& o) {
  std::map<std::string, Means> means;
  for (const std::string& c : controllers) means[c] = means_of(rows, c);
  const std::map<std::string, double> rank = ranks(means, o.tie);
  std::vector<ControllerSummary> all;
  for (const std::string& c : controllers) {
    ControllerSummary s;
    s.controller = c;
    add_medians(rows, s);
    if (rank.contains(c)) s.rank = rank.at(c);
    if (means.contains(reference)) add_pairs(means[c], means[reference], o, s);
    std::vector<double> promise, bound;
    for (const auto& [scenario, mean] : means[c]) {
      const auto at = promises.find(scenario);
      if (at == promises.end()) continue;
      promise.push_back(mean.energy / at->second.energy - 1.0);
      bound.push_back(mean.energy / at->second.bound - 1.0);
    }
    s.above_promise = estimate(promise, o);
    s.above_bound = estimate(bound, o);
    all.push_back(s);
  }
  return all;
}

}  // namespace sparflow::benchmark
