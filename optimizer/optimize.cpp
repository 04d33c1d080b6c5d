#include "optimizer/optimize.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "models/error.h"
#include "optimizer/child_processes.h"

namespace sparflow {
namespace {

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void pack_matrix(Packer& p, const Eigen::MatrixXd& m) {
  p.number(static_cast<double>(m.rows())).number(static_cast<double>(m.cols()));
  p.numbers(m.data(), static_cast<std::size_t>(m.size()));
}

Eigen::MatrixXd unpack_matrix(Unpacker& u) {
  const auto rows = static_cast<Eigen::Index>(u.number());
  const auto cols = static_cast<Eigen::Index>(u.number());
  const std::vector<double> values = u.numbers();
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), rows, cols);
}

std::string pack(const StartResult& r) {
  Packer p;
  p.text(r.seed).number(static_cast<double>(r.status)).text(r.message);
  pack_matrix(p, r.motion.t);
  pack_matrix(p, r.motion.q);
  pack_matrix(p, r.motion.qd);
  pack_matrix(p, r.motion.qdd);
  p.number(r.energy_exact).number(r.energy_smooth).number(r.excess).number(r.iterations);
  p.number(r.solve_s).number(r.callbacks_s).number(r.linear_solver_s).number(r.modes_held);
  p.number(r.seed_energy).number(r.seed_feasible).number(static_cast<double>(r.stages.size()));
  for (const StageRecord& s : r.stages) {
    p.text(s.what).number(static_cast<double>(s.status)).number(s.iterations);
    p.number(s.solve_s).number(s.energy_exact).number(s.excess);
  }
  return p.bytes();
}

StartResult unpack(const std::string& bytes) {
  Unpacker u(bytes);
  StartResult r;
  r.seed = u.text();
  r.status = static_cast<NlpStatus>(static_cast<int>(u.number()));
  r.message = u.text();
  r.motion.t = unpack_matrix(u);
  r.motion.q = unpack_matrix(u);
  r.motion.qd = unpack_matrix(u);
  r.motion.qdd = unpack_matrix(u);
  r.energy_exact = u.number();
  r.energy_smooth = u.number();
  r.excess = u.number();
  r.iterations = static_cast<int>(u.number());
  r.solve_s = u.number();
  r.callbacks_s = u.number();
  r.linear_solver_s = u.number();
  r.modes_held = u.number() != 0.0;
  r.seed_energy = u.number();
  r.seed_feasible = u.number() != 0.0;
  r.stages.resize(static_cast<std::size_t>(u.number()));
  for (StageRecord& s : r.stages) {
    s.what = u.text();
    s.status = static_cast<NlpStatus>(static_cast<int>(u.number()));
    s.iterations = static_cast<int>(u.number());
    s.solve_s = u.number();
    s.energy_exact = u.number();
    s.excess = u.number();
  }
  return r;
}

/// Two starts that ended in the same motion: all joints within a thousandth of their range at all knots.
bool same_motion(const MotionProblem& problem, const Trajectory& a, const Trajectory& b) {
  if (a.size() != b.size() || a.size() < 2) return false;
  for (Eigen::Index j = 0; j < a.q.cols(); ++j) {
    const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
    if ((a.q.col(j) - b.q.col(j)).cwiseAbs().maxCoeff() > 1e-3 * (r.hi - r.lo)) return false;
  }
  return true;
}

double shortest_seed(const std::vector<SeedMotion>& seeds) {
  double shortest = 0.0;
  for (const SeedMotion& s : seeds) {
    if (s.shortest_duration > 0.0 && (shortest == 0.0 || s.shortest_duration < shortest))
      shortest = s.shortest_duration;
  }
  return shortest;
}

/// The cheapest different motions that came from seeds, the winner apart.
std::vector<SeedMotion> best_other_motions(const OptimizeResult& result, std::size_t seed_count,
                                           double limit_tolerance, std::size_t most) {
  std::vector<const StartResult*> kept;
  for (std::size_t i = 0; i < std::min(seed_count, result.starts.size()); ++i) {
    const StartResult& s = result.starts[i];
    if (static_cast<int>(i) != result.best_start && s.same_as < 0 && s.usable(limit_tolerance))
      kept.push_back(&s);
  }
  std::sort(kept.begin(), kept.end(), [](const StartResult* a, const StartResult* b) {
    return a->energy_exact < b->energy_exact;
  });
  std::vector<SeedMotion> motions;
  for (std::size_t i = 0; i < std::min(most, kept.size()); ++i) {
    motions.push_back({kept[i]->seed, kept[i]->motion, 0.0, false});
  }
  return motions;
}

/// What the seeds themselves cost, driven in the result's time, where they keep the limits in it.
void set_baselines(const CraneModel& model, const MotionProblem& problem,
                   const std::vector<SeedMotion>& seeds, int refine, OptimizeResult& result) {
  result.best_seed_energy = result.straight_line_energy = result.nearest_line_energy = 0.0;
  constexpr double kSeedTolerance =
      1e-3;  // time scaling of a seed on its own mesh: see time_parametrise
  bool first_line = true;
  for (const SeedMotion& s : seeds) {
    const bool nearest = s.straight_line && first_line;
    if (s.straight_line) first_line = false;
    const Trajectory timed = with_duration(s.motion, result.duration);
    if (worst_excess(check_limits(model, problem, timed, refine)) > kSeedTolerance) continue;
    const double energy = exact_energy(model, timed, problem.payload, refine).total;
    if (result.best_seed_energy == 0.0 || energy < result.best_seed_energy) {
      result.best_seed_energy = energy;
      result.best_seed_name = s.name;
    }
    if (nearest) result.nearest_line_energy = energy;
    if (s.straight_line &&
        (result.straight_line_energy == 0.0 || energy < result.straight_line_energy)) {
      result.straight_line_energy = energy;
      result.straight_line_name = s.name;
    }
  }
}

/// The start nearest to keeping every limit; null when none came to a motion.
const StartResult* nearest_start(const OptimizeResult& result) {
  const StartResult* nearest = nullptr;
  for (const StartResult& s : result.starts) {
    if (s.motion.size() > 1 && (nearest == nullptr || s.excess < nearest->excess)) nearest = &s;
  }
  return nearest;
}

/// How many times longer the motion would have to take for this limit to hold: what makes a velocity, an
/// acceleration and a flow comparable. Lengths do not mend with time.
double stretch_asked(const LimitCheck& c) {
  if (c.excess <= 0.0 || c.limit == 0.0) return 1.0 + std::max(c.excess, 0.0);
  const double ratio = std::abs(c.value / c.limit);
  if (c.what.starts_with("acceleration of")) return std::sqrt(ratio);
  // between equals the flow, which is why the accelerations of a shortened path are too high
  return c.what.starts_with("flow") ? 1.01 * ratio : ratio;
}

/// @param result with the checks of its nearest motion, if there is one
void say_why_infeasible(const MotionProblem& problem, const std::vector<SeedMotion>& seeds,
                        double duration, OptimizeResult& result) {
  std::string worst;
  if (!result.checks.empty()) {
    const LimitCheck& c = *std::max_element(result.checks.begin(), result.checks.end(),
                                            [](const LimitCheck& x, const LimitCheck& y) {
                                              return stretch_asked(x) < stretch_asked(y);
                                            });
    worst = fmt::format(" Worst: {} at t={:.2f} s, {:.4g} against a limit of {:.4g} {}.", c.what,
                        c.time, c.value, c.limit, c.unit);
  } else if (!result.starts.empty()) {
    worst = " The solver says: " + result.starts.front().message + ".";
  }
  const double shortest = shortest_seed(seeds);
  const std::string remedy =
      shortest > duration
          ? fmt::format(" A seed path keeps all limits in {:.1f} s; {} s was asked for.", shortest,
                        duration)
          : std::string();
  result.status = OptimizeStatus::kInfeasible;
  result.message = fmt::format("{}: infeasible.{}{}", problem.name, worst, remedy);
}

}  // namespace

const char* to_string(OptimizeStatus status) {
  switch (status) {
    case OptimizeStatus::kOptimal:
      return "optimal";
    case OptimizeStatus::kInfeasible:
      return "infeasible";
    case OptimizeStatus::kFailed:
      return "failed";
    case OptimizeStatus::kInterrupted:
      return "interrupted";
  }
  return "failed";
}

OptimizeResult optimize_at(const CraneModel& model, const MotionProblem& problem,
                           const std::vector<SeedMotion>& seeds, double duration,
                           const OptimizeOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  OptimizeResult result;
  result.duration = duration;
  std::vector<ModeCandidate> one_by_one;
  if (options.sequential_starts > 0 && options.modes && !problem.tip_line) {
    const Eigen::VectorXd times = Eigen::VectorXd::LinSpaced(options.intervals + 1, 0.0, duration);
    std::vector<Eigen::VectorXd> ends;
    ends.reserve(seeds.size());
    for (const SeedMotion& s : seeds) {
      ends.emplace_back(s.motion.q.row(s.motion.size() - 1).transpose());
    }
    one_by_one = sequential_candidates(model, problem, times, ends, options.sequential_starts);
  }
  const std::size_t given = seeds.size();
  const int count = static_cast<int>(given + one_by_one.size());
  const auto name = [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    return k < given ? seeds[k].name : one_by_one[k - given].name;
  };
  const auto work = [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    return pack(k < given ? optimize_from(model, problem, seeds[k], duration, options)
                          : optimize_with_modes(model, problem, one_by_one[k - given], options));
  };
  const auto done = [&](int index, int finished) {
    if (options.progress) options.progress(finished, count, name(index));
  };
  const std::vector<ChildResult> children = run_in_children(count, options.processes, work, done);
  for (int i = 0; i < count; ++i) {
    const ChildResult& child = children[static_cast<std::size_t>(i)];
    StartResult start;
    if (child.ok) {
      start = unpack(child.bytes);
    } else {
      start.seed = name(i);
      start.message = child.error;
    }
    start.duration = duration;
    for (std::size_t k = 0; k < result.starts.size() && start.same_as < 0; ++k) {
      if (same_motion(problem, start.motion, result.starts[k].motion))
        start.same_as = static_cast<int>(k);
    }
    result.starts.push_back(std::move(start));
  }
  for (int i = 0; i < count; ++i) {
    const StartResult& s = result.starts[static_cast<std::size_t>(i)];
    if (!s.usable(options.limit_tolerance)) continue;
    if (result.best_start < 0 ||
        s.energy_exact < result.starts[static_cast<std::size_t>(result.best_start)].energy_exact) {
      result.best_start = i;
    }
  }
  set_baselines(model, problem, seeds, options.refine, result);
  result.solve_s = seconds_since(begin);
  if (result.best_start >= 0) {
    const StartResult& best = result.starts[static_cast<std::size_t>(result.best_start)];
    const bool stopped =
        std::any_of(result.starts.begin(), result.starts.end(),
                    [](const StartResult& r) { return r.status == NlpStatus::kInterrupted; });
    result.status = stopped ? OptimizeStatus::kInterrupted : OptimizeStatus::kOptimal;
    result.motion = best.motion;
    result.energy_smooth = best.energy_smooth;
    result.energy = exact_energy(model, best.motion, problem.payload, options.refine);
    result.checks = check_limits(model, problem, best.motion, options.refine);
    result.message =
        fmt::format("{}: {:.1f} kJ in {:.2f} s", problem.name, result.energy.total / 1e3, duration);
    return result;
  }
  bool interrupted = false;
  for (const StartResult& s : result.starts) {
    interrupted = interrupted || s.status == NlpStatus::kInterrupted;
  }
  if (const StartResult* nearest = nearest_start(result))
    result.checks = check_limits(model, problem, nearest->motion, options.refine);
  if (interrupted) {
    result.status = OptimizeStatus::kInterrupted;
    result.message = problem.name + ": interrupted before any motion was found";
  } else {
    say_why_infeasible(problem, seeds, duration, result);
  }
  return result;
}

OptimizeResult optimize(const CraneModel& model, const MotionProblem& problem,
                        const std::vector<SeedMotion>& seeds, const OptimizeOptions& options) {
  SPARFLOW_CHECK(!seeds.empty(), "optimisation starts from at least one seed");
  const std::vector<std::string> missing = model.missing();
  if (!missing.empty()) {
    throw InputError({problem.file, 0, 0}, "model",
                     fmt::format("the model has no working pressure for {}; fit it on a log in "
                                 "which that movement occurs",
                                 fmt::join(missing, ", ")));
  }
  if (problem.duration.fixed())
    return optimize_at(model, problem, seeds, problem.duration.min, options);

  // Free or bounded time: J(T) = E(T) + idle power * T. All starts at a comfortable duration, then a golden
  // section over T from the best motion, which changes little from one duration to the next.
  const auto begin = std::chrono::steady_clock::now();
  const double shortest = shortest_seed(seeds);
  const double lo = std::max(problem.duration.min, 0.4 * shortest);
  const double hi = std::min(problem.duration.max, std::max(6.0 * shortest, 2.0 * lo));
  OptimizeResult best =
      optimize_at(model, problem, seeds, std::clamp(1.5 * shortest, lo, hi), options);
  if (best.status == OptimizeStatus::kInfeasible && hi > best.duration)
    best = optimize_at(model, problem, seeds, hi, options);
  if (best.status != OptimizeStatus::kOptimal) return best;
  const auto cost = [&](const OptimizeResult& r) {
    return r.status == OptimizeStatus::kOptimal ? r.energy.total + problem.idle_power * r.duration
                                                : std::numeric_limits<double>::infinity();
  };
  // At every duration: the best so far, the best other motions of the first (driven faster or slower, modes as they
  // are: an overlap may be what a shorter time needs) and the cheapest one-by-one motions.
  OptimizeOptions nearby = options;
  nearby.schedule.clear();
  nearby.sequential_starts = std::min(options.sequential_starts, 2);
  const std::vector<SeedMotion> others =
      best_other_motions(best, seeds.size(), options.limit_tolerance, 2);
  nearby.progress = {};
  int durations = 1;
  const auto evaluate = [&](double duration) {
    std::vector<SeedMotion> tried = others;
    tried.push_back({"best so far", best.motion, shortest, false});
    OptimizeResult r = optimize_at(model, problem, tried, duration, nearby);
    ++durations;
    const double value = cost(r);
    if (value < cost(best)) {
      best = std::move(r);
    }
    if (options.progress)
      options.progress(durations, 14, fmt::format("duration {:.2f} s", duration));
    return value;
  };
  constexpr double kGolden = 0.6180339887498949;
  double a = lo, b = hi;
  double x1 = b - kGolden * (b - a), x2 = a + kGolden * (b - a);
  double f1 = evaluate(x1), f2 = evaluate(x2);
  while (b - a > 0.02 * best.duration && durations < 14 &&
         !(options.interrupted && options.interrupted())) {
    if (f1 < f2) {
      b = x2;
      x2 = x1;
      f2 = f1;
      x1 = b - kGolden * (b - a);
      f1 = evaluate(x1);
    } else {
      a = x1;
      x1 = x2;
      f1 = f2;
      x2 = a + kGolden * (b - a);
      f2 = evaluate(x2);
    }
  }
  // Everything again in the time that was chosen: every start is then of one duration, and none is missed
  // because it was only tried in another.
  if (!(options.interrupted && options.interrupted())) {
    std::vector<SeedMotion> all = seeds;
    all.push_back({"best of the duration search", best.motion, shortest, false});
    OptimizeResult last = optimize_at(model, problem, all, best.duration, options);
    if (last.best_start >= 0 && last.energy.total <= best.energy.total) best = std::move(last);
  }
  // compared with lines and seeds in the time that was chosen
  set_baselines(model, problem, seeds, options.refine, best);
  best.evaluated_durations = durations;
  best.solve_s = seconds_since(begin);
  return best;
}

}  // namespace sparflow
