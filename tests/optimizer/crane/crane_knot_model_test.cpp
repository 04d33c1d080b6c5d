// Exact derivatives of power, limits and goal in joint space against finite differences, for every bundled
// machine: all linkage types, telescopes, moving masses, several pumps, negative dx/dq, no hydraulics.
#include "optimizer/crane/crane_knot_model.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "models/files/machine_file.h"
#include "optimizer/nlp/derivative_check.h"
#include "optimizer/transcription/transcription.h"
#include "problems/bundled.h"
#include "tests/optimizer/knot_support.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

using test_support::machine_files;
using test_support::numeric_gradient;
using test_support::problem_for;
using test_support::random_state;

class EveryMachine : public ::testing::TestWithParam<std::string> {
 protected:
  EveryMachine()
      : model_(
            test_support::synthetic_model(load_machine(bundled_file("machines/" + GetParam())))) {}
  CraneModel model_;
};

TEST_P(EveryMachine, CostDerivativesMatchFiniteDifferences) {
  const MotionProblem problem = problem_for(model_.machine, 3);
  CraneKnotOptions options;
  options.smoothing = {5e-3, 4e5};
  CraneKnotModel knot(model_, problem, options);
  std::mt19937 random(11);
  const int size = knot.size();
  for (int trial = 0; trial < 20; ++trial) {
    const Vector z = random_state(model_.machine, random);
    Vector gradient(size);
    Matrix hessian(size, size);
    const double value = knot.cost_derivatives(z.data(), gradient.data(), hessian.data());
    ASSERT_NEAR(value, knot.cost(z.data()), 1e-12 * std::max(1.0, std::abs(value)));
    // h = 2e-5: truncation h^4 f'''''/30 with length scale 5 mm/s (blend) stays below 1e-6 of the slope,
    // rounding 1e-16/h below 1e-10.
    const double h = 2e-5;
    const Vector numeric =
        numeric_gradient([&](const Vector& x) { return knot.cost(x.data()); }, z, h);
    const double scale = std::max(1.0, gradient.cwiseAbs().maxCoeff());
    EXPECT_LT((gradient - numeric).cwiseAbs().maxCoeff(), 1e-6 * scale) << "trial " << trial;
    const double hessian_scale = std::max(1.0, hessian.cwiseAbs().maxCoeff());
    for (int i = 0; i < size; ++i) {
      const Vector row = numeric_gradient(
          [&](const Vector& x) {
            Vector g(size);
            Matrix unused(size, size);
            knot.cost_derivatives(x.data(), g.data(), unused.data());
            return g[i];
          },
          z, h);
      EXPECT_LT((hessian.row(i).transpose() - row).cwiseAbs().maxCoeff(), 1e-6 * hessian_scale)
          << "row " << i;
    }
    EXPECT_LT((hessian - hessian.transpose()).cwiseAbs().maxCoeff(), 1e-10 * hessian_scale);
  }
}

TEST_P(EveryMachine, PathDerivativesMatchFiniteDifferences) {
  const MotionProblem problem = problem_for(model_.machine, 5);
  CraneKnotOptions options;
  options.smoothing = {5e-3, 4e5};
  options.limit_pressure = true;
  CraneKnotModel knot(model_, problem, options);
  const int rows = knot.path_count(), size = knot.size();
  if (!model_.machine.pumps.empty()) {
    ASSERT_GT(rows, 3);
  }
  std::mt19937 random(29);
  for (int trial = 0; trial < 5; ++trial) {
    const Vector z = random_state(model_.machine, random);
    Vector g(rows), again(rows);
    Matrix jacobian_t(size, rows);  // column r = row r of the row-major Jacobian
    knot.path_jacobian(z.data(), g.data(), jacobian_t.data());
    knot.path(z.data(), again.data());
    ASSERT_LT((g - again).cwiseAbs().maxCoeff(), 1e-12 * std::max(1.0, g.cwiseAbs().maxCoeff()));
    Vector multiplier = Vector::Random(rows);
    Matrix hessian = Matrix::Zero(size, size);
    knot.add_path_hessian(z.data(), multiplier.data(), hessian.data());
    const double h = 2e-5;
    for (int r = 0; r < rows; ++r) {
      const Vector numeric = numeric_gradient(
          [&](const Vector& x) {
            Vector v(rows);
            knot.path(x.data(), v.data());
            return v[r];
          },
          z, h);
      const double scale = std::max(1.0, jacobian_t.col(r).cwiseAbs().maxCoeff());
      EXPECT_LT((jacobian_t.col(r) - numeric).cwiseAbs().maxCoeff(), 1e-6 * scale)
          << knot.path_name(r);
      if (!knot.path_uses_velocity(r)) {
        EXPECT_EQ(jacobian_t.col(r).tail(size / 2).cwiseAbs().maxCoeff(), 0.0) << knot.path_name(r);
      }
    }
    const double scale = std::max(1.0, hessian.cwiseAbs().maxCoeff());
    for (int i = 0; i < size; ++i) {
      const Vector numeric = numeric_gradient(
          [&](const Vector& x) {
            Vector v(rows);
            Matrix j(size, rows);
            knot.path_jacobian(x.data(), v.data(), j.data());
            return (j * multiplier)[i];
          },
          z, h);
      EXPECT_LT((hessian.row(i).transpose() - numeric).cwiseAbs().maxCoeff(), 1e-6 * scale)
          << "row " << i;
    }
  }
}

TEST_P(EveryMachine, GoalDerivativesMatchFiniteDifferences) {
  const MotionProblem problem = problem_for(model_.machine, 7);
  TipAtGoal goal(model_.machine, std::get<TipGoal>(problem.goal).tip);
  const int n = model_.machine.joint_count(), rows = goal.count();
  ASSERT_GE(rows, 1);
  const Vector goal_tip = std::get<TipGoal>(problem.goal).tip;
  Vector at_goal(rows);
  goal.bounds(at_goal.data(), at_goal.data());
  for (int r = 0; r < rows; ++r) {  // each row is named after the coordinate it constrains
    const std::string name = goal.name(r);
    const std::size_t axis = std::string("xyz").find(name[0]);
    if (name.substr(1, 11) != " of the tip") {
      EXPECT_EQ(name.rfind("tip along (", 0), 0u) << name;
      continue;
    }
    ASSERT_LT(axis, 3u) << name;
    EXPECT_NEAR(at_goal[r], goal_tip[static_cast<Eigen::Index>(axis)], 1e-12) << name;
  }
  std::mt19937 random(31);
  const Vector q = random_state(model_.machine, random).head(n);
  Matrix jacobian_t(n, rows);
  goal.jacobian(q.data(), jacobian_t.data());
  Vector multiplier = Vector::Random(rows);
  Matrix hessian = Matrix::Zero(n, n);
  goal.add_hessian(q.data(), multiplier.data(), hessian.data());
  for (int r = 0; r < rows; ++r) {
    const Vector numeric = numeric_gradient(
        [&](const Vector& x) {
          Vector v(rows);
          goal.value(x.data(), v.data());
          return v[r];
        },
        q, 1e-3);  // trigonometric functions: truncation h^4 = 1e-12
    EXPECT_LT((jacobian_t.col(r) - numeric).cwiseAbs().maxCoeff(), 1e-9);
  }
  for (int i = 0; i < n; ++i) {
    const Vector numeric = numeric_gradient(
        [&](const Vector& x) {
          Matrix j(n, rows);
          goal.jacobian(x.data(), j.data());
          return (j * multiplier)[i];
        },
        q, 1e-3);
    EXPECT_LT((hessian.row(i).transpose() - numeric).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST_P(EveryMachine, ModesAgreeWithTheExactLaw) {
  // With the true modes fixed there is no blending; only the smoothed maximum differs, by beta log(n+1) at most.
  const MotionProblem problem = problem_for(model_.machine, 9);
  CraneKnotOptions options;
  options.smoothing = {2e-3, 1e3};  // 0.01 bar
  const int m = model_.machine.cylinder_count(), n = model_.machine.joint_count();
  std::mt19937 random(37);
  Chain chain(model_);
  for (int trial = 0; trial < 20; ++trial) {
    Vector z = random_state(model_.machine, random);
    z[n + trial % n] = 0.0;
    const MachineState& exact = chain.evaluate({z.data(), z.data() + n}, problem.payload);
    options.modes = ModeTable::Constant(1, m, CylinderMode::kRest);
    double flow = 0.0;
    for (int c = 0; c < m; ++c) {
      const CylinderState& s = exact.cylinders[static_cast<std::size_t>(c)];
      if (s.moving)
        options.modes(0, c) = s.speed > 0.0 ? CylinderMode::kExtend : CylinderMode::kRetract;
      flow += s.flow;
    }
    CraneKnotModel knot(model_, problem, options);
    knot.begin_node(0, 0);
    const double tolerance = 1e3 * std::log(m + 1.0) * flow / 1e3 + 1e-12;  // [kW]
    EXPECT_NEAR(knot.cost(z.data()), exact.power / 1e3, tolerance);
    EXPECT_GE(knot.cost(z.data()), exact.power / 1e3 - 1e-12);
  }
}

TEST_P(EveryMachine, WholeEnergyOfATrajectoryMatchesFiniteDifferences) {
  // The energy integral of the NLP: every knot's posture and speed, all limits, the goal; without modes and with fixed
  // modes that change at a knot (which has two one-sided laws).
  const MotionProblem problem = problem_for(model_.machine, 13);
  const int n = model_.machine.joint_count(), m = model_.machine.cylinder_count(), intervals = 5;
  std::mt19937 random(41);
  for (const bool held : {false, true}) {
    CraneKnotOptions options;
    options.smoothing = {5e-3, 4e5};
    options.limit_pressure = true;
    if (held) {
      options.modes = ModeTable::Constant(intervals, m, CylinderMode::kExtend);
      options.modes.bottomRows(2).setConstant(CylinderMode::kRetract);
      options.modes.col(0).topRows(2).setConstant(CylinderMode::kRest);
    }
    TranscriptionSpec spec;
    spec.t = (Vector(6) << 0.0, 0.2, 0.5, 0.7, 1.1, 1.2).finished();
    spec.knot = std::make_shared<CraneKnotModel>(model_, problem, options);
    spec.terminal =
        std::make_shared<TipAtGoal>(model_.machine, std::get<TipGoal>(problem.goal).tip);
    const Vector wide = Vector::Constant(n, 100.0);
    spec.bounds =
        TranscriptionBounds::uniform(intervals, {-wide, wide}, {-wide, wide}, {-wide, wide});
    spec.acceleration_weight = Vector::Constant(n, 1e-3);
    Transcription transcription(spec);
    Vector x(transcription.size().variables);
    for (int k = 0; k <= intervals; ++k) {
      const Vector z = random_state(model_.machine, random);
      for (int j = 0; j < n; ++j) {
        x[transcription.q_index(k, j)] = z[j];
        x[transcription.qd_index(k, j)] = z[n + j];
        if (k < intervals) x[transcription.qdd_index(k, j)] = 0.3 * z[n + j];
      }
    }
    // step: truncation h^4 over the 5 mm/s blend stays under 1e-6, as above
    const DerivativeCheck check = check_derivatives(transcription, x, 2e-5);
    EXPECT_LT(check.gradient_error, 1e-6) << check.worst_gradient << (held ? "modes held" : "free");
    EXPECT_LT(check.jacobian_error, 1e-6) << check.worst_jacobian << (held ? "modes held" : "free");
    EXPECT_LT(check.hessian_error, 1e-6) << check.worst_hessian << (held ? "modes held" : "free");
  }
}

INSTANTIATE_TEST_SUITE_P(Bundled, EveryMachine, ::testing::ValuesIn(machine_files()),
                         test_support::machine_test_name);

}  // namespace
}  // namespace sparflow
