#pragma once
/// Energy-optimal motion from seed paths. Each start solves an NLP with the smooth law and falling smoothing, then one with
/// the modes it found held fixed (so that no activation can be exploited); its motion is evaluated by the exact law
/// between the knots.
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/math/work_progress.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/nlp/ipopt_solver.h"
#include "optimizer/phases/motion_modes.h"
#include "optimizer/phases/phases.h"
#include "optimizer/phases/sequential_modes.h"

namespace sparflow {

/// Seed of a start as plain data, whatever its origin (a planner, a straight line, a previous motion).
struct SeedMotion {
  std::string name;
  Trajectory motion;  ///< any duration; rest to rest
  /// Shortest duration at which this path keeps all limits [s]; 0 = not known.
  double shortest_duration = 0.0;
  bool straight_line =
      false;  ///< whether it is a straight joint-space line, which is reported as baseline
};

/// The goal configurations in which the seeds end.
std::vector<Eigen::VectorXd> end_postures(const std::vector<SeedMotion>& seeds);

/// Range of a motion's duration, and the duration at which the search begins. [s]
struct TimeWindow {
  double guess = 0.0;
  double lower = 0.0, upper = 0.0;
  static TimeWindow fixed(double duration) { return {duration, duration, duration}; }
};

struct OptimizeOptions {
  /// Of the result's first mesh; refined to at most eight times that, see `mesh_error`.
  /// @threshold [intervals] 10..1000; chosen: refined where mesh_error asks for it
  int intervals = 100;
  /// Of the mesh on which starts and sequences are compared.
  /// @threshold [intervals] 10..1000; chosen: half of the first mesh; starts need only be compared
  int search_intervals = 50;
  /// A motion that is cheaper than a converged one by at most this share of its cost counts as optimal although its own solve did
  /// not converge: the solver minimises a smoothed energy, whose least motion need not be the exact energy's.
  /// @threshold [1] 0..0.1; chosen: five times what the smoothing is seen to cost on the bundled reaches, a tenth of a per cent
  double confirmed_within = 5e-3;
  /// Largest relative difference of the solve's energy, without the smoothing of the maximum, from the exact energy.
  /// @threshold [1] 1e-8..0.1; chosen: far below what models know
  double mesh_error = 1e-4;
  /// Number of seeds that are also solved with the smooth law.
  /// @threshold [1] 0..100; chosen: a smooth solve finds the modes of a motion anew where those of its seed are bad,
  /// and each takes time. One and four give the same energies as two to 0.001 % on ten bundled reaches of the loader
  /// crane
  int smooth_starts = 2;
  /// Cost of a seed over that of the best motion of the sequential and grid starts up to which the seed is solved too.
  /// @threshold [1] 1..10; tuned: on 36 bundled reaches no seed led to a lower energy than these starts and the search from them
  double seeds_within = 1.05;
  /// Falling smoothing, (eps [m/s], beta [Pa]); each stage starts from the solution of the one before.
  std::vector<Smoothing> schedule = {{20e-3, 10e5}};
  /// Iteration limit of a smooth stage; its motion only supplies the modes, so it need not converge.
  /// @threshold [iterations] 10..10000; chosen: the motion only supplies the modes
  int smooth_iterations = 100;
  /// Iteration limit of a solve with phases; half of it in the search.
  /// @threshold [iterations] 10..10000; chosen: ends a solve that creeps; another start is the better use of its
  /// time. On ten bundled reaches of the loader crane solves of the search do reach their limit, but half and twice
  /// of it change no energy by 0.002 %
  int phase_iterations = 300;
  /// Sequential motions tried besides the seeds, those with the cheapest guesses.
  /// @threshold [1] 0..100; chosen: half of the orders of three joints to two goal configurations. On ten bundled
  /// reaches of the loader crane three cost 0.02 % in one of them, and twelve gain nothing
  int sequential_starts = 6;
  /// Paths of the joint grid tried as starts (energy_grid.h).
  /// @threshold [1] 0..100; chosen: the cheapest path and two that pass obstacles otherwise. On ten bundled reaches
  /// of the loader crane one path costs 0.3 % over a wall, and six gain nothing
  int grid_starts = 3;
  /// Number of nodes of that grid.
  /// @threshold [nodes] 100..1e7; chosen: half the path becomes better and the time grows with it
  int grid_nodes = 15000;
  /// Largest number of solves of a start with renewed planes between machine and obstacles; two in the search.
  /// @threshold [solves] 0..50; chosen: most motions change by less than the mesh error after three
  int plane_solves = 6;
  bool modes = true;        ///< solve with fixed modes at last; false: the smooth NLP alone
  bool free_phases = true;  ///< durations of phases are variables; false: as in the start
  /// Overlap inserted between two phases, as share of the shorter one's duration.
  /// @threshold [1] 0..1; chosen: the solve changes it where phases are free
  double overlap = 0.3;
  /// Smallest number of intervals of a phase.
  /// @threshold [intervals] 2..100; chosen: start, stop and three between them
  int phase_intervals = 5;
  /// Largest number of rounds of the local search over mode sequences (neighbours() of phases.h).
  /// @threshold [1] 0..100; chosen: bounds the time; a round without gain ends it sooner
  int sequence_rounds = 3;
  /// Number of different motions from which that search begins.
  /// @threshold [1] 1..100; chosen: the best valley of the cost and a second one. On ten bundled reaches of the
  /// loader crane one alone costs 0.002 % at most and four gain 0.001 %, with as many more solves
  int searched_starts = 2;
  ModeOptions mode_options;
  /// Smoothing beta of the solves with fixed modes.
  /// @threshold [Pa] 1e3..1e6; chosen: 0.3 bar is below what pressure models know
  double pressure_in_modes = 0.3e5;
  /// Relative tolerance of the last solve.
  /// @threshold [1] 1e-12..1e-2; chosen: the energy then changes by less than its mesh error
  double tolerance = NlpOptions{}.tolerance;
  /// Samples per mesh interval at which limits are checked.
  /// @threshold [1] 1..100; chosen: a sixteenth of an interval
  int refine = 16;
  /// Relative overshoot between knots that counts as kept.
  /// @threshold [1] 0..1e-2; chosen: ten times the tolerance of the solve
  double limit_tolerance = 1e-5;
  /// Solves with bound tightening in one start, at most.
  /// @threshold [1] 0..100; chosen: each tightening takes up what the last one left between knots. On ten bundled
  /// reaches of the loader crane two and ten give the same energies; five leave room for limits that change places
  int tightenings = 5;
  /// Number of starts solved in parallel.
  /// @threshold [1] 1..1000; chosen: the smallest computers of users have two cores; the program asks for the machine's own number
  int processes = 2;
  /// Time limit of one start.
  /// @threshold [s] 1..1e6; chosen: bounds the time of the whole
  double max_seconds = 60.0;
  std::map<std::string, std::string> ipopt;  ///< further solver options by name
  /// Replaces the crane's knot model at every solve, for comparisons of derivatives; empty = no replacement.
  std::function<std::shared_ptr<KnotModel>(const CraneKnotOptions&, std::shared_ptr<KnotModel>)>
      knot_wrapper;
  /// Called after each start. Rounds of the search still to come are unknown; the share leaves room for them.
  WorkProgress progress;
  /// Called once an iteration; true stops with the best motion so far.
  std::function<bool()> interrupted;
};

/// One solve of a start.
struct StageRecord {
  std::string what;  ///< "smooth, 6 mm/s, 3 bar", "modes", "modes, limits tightened (1)"
  NlpStatus status = NlpStatus::kFailed;
  int iterations = 0;
  double solve_s = 0.0;
  double energy_exact = 0.0;  ///< [J] by the exact law, 0 when the solve gave no motion
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
  double cost = 0.0;           ///< [J] exact_cost() of the motion, by which starts are compared
  PhasePlan plan;              ///< phases of the motion; none if it was not solved with phases
  double energy_smooth = 0.0;  ///< [J] by the smooth law of the last solve
  double excess = 0.0;         ///< worst relative overshoot of a limit between knots
  int iterations = 0;
  double solve_s = 0.0, callbacks_s = 0.0, linear_solver_s = 0.0;
  bool modes_held = false;  ///< whether the motion is of a solve with fixed modes
  /// Whether the motion is of a solve that converged to OptimizeOptions::tolerance: neither a guess nor one cut short.
  bool converged = false;
  bool solved =
      false;  ///< whether it is of a solve that converged at all, be it to the tolerance of the search
  double seed_energy =
      0.0;  ///< [J] energy of the initial guess (the seed in this duration); 0 if it violates limits
  bool seed_feasible = false;
  std::vector<StageRecord> stages;
  int same_as = -1;  ///< index of an earlier start with the same motion
  bool usable(double limit_tolerance) const {
    return motion.size() > 1 && excess <= limit_tolerance;
  }
};

enum class OptimizeStatus {
  kOptimal,  ///< its solve converged, or one whose cost is hardly larger (OptimizeOptions::confirmed_within)
  kFeasible,  ///< the motion keeps all limits, but it is a guess or of a solve that did not converge
  kInfeasible,  ///< no motion within all limits was found
  kFailed,
  kInterrupted
};
const char* to_string(OptimizeStatus status);

struct OptimizeResult {
  OptimizeStatus status = OptimizeStatus::kFailed;
  std::string message;  ///< one sentence
  Trajectory motion;
  double duration = 0.0;           ///< [s]
  MotionEnergy energy;             ///< under the exact law
  double energy_smooth = 0.0;      ///< [J]
  std::vector<LimitCheck> checks;  ///< of the motion, or of the start with the smallest violation
  int best_start = -1;
  std::vector<StartResult> starts;
  double lower_bound =
      0.0;  ///< [J] estimated lower bound (energy_bound.h); 0 = not asked for or none
  double lower_bound_time = 0.0;  ///< [s] it is for motions that take at most this; 0 = for all
  /// [J] estimated lower bound of energy + idle power x time, where the duration is free and time has a price; 0 = none
  double lower_bound_cost = 0.0;
  std::string bound_note;  ///< why there is no bound, or what it lacks
  double grid_path_energy =
      0.0;  ///< [J] path of the joint grid, driven in the same duration; 0 = none
  double unlimited_energy =
      0.0;  ///< [J] cheapest path of the joint grid at unlimited time; 0 = none
  /// Relative, on the result's mesh (OptimizeOptions::mesh_error); not a number where no solve converged.
  double mesh_error = 0.0;
  double best_seed_energy = 0.0;  ///< [J] cheapest feasible seed at this duration; 0 = none
  std::string best_seed_name;
  double straight_line_energy = 0.0;  ///< [J] cheapest feasible straight joint line; 0 = none
  /// [J] straight joint line to the nearest goal configuration (the first straight seed); 0 = it violates a limit.
  double nearest_line_energy = 0.0;
  std::string straight_line_name;
  /// [J] of a cycle: its legs optimised one after the other, in shares of the time; 0 = no cycle.
  double legwise_energy = 0.0;
  /// [s] shortest motion found within all limits; it is sought when no start keeps them in the duration asked for. 0 = none.
  double shortest_duration = 0.0;
  bool interrupted = false;  ///< the search or what was asked beside it ended early
  double solve_s = 0.0;      ///< wall time of everything, the bound included
  double bound_s = 0.0;      ///< wall time of the bound
  double evaluated_durations = 1;
};

/// Solves one start at one duration [s].
StartResult optimize_from(const CraneModel& model, const MotionProblem& problem,
                          const SeedMotion& seed, double duration, const OptimizeOptions& options);
/// Solves one start with the duration free in a window.
StartResult optimize_from(const CraneModel& model, const MotionProblem& problem,
                          const SeedMotion& seed, const TimeWindow& time,
                          const OptimizeOptions& options);

/// Solves one start with given modes.
StartResult optimize_with_modes(const CraneModel& model, const MotionProblem& problem,
                                const ModeCandidate& candidate, const OptimizeOptions& options);
StartResult optimize_with_modes(const CraneModel& model, const MotionProblem& problem,
                                const ModeCandidate& candidate, const TimeWindow& time,
                                const OptimizeOptions& options);

struct PhasedStart {
  std::string name;
  PhasePlan plan;
  Trajectory guess;  ///< a motion whose phases are driven in the plan's durations
  bool overlaps;     ///< whether overlaps are inserted between the phases
};

/// Solves one start with given phases.
StartResult optimize_with_phases(const CraneModel& model, const MotionProblem& problem,
                                 const PhasedStart& start, const TimeWindow& time,
                                 const OptimizeOptions& options);

/// Solves all starts (seeds, sequential motions, grid paths) at one duration, in child processes, and returns the best by
/// exact_cost().
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

/// Why a cycle has no bound.
inline constexpr const char* kNoBoundOfCycles =
    "no bound for cycles: that of each leg holds from a given posture, and the postures at the "
    "stops are free";

/// @throws InputError when the model lacks a pressure model that the machine needs
void require_complete(const CraneModel& model, const MotionProblem& problem);

/// The problem as posed: a fixed duration, or the duration that minimises energy + idle power * time.
/// Without seeds it starts from paths of the joint grid (grid_seeds.h). A cycle takes its seeds from there (optimize_cycle.h).
/// @throws InputError when the model lacks a pressure model that the machine needs
OptimizeResult optimize(const CraneModel& model, const MotionProblem& problem,
                        const std::vector<SeedMotion>& seeds, const OptimizeOptions& options = {});

}  // namespace sparflow
