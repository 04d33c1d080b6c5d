#include "planners/ompl_query.h"

#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/ScopedState.h>
#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/geometric/PathSimplifier.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <limits>
#include <memory>
#include <mutex>

namespace sparflow {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

std::mutex& ompl_lock() {
  static std::mutex lock;
  return lock;
}

/// Silences OMPL's console output during its lifetime and restores the log level afterwards.
class SilentOmpl {
 public:
  SilentOmpl() : level_(ompl::msg::getLogLevel()) { ompl::msg::setLogLevel(ompl::msg::LOG_NONE); }
  ~SilentOmpl() { ompl::msg::setLogLevel(level_); }
  SilentOmpl(const SilentOmpl&) = delete;
  SilentOmpl& operator=(const SilentOmpl&) = delete;

 private:
  ompl::msg::LogLevel level_;
};

/// Path simplification by shortcuts until a round no longer shortens the path. simplify() is not used because it is bounded
/// by time and so not reproducible, simplifyMax() because its B-splines add states.
void shorten(og::PathSimplifier& simplifier, og::PathGeometric& path, const QueryLimits& limits) {
  /// Attempts of a round of shortcuts, and of those without success after which it ends.
  /// @threshold [1] 10..10000; chosen: rounds repeat until the path settles
  constexpr unsigned kSteps = 100;
  double length = path.length();
  /// Largest number of rounds.
  /// @threshold [1] 1..100; chosen: a round that gains nothing ends it sooner
  constexpr int kMostRounds = 10;
  /// Length over that before the round, above which the path no longer became shorter.
  /// @threshold [1] 0.9..1; chosen: a thousandth of the way is worth no further round
  constexpr double kShortened = 0.999;
  for (int round = 0; round < kMostRounds; ++round) {
    simplifier.reduceVertices(path, kSteps, kSteps, 1.0);
    simplifier.shortcutPath(path, kSteps, kSteps, 1.0, 0.005);
    const double shorter = path.length();
    if (shorter > kShortened * length) break;
    length = shorter;
    if (std::chrono::steady_clock::now() > limits.deadline) break;
  }
  simplifier.reduceVertices(path, kSteps, kSteps, 1.0);
}

}  // namespace

std::optional<Eigen::MatrixXd> query_path(const ConfigurationSpace& space,
                                          const Eigen::VectorXd& start, const PathQuery& query,
                                          const QueryLimits& limits) {
  if (query.ends.empty()) return std::nullopt;
  const std::scoped_lock guard(ompl_lock());
  const SilentOmpl silent;
  // Every generator created from here on takes its seed from this one. OMPL's warning that numbers were drawn before
  // concerns existing generators; none of ours outlives a query.
  ompl::RNG::setSeed(query.seed == 0 ? 1 : query.seed);

  const auto& information = space.information();
  auto definition = std::make_shared<ob::ProblemDefinition>(information);
  ob::ScopedState<> state(information);
  space.write(start, state.get());
  definition->addStartState(state);
  auto goal = std::make_shared<ob::GoalStates>(information);
  for (const Eigen::VectorXd& end : query.ends) {
    space.write(end, state.get());
    goal->addState(state.get());
  }
  definition->setGoal(goal);
  definition->setOptimizationObjective(
      std::make_shared<ob::PathLengthOptimizationObjective>(information));

  const auto solver = std::make_shared<og::RRTConnect>(information);
  solver->setProblemDefinition(definition);
  solver->setup();
  int iteration = 0;
  const ob::PlannerTerminationCondition stop([&] {
    const bool late = std::chrono::steady_clock::now() > limits.deadline;
    if (late && limits.late) *limits.late = true;
    return ++iteration > limits.iterations || late;
  });
  const ob::PlannerStatus status = solver->solve(stop);
  if (status != ob::PlannerStatus::EXACT_SOLUTION) return std::nullopt;

  auto path = std::static_pointer_cast<og::PathGeometric>(definition->getSolutionPath());
  og::PathSimplifier simplifier(information);
  shorten(simplifier, *path, limits);
  Eigen::MatrixXd rows = space.rows(*path);
  rows.row(0) = start;
  // Scaling rounds the coordinates, so the end is replaced by the exact goal configuration.
  Eigen::Index nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t e = 0; e < query.ends.size(); ++e) {
    const double d = (rows.bottomRows(1).transpose() - query.ends[e]).norm();
    if (d < least) {
      least = d;
      nearest = static_cast<Eigen::Index>(e);
    }
  }
  rows.bottomRows(1) = query.ends[static_cast<std::size_t>(nearest)].transpose();
  return rows;
}

}  // namespace sparflow
