// The reported energy does not depend on the smoothing of the law, and creeping under the smoothed activation saves
// nothing.
#include <gtest/gtest.h>

#include <cmath>

#include "optimizer/solve/optimize.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

struct Slow {
  MotionProblem problem;
  CraneModel model;
  std::vector<SeedMotion> seeds;
  OptimizeOptions options;
  Slow()
      : problem(load_problem(bundled_file("reaches/loader_crane_lift.yaml"))),
        model(test_support::synthetic_model(problem.machine)) {
    problem.duration = {40.0, 40.0};  // long enough for creeping
    Eigen::VectorXd end = problem.start;
    EXPECT_TRUE(solve_end_posture(problem.machine, problem.limits,
                                  std::get<TipGoal>(problem.goal).tip, {true, true, true}, end));
    Eigen::MatrixXd line(2, 3);
    line << problem.start.transpose(), end.transpose();
    const TimedMotion timed = time_parametrise(problem, line, 0.0);
    seeds.push_back({"line", timed.motion, timed.shortest, true});
    options.intervals = options.search_intervals = 40;
    options.processes = 1;
    options.sequential_starts = 2;
    options.grid_starts = 0;
    options.sequence_rounds = 0;
    options.mesh_error = 1.0;
  }
  /// The law smoothed, at a given blending speed, integrated over a motion. [J]
  double smoothed_energy(const Trajectory& motion, double speed) const {
    CraneKnotOptions knot;
    knot.smoothing = {speed, 0.3e5};
    CraneKnotModel law(model, problem, knot);
    const Trajectory fine = motion.refined(16);
    double sum = 0.0, before = 0.0;
    Eigen::VectorXd z(law.size());
    for (Eigen::Index k = 0; k < fine.size(); ++k) {
      z << fine.q.row(k).transpose(), fine.qd.row(k).transpose();
      const double power = 1e3 * law.cost(z.data());
      if (k > 0) sum += 0.5 * (fine.t[k] - fine.t[k - 1]) * (power + before);
      before = power;
    }
    return sum;
  }
};

TEST(NoLoophole, EnergiesDoNotChangeWithTheSmoothing) {
  Slow s;
  double least = 1e300, most = 0.0;
  for (const double speed : {50e-3, 20e-3, 5e-3}) {
    for (const double pressure : {0.1e5, 0.3e5, 1e5}) {
      s.options.schedule = {{speed, 10e5}};
      s.options.pressure_in_modes = pressure;
      const OptimizeResult r = optimize(s.model, s.problem, s.seeds, s.options);
      ASSERT_EQ(r.status, OptimizeStatus::kOptimal) << r.message;
      least = std::min(least, r.energy.total);
      most = std::max(most, r.energy.total);
    }
  }
  // The tolerance is the change of the optimum when the maximum is smoothed by 1 bar more, of some 60 bar.
  EXPECT_LT(most, 1.005 * least);
}

TEST(NoLoophole, CreepingGainsNothing) {
  // The cheapest motion under a wide activation creeps. By the exact law it costs more than the reported motion, whose
  // smooth and exact energies agree.
  Slow s;
  constexpr double kWide = 50e-3;
  OptimizeOptions smooth = s.options;
  smooth.modes = false;
  smooth.schedule = {{kWide, 0.3e5}};
  smooth.smooth_iterations = 600;
  const OptimizeResult creeping = optimize(s.model, s.problem, s.seeds, smooth);
  ASSERT_GT(creeping.motion.size(), 1) << creeping.message;
  const OptimizeResult found = optimize(s.model, s.problem, s.seeds, s.options);
  ASSERT_EQ(found.status, OptimizeStatus::kOptimal) << found.message;
  const double looks = s.smoothed_energy(creeping.motion, kWide);
  EXPECT_LT(looks, 0.7 * creeping.energy.total)
      << "the smooth law must be exploitable for this test";
  EXPECT_LT(looks, 0.9 * found.energy.total) << "and the exploit must look cheaper than the result";
  EXPECT_GT(creeping.energy.total, found.energy.total);
  EXPECT_NEAR(found.energy_smooth, found.energy.total, 0.02 * found.energy.total);
}

}  // namespace
}  // namespace sparflow
