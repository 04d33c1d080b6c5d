#pragma once
/// Energy-optimal motion from seed paths: smooth NLP with falling smoothing, then the modes it found held
/// fixed (no activation left to exploit), then the exact law's verdict between the knots.
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "optimizer/crane/exact_energy.h"
#include "optimizer/nlp/ipopt_solver.h"
#include "optimizer/phases/motion_modes.h"
#include "optimizer/phases/phases.h"
#include "optimizer/phases/sequential_modes.h"

namespace sparflow {

/// A starting motion as plain data; whoever made it (a planner, a straight line, a previous motion) is only
/// a name here.
struct SeedMotion {
  std::string name;
  Trajectory motion;  ///< any duration; rest to rest
  /// Shortest duration at which this path keeps all limits [s]; 0 = not known.
  double shortest_duration = 0.0;
  bool straight_line = false;  ///< a straight joint-space line, the baseline users compare with
};

/// How long a motion may take, and where the search for its duration begins. [s]
struct TimeWindow {
  double guess = 0.0;
  double lower = 0.0, upper = 0.0;
  static TimeWindow fixed(double duration) { return {duration, duration, duration}; }
};

struct OptimizeOptions {
  int intervals = 100;  ///< of the answer's mesh, and at most eight times that: see `mesh_error`
  int search_intervals = 50;  ///< of the mesh on which starts and sequences are compared
  double mesh_error =
      1e-4;  ///< |energy of the solve - exact energy| / exact energy, beyond the softness of its maximum
  int smooth_starts = 2;  ///< seeds that are solved through the smooth law too
  /// Falling smoothing, (eps [m/s], beta [Pa]); each stage starts from the one before.
  std::vector<Smoothing> schedule = {{20e-3, 10e5}};
  /// Iterations a smooth stage may take: its motion is a start for the modes, not the answer.
  int smooth_iterations = 100;
  int phase_iterations = 300;  ///< of a solve with phases; half of it in the search
  int sequential_starts = 6;   ///< one-by-one motions tried besides the seeds, the cheapest guesses
  int grid_starts = 3;         ///< paths of the global search on a joint grid (energy_grid.h)
  int grid_nodes = 15000;      ///< of that grid
  bool modes = true;  ///< finish with the modes held fixed; false: the single smooth NLP alone
  bool free_phases = true;  ///< how long each mode lasts is a variable; false: as the start has it
  double overlap = 0.3;     ///< offered between two phases, share of the shorter one's time
  int phase_intervals = 5;  ///< least intervals of a phase
  /// Neighbours of the best mode sequences tried (phases left out, exchanged, made one, moved): rounds at most.
  int sequence_rounds = 3;
  int searched_starts = 2;  ///< different motions the search over mode sequences begins from
  ModeOptions mode_options;
  double pressure_in_modes = 0.3e5;  ///< beta of the finish [Pa]
  double tolerance = 1e-6;           ///< of the last solve
  int refine = 16;                   ///< density of the checks between knots
  double limit_tolerance = 1e-5;     ///< relative overshoot between knots that counts as kept
  int tightenings = 5;               ///< solves that may be spent on limits broken between knots
  int processes = 2;                 ///< starts solved at once
  double max_seconds = 60.0;         ///< of one start
  std::map<std::string, std::string> ipopt;  ///< further solver options by name
  /// Puts another model in the place of the crane's at every solve, for comparisons of derivatives; empty = none.
  std::function<std::shared_ptr<KnotModel>(const CraneKnotOptions&, std::shared_ptr<KnotModel>)>
      knot_wrapper;
  /// (starts done, starts in all, sentence); false interrupts.
  std::function<bool(int, int, const std::string&)> progress;
  /// Asked once an iteration; true stops with the best so far.
  std::function<bool()> interrupted;
};

/// One solve on the way of a start.
struct StageRecord {
  std::string what;  ///< "smooth, 6 mm/s, 3 bar", "modes", "modes, limits drawn in"
  NlpStatus status = NlpStatus::kFailed;
  int iterations = 0;
  double solve_s = 0.0;
  double energy_exact = 0.0;  ///< [J], 0 when the solve gave no motion
  double excess = 0.0;        ///< worst relative overshoot of a limit between knots
};

/// One start's outcome.
struct StartResult {
  std::string seed;
  NlpStatus status = NlpStatus::kFailed;
  std::string message;
  Trajectory motion;           ///< empty when there is none
  double duration = 0.0;       ///< [s] it was solved for
  double energy_exact = 0.0;   ///< [J]
  double cost = 0.0;           ///< [J] exact_cost() of the motion, what starts are compared by
  PhasePlan plan;              ///< phases of the motion; none if they were not held
  double energy_smooth = 0.0;  ///< [J] of the last solve's own law
  double excess = 0.0;         ///< worst relative overshoot of a limit between knots
  int iterations = 0;
  double solve_s = 0.0, callbacks_s = 0.0, linear_solver_s = 0.0;
  bool modes_held = false;  ///< finished with fixed modes
  double seed_energy =
      0.0;  ///< [J] exact energy of the seed at this duration; 0 if it breaks limits
  bool seed_feasible = false;
  std::vector<StageRecord> stages;
  int same_as = -1;  ///< index of an earlier start with the same motion
  bool usable(double limit_tolerance) const {
    return motion.size() > 1 && excess <= limit_tolerance;
  }
};

enum class OptimizeStatus { kOptimal, kInfeasible, kFailed, kInterrupted };
const char* to_string(OptimizeStatus status);

struct OptimizeResult {
  OptimizeStatus status = OptimizeStatus::kFailed;
  std::string message;  ///< one sentence
  Trajectory motion;
  double duration = 0.0;           ///< [s]
  MotionEnergy energy;             ///< under the exact law
  double energy_smooth = 0.0;      ///< [J]
  std::vector<LimitCheck> checks;  ///< of the motion, or of the start that came nearest to one
  int best_start = -1;
  std::vector<StartResult> starts;
  double lower_bound =
      0.0;  ///< [J] no motion takes less (energy_bound.h); 0 = not asked for or none
  double lower_bound_time = 0.0;  ///< [s] it holds for motions that take at most this; 0 = for all
  std::string bound_note;         ///< why there is none, or how the bound was found
  double grid_path_energy =
      0.0;  ///< [J] dynamic programming's path, driven in the same time; 0 = none
  double unlimited_energy = 0.0;  ///< [J] its cheapest path at unlimited time; 0 = none
  double mesh_error = 0.0;  ///< of the answer's last mesh, relative (OptimizeOptions::mesh_error)
  double best_seed_energy = 0.0;  ///< [J] cheapest feasible seed at this duration; 0 = none
  std::string best_seed_name;
  double straight_line_energy = 0.0;  ///< [J] cheapest feasible straight joint line; 0 = none
  /// [J] the straight joint line to the nearest end posture (the first straight seed); 0 = breaks a limit.
  double nearest_line_energy = 0.0;
  std::string straight_line_name;
  /// [s] the shortest motion found within all limits, sought when no start met the duration; 0 = not sought or none.
  double shortest_duration = 0.0;
  double solve_s = 0.0;  ///< wall time of everything
  double evaluated_durations = 1;
};

/// One start at one duration.
StartResult optimize_from(const CraneModel& model, const MotionProblem& problem,
                          const SeedMotion& seed, double duration, const OptimizeOptions& options);
/// One start in a window of durations.
StartResult optimize_from(const CraneModel& model, const MotionProblem& problem,
                          const SeedMotion& seed, const TimeWindow& time,
                          const OptimizeOptions& options);

/// One start with its modes given.
StartResult optimize_with_modes(const CraneModel& model, const MotionProblem& problem,
                                const ModeCandidate& candidate, const OptimizeOptions& options);
StartResult optimize_with_modes(const CraneModel& model, const MotionProblem& problem,
                                const ModeCandidate& candidate, const TimeWindow& time,
                                const OptimizeOptions& options);

/// One start with its phases given, from a motion near them (its stretches are driven in the plan's durations).
/// @param overlaps offered between the phases
StartResult optimize_with_phases(const CraneModel& model, const MotionProblem& problem,
                                 const std::string& name, const PhasePlan& plan,
                                 const Trajectory& guess, const TimeWindow& time, bool overlaps,
                                 const OptimizeOptions& options);

/// All starts (seeds and one-by-one motions) at one duration, in child processes, best one chosen by its exact energy.
OptimizeResult optimize_at(const CraneModel& model, const MotionProblem& problem,
                           const std::vector<SeedMotion>& seeds, double duration,
                           const OptimizeOptions& options);
OptimizeResult optimize_in(const CraneModel& model, const MotionProblem& problem,
                           const std::vector<SeedMotion>& seeds, const TimeWindow& time,
                           const OptimizeOptions& options);

/// The shortest motion within all limits that can be found from these seeds; its status is kOptimal when there is one.
OptimizeResult shortest_motion(const CraneModel& model, const MotionProblem& problem,
                               const std::vector<SeedMotion>& seeds,
                               const OptimizeOptions& options);

/// The problem as posed: a fixed duration, or the duration that minimises energy + idle power * time.
/// @throws InputError when the model lacks a pressure process the machine needs
OptimizeResult optimize(const CraneModel& model, const MotionProblem& problem,
                        const std::vector<SeedMotion>& seeds, const OptimizeOptions& options = {});

}  // namespace sparflow
