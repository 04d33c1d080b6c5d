#include "apps/tasks/benchmark/benchmark_task.h"

#include <fmt/format.h>

#include <optional>

#include "apps/tasks/benchmark/learned_run.h"
#include "models/math/interruption.h"
#include "models/math/units.h"
#include "optimizer/solve/kept_work.h"
#include "simulator/controllers/foreign_process.h"

namespace sparflow {
namespace {

constexpr const char* kInterruptedRun = "interrupted";

/// A benchmark at work. References must outlive it.
class Benchmark {
 public:
  Benchmark(const BenchmarkWork& work, const BenchmarkTask& task, Journal& journal,
            const Listener& listener)
      : work_(work), task_(task), journal_(journal), listener_(listener) {
    planning_.bound = !task.no_bound;
    planning_.sway_limit = task.sway_limit * units::kDegree;
    planning_.interrupted = listener.interrupted;
  }
  BenchmarkResult result();

 private:
  void plan();
  std::string planned(std::size_t scenario) const;
  void run_all();
  void run_children(const std::vector<std::size_t>& indices, const WorkProgress& progress);
  void run_own(std::size_t index);
  benchmark::Row run(const BenchmarkRun& run) const;
  benchmark::Row failed(std::size_t index, const std::string& reason) const;
  const benchmark::Scenario& scenario_of(std::size_t run) const {
    return work_.scenarios[work_.runs[run].scenario];
  }
  const Entrant& entrant_of(std::size_t run) const {
    return work_.entrants[work_.runs[run].entrant];
  }
  WorkProgress begin(const std::string& part, double from, double to) const {
    return task_.begin ? task_.begin(part) : part_of(listener_.progress, from, to);
  }
  KeptWork parts(std::size_t count) const {
    KeptWork parts;
    parts.count = static_cast<int>(count);
    parts.at_once = task_.jobs > 0 ? task_.jobs : usable_processors();
    parts.stop = [this] { return listener_.stop(); };
    return parts;
  }

  const BenchmarkWork& work_;
  const BenchmarkTask& task_;
  Journal& journal_;
  const Listener& listener_;
  OptimalMotionOptions planning_;
  std::vector<OptimalMotions> motions_;  // by scenario
  std::vector<benchmark::Row> rows_;     // by run
  int broken_ = 0;
};

/// Share of the work that the optimal motions are, of which only the progress that is told depends.
/// @threshold [1] 0..1; chosen: bounds are most of the work, runs are fast
constexpr double kPlanningShare = 0.7;

std::string Benchmark::planned(std::size_t k) const {
  if (work_.model_of[k] && !task_.no_optimum)
    return packed(optimal_motions(work_.scenarios[k], *work_.model_of[k], planning_));
  OptimalMotions none;
  none.legs.resize(1);
  none.legs[0].message = task_.no_optimum ? "it was left out" : "there is no model";
  return packed(none);
}

void Benchmark::plan() {
  const auto id = [&](int i) { return work_.scenarios[static_cast<std::size_t>(i)].id; };
  KeptWork all = parts(work_.scenarios.size());
  all.name = [&](int i) { return "optimum of " + id(i); };
  all.work = [&](int i) { return planned(static_cast<std::size_t>(i)); };
  all.complete = [&](const std::string&) { return !listener_.stop(); };
  const WorkProgress progress = begin("benchmark: optimal motions", 0.0, kPlanningShare);
  const std::vector<ChildResult> results =
      run_kept(all, journal_, [&](int i, int done, const ChildResult&) {
        if (progress) progress(static_cast<double>(done) / all.count, id(i));
      });
  motions_.reserve(results.size());
  for (const ChildResult& r : results) {
    if (r.ok) {
      motions_.push_back(motions_from(r.bytes));
      continue;
    }
    OptimalMotions& none = motions_.emplace_back();
    none.legs.resize(1);
    none.legs[0].message = r.error;
  }
}

benchmark::Row Benchmark::run(const BenchmarkRun& run) const {
  const benchmark::Scenario& s = work_.scenarios[run.scenario];
  const Entrant& e = work_.entrants[run.entrant];
  benchmark::LoopOptions loop;
  loop.stop = [this] { return listener_.stop(); };
  control::ForeignOptions foreign;
  foreign.step_budget = task_.step_budget;
  const LearnedRun learned{s, work_.model_of[run.scenario].get(), motions_[run.scenario],
                           planning_};
  return learned.run(
      e.name,
      [&](const control::Knowledge& know) -> std::unique_ptr<control::Controller> {
        if (e.make) return e.make(know);
        return e.info != nullptr ? e.info->make(know, e.gains)
                                 : control::foreign_controller(know, e.command, foreign);
      },
      run.seed, loop);
}

benchmark::Row Benchmark::failed(std::size_t index, const std::string& reason) const {
  benchmark::Row row;
  row.scenario = scenario_of(index).id;
  row.controller = entrant_of(index).name;
  row.seed = work_.runs[index].seed;
  row.reason = reason;
  return row;
}

void Benchmark::run_children(const std::vector<std::size_t>& indices,
                             const WorkProgress& progress) {
  const auto index = [&](int i) { return indices[static_cast<std::size_t>(i)]; };
  KeptWork all = parts(indices.size());
  all.name = [&](int i) {
    return fmt::format("run of {} by {}, seed {}", scenario_of(index(i)).id,
                       entrant_of(index(i)).name, work_.runs[index(i)].seed);
  };
  all.work = [&](int i) { return benchmark::packed(run(work_.runs[index(i)])); };
  all.complete = [](const std::string& bytes) {
    return benchmark::row_from(bytes).reason != kInterruptedRun;
  };
  const int before = finished_before(all, journal_);
  if (before > 0)
    listener_.say_note(fmt::format("{} of {} runs were finished before", before, all.count));
  const std::vector<ChildResult> results =
      run_kept(all, journal_, [&](int i, int done, const ChildResult&) {
        if (!progress) return;
        progress(static_cast<double>(done) / static_cast<double>(work_.runs.size()),
                 fmt::format("{}, {}", scenario_of(index(i)).id, entrant_of(index(i)).name));
      });
  for (std::size_t k = 0; k < results.size(); ++k) {
    if (results[k].ok) {
      rows_[indices[k]] = benchmark::row_from(results[k].bytes);
      continue;
    }
    const bool stopped = listener_.stop();
    rows_[indices[k]] = failed(indices[k], stopped ? kInterruptedRun : results[k].error);
    broken_ += stopped ? 0 : 1;
  }
}

void Benchmark::run_own(std::size_t index) {
  rows_[index] = failed(index, kInterruptedRun);
  if (listener_.stop()) return;
  try {
    rows_[index] = run(work_.runs[index]);
  } catch (const Interruption&) {  // whoever is asked is not asked any more: the row stays as it is
    return;
  }
}

void Benchmark::run_all() {
  std::vector<std::size_t> children, own;
  for (std::size_t k = 0; k < work_.runs.size(); ++k)
    (entrant_of(k).make ? own : children).push_back(k);
  rows_.resize(work_.runs.size());
  const WorkProgress progress = begin("benchmark", kPlanningShare, 1.0);
  run_children(children, progress);
  std::size_t done = children.size();
  for (const std::size_t k : own) {
    run_own(k);
    if (progress)
      progress(static_cast<double>(++done) / static_cast<double>(work_.runs.size()),
               fmt::format("{}, {}", scenario_of(k).id, entrant_of(k).name));
  }
}

BenchmarkResult Benchmark::result() {
  plan();
  run_all();
  BenchmarkResult result;
  result.reference = work_.reference;
  result.rows = std::move(rows_);
  result.broken = broken_;
  for (std::size_t s = 0; s < work_.scenarios.size(); ++s) {
    const std::string& id = work_.scenarios[s].id;
    if (motions_[s].found()) {
      result.promises[id] = {motions_[s].energy(), motions_[s].bound()};
    } else {
      result.no_promise[id] = motions_[s].message();
    }
  }
  result.controllers.reserve(work_.entrants.size());
  result.words.reserve(work_.entrants.size());
  for (const Entrant& e : work_.entrants) {
    result.controllers.push_back(e.name);
    result.words.push_back(e.words);
  }
  result.summary =
      benchmark::summarise(result.rows, result.controllers, result.reference, result.promises);
  result.interrupted = listener_.stop();
  result.scenarios = work_.scenarios;
  return result;
}

}  // namespace

BenchmarkResult benchmark_task(const BenchmarkWork& work, const BenchmarkTask& task,
                               Journal& journal, const Listener& listener) {
  return Benchmark(work, task, journal, listener).result();
}

}  // namespace sparflow
