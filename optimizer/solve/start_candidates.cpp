#include "optimizer/solve/start_candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "optimizer/grid/energy_grid.h"
#include "optimizer/solve/grid_seeds.h"
#include "optimizer/solve/optimize_outcome.h"
#include "problems/clearance.h"

namespace sparflow {
namespace {

/// Below this multiple of the shortest duration some cylinders must move together: sequential motions need about twice.
/// @threshold [1] 1..10; chosen: below it sequences with overlap are started from slower motions, too
constexpr double kShortOfTime = 2.0;

/// Where time is short, mode sequences of motions with these multiples of the duration are tried too.
/// @threshold [1] 1..5; chosen: about a quarter and two thirds more time, up to the duration of sequential motions
constexpr double kSlower[] = {1.25, 1.6};

}  // namespace

bool time_is_everything(const MotionProblem& problem) {
  return problem.objective.energy == 0.0 && problem.objective.time > 0.0;
}

bool same_plan(const PhasePlan& a, const PhasePlan& b) {
  return a.count() == b.count() && a.modes.cols() == b.modes.cols() &&
         (a.modes.array() == b.modes.array()).all();
}

std::vector<ModeCandidate> StartCandidates::all() const {
  std::vector<ModeCandidate> found = sequences(time_.guess);
  if (short_of_time()) {
    for (const double slower : kSlower) {
      for (ModeCandidate& c : sequences(slower * time_.guess)) {
        c.name = fmt::format("shortened {:g} times: {}", slower, c.name);
        c.guess = with_duration(c.guess, time_.guess);
        found.push_back(std::move(c));
      }
    }
  }
  drop_repeated(found);
  return found;
}

/// Whether time is too short for sequential motions. Then the mode sequence of a slower motion with overlapping phases is
/// cheap, which neither the seeds (all joints at once) nor the grid at this duration contain. Near obstacles it is not
/// used: there paths differ in how they pass the obstacles, and a solve takes ten times longer.
bool StartCandidates::short_of_time() const {
  const double shortest = shortest_seed(seeds_);
  return problem_.objective.energy > 0.0 && problem_.obstacles.empty() &&
         time_.lower == time_.upper && time_.guess < kShortOfTime * shortest;
}

/// Sequential starts for this duration, and the cheapest paths of the joint grid.
std::vector<ModeCandidate> StartCandidates::sequences(double duration) const {
  std::vector<ModeCandidate> found;
  if (options_.sequential_starts > 0 && options_.modes && !problem_.tip_line &&
      problem_.waypoints.empty()) {
    const Eigen::VectorXd times = Eigen::VectorXd::LinSpaced(options_.intervals + 1, 0.0, duration);
    found = sequential_candidates(model_, problem_, times, end_postures(seeds_),
                                  options_.sequential_starts);
  }
  for (ModeCandidate& c : grid_candidates(duration)) found.push_back(std::move(c));
  return found;
}

/// Of candidates with the same phases to (nearly) the same goal configuration the first is kept: the phases' durations are
/// variables, so that the others would lead to the same motion. Beside obstacles the way counts as well, because the first
/// solve holds the times.
void StartCandidates::drop_repeated(std::vector<ModeCandidate>& candidates) const {
  /// Difference of a joint's position, as share of its range, up to which goal configurations (or ways) count as the same.
  /// @threshold [1] 0..0.5; chosen: a solve moves the end along the goal set by more than that
  constexpr double kSamePlace = 0.05;
  if (!options_.free_phases) return;
  const bool ends_only = problem_.obstacles.empty();
  std::vector<PhasePlan> plans;
  std::vector<ModeCandidate> kept;
  const auto same_way = [&](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    const Eigen::Index rows = ends_only ? 1 : a.rows();
    if (!ends_only && a.rows() != b.rows()) return false;
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      const Range& r = problem_.limits.position[static_cast<std::size_t>(j)];
      const auto apart = (a.col(j).tail(rows) - b.col(j).tail(rows)).cwiseAbs().maxCoeff();
      if (apart > kSamePlace * (r.hi - r.lo)) return false;
    }
    return true;
  };
  for (ModeCandidate& c : candidates) {
    PhasePlan plan = plan_of(c.modes, c.guess.t);
    bool known = false;
    for (std::size_t k = 0; k < kept.size() && !known; ++k)
      known = same_plan(plan, plans[k]) && same_way(c.guess.q, kept[k].guess.q);
    if (known) continue;
    plans.push_back(std::move(plan));
    kept.push_back(std::move(c));
  }
  candidates = std::move(kept);
}

/// @param wanted duration of the paths [s]; if it is longer than the window allows, the caller shortens the motion
std::vector<ModeCandidate> StartCandidates::grid_candidates(double wanted) const {
  std::vector<ModeCandidate> found;
  const EnergyGridOptions size{options_.grid_nodes};
  if (options_.grid_starts <= 0 || !options_.modes || problem_.tip_line ||
      !problem_.waypoints.empty() || model_.machine.joint_count() > size.most_joints)
    return found;
  const auto search = [&](const MotionProblem& problem, int most) {
    EnergyGrid grid(model_, problem, size);
    std::vector<GridPath> paths;
    if (problem.objective.energy > 0.0) {
      paths = grid.paths_for_duration(wanted, most);
    } else if (time_is_everything(problem)) {
      /// Price of time of a path that is only fast.
      /// @threshold [W] 1e6..1e12; derived: ten megawatts, far above the power of any pump
      constexpr double kTimeIsEverything = 1e7;
      paths.push_back(grid.cheapest_path(kTimeIsEverything));
    }
    for (const GridPath& path : paths) {
      if (!path.found) continue;
      double duration = std::max(wanted, path.duration_s);
      if (wanted <= time_.upper) duration = std::clamp(duration, time_.lower, time_.upper);
      found.push_back(grid_path_candidate(model_, problem, path, duration, options_.intervals));
    }
  };
  search(problem_, options_.grid_starts);
  if (!problem_.obstacles.empty()) {
    // The smooth clearance rows keep a larger distance than the exact check, so paths with that distance are sought.
    MotionProblem wider = problem_;
    wider.clearance = capsule_radius(problem_) + kRoomForTheRows;
    search(wider, options_.grid_starts);
  }
  return found;
}

}  // namespace sparflow
