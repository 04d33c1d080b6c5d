#include "optimizer/transcription/transcription.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "optimizer/nlp/derivative_check.h"
#include "optimizer/nlp/ipopt_solver.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// A model without cost, so that only the acceleration term remains.
class Nothing final : public KnotModel {
 public:
  explicit Nothing(int joints) : joints_(joints) {}
  int joint_count() const override { return joints_; }
  double cost(const double*) override { return 0.0; }
  double cost_derivatives(const double*, double* gradient, double* hessian) override {
    std::fill(gradient, gradient + size(), 0.0);
    std::fill(hessian, hessian + size() * size(), 0.0);
    return 0.0;
  }

 private:
  int joints_;
};

/// Two coupled joints with derivatives by hand. With s the law of the interval (1, or 2 for odd ones if `laws`):
///   c  = s (1 + q0^2) qd0^2 + q1 qd0 qd1 [+ qdd0^2 q1 + qd1 qdd1]
///   g0 = q0^2 qd1 [+ q1 qdd0^2]      g1 = q0 q1^2 (positions only)
class Coupled final : public KnotModel {
 public:
  Coupled(bool acceleration, bool laws) : acceleration_(acceleration), laws_(laws) {}
  int joint_count() const override { return 2; }
  bool uses_acceleration() const override { return acceleration_; }
  void begin_node(int, int interval) override { law_ = laws_ && interval % 2 == 1 ? 2.0 : 1.0; }
  bool split_at(int) const override { return laws_; }

  double cost(const double* z) override {
    double c = law_ * (1.0 + z[0] * z[0]) * z[2] * z[2] + z[1] * z[2] * z[3];
    if (acceleration_) c += z[4] * z[4] * z[1] + z[3] * z[5];
    return c;
  }
  double cost_derivatives(const double* z, double* gradient, double* hessian) override {
    Eigen::Map<VectorXd> g(gradient, size());
    Eigen::Map<MatrixXd> h(hessian, size(), size());
    g.setZero();
    h.setZero();
    const auto both = [&](int r, int c, double v) { h(r, c) = h(c, r) = v; };
    g[0] = 2.0 * law_ * z[0] * z[2] * z[2];
    g[1] = z[2] * z[3];
    g[2] = 2.0 * law_ * (1.0 + z[0] * z[0]) * z[2] + z[1] * z[3];
    g[3] = z[1] * z[2];
    both(0, 0, 2.0 * law_ * z[2] * z[2]);
    both(2, 0, 4.0 * law_ * z[0] * z[2]);
    both(2, 1, z[3]);
    both(3, 1, z[2]);
    both(2, 2, 2.0 * law_ * (1.0 + z[0] * z[0]));
    both(3, 2, z[1]);
    if (acceleration_) {
      g[1] += z[4] * z[4];
      g[3] += z[5];
      g[4] = 2.0 * z[4] * z[1];
      g[5] = z[3];
      both(4, 1, 2.0 * z[4]);
      both(4, 4, 2.0 * z[1]);
      both(5, 3, 1.0);
    }
    return cost(z);
  }
  int path_count() const override { return 2; }
  void path_bounds(double* lower, double* upper) const override {
    lower[0] = -kNoBound;
    upper[0] = 1.5;
    lower[1] = -2.0;
    upper[1] = 2.5;
  }
  bool path_uses_velocity(int row) const override { return row == 0; }
  bool path_uses_acceleration(int row) const override { return acceleration_ && row == 0; }
  std::string path_name(int row) const override { return row == 0 ? "swirl" : "height"; }
  void path(const double* z, double* g) override {
    g[0] = z[0] * z[0] * z[3] + (acceleration_ ? z[1] * z[4] * z[4] : 0.0);
    g[1] = z[0] * z[1] * z[1];
  }
  void path_jacobian(const double* z, double* g, double* jacobian) override {
    path(z, g);
    std::fill(jacobian, jacobian + 2 * size(), 0.0);
    jacobian[0] = 2.0 * z[0] * z[3];
    jacobian[3] = z[0] * z[0];
    if (acceleration_) {
      jacobian[1] = z[4] * z[4];
      jacobian[4] = 2.0 * z[1] * z[4];
    }
    jacobian[size()] = z[1] * z[1];
    jacobian[size() + 1] = 2.0 * z[0] * z[1];
  }
  void add_path_hessian(const double* z, const double* m, double* hessian) override {
    Eigen::Map<MatrixXd> h(hessian, size(), size());
    const auto both = [&](int r, int c, double v) {
      h(r, c) += v;
      if (r != c) h(c, r) += v;
    };
    both(0, 0, m[0] * 2.0 * z[3]);
    both(3, 0, m[0] * 2.0 * z[0]);
    if (acceleration_) {
      both(4, 1, m[0] * 2.0 * z[4]);
      both(4, 4, m[0] * 2.0 * z[1]);
    }
    both(1, 0, m[1] * 2.0 * z[1]);
    both(1, 1, m[1] * 2.0 * z[0]);
  }

 private:
  bool acceleration_, laws_;
  double law_ = 1.0;
};

/// q0 q1^2 = 1
class Product final : public TerminalModel {
 public:
  int count() const override { return 1; }
  void bounds(double* lower, double* upper) const override { lower[0] = upper[0] = 1.0; }
  void value(const double* q, double* g) override { g[0] = q[0] * q[1] * q[1]; }
  void jacobian(const double* q, double* j) override {
    j[0] = q[1] * q[1];
    j[1] = 2.0 * q[0] * q[1];
  }
  void add_hessian(const double* q, const double* m, double* h) override {
    h[1] += m[0] * 2.0 * q[1];
    h[2] += m[0] * 2.0 * q[1];
    h[3] += m[0] * 2.0 * q[0];
  }
};

TranscriptionBounds wide(int intervals, int joints) {
  const VectorXd ten = VectorXd::Constant(joints, 10.0);
  return TranscriptionBounds::uniform(intervals, {-ten, ten}, {-ten, ten}, {-ten, ten});
}

VectorXd uneven_times() {
  VectorXd t(7);
  t << 0.5, 0.6, 0.9, 1.4, 1.5, 2.3, 2.6;
  return t;
}

Transcription coupled(bool acceleration, bool laws, bool free_times = false) {
  TranscriptionSpec spec;
  spec.t = uneven_times();
  spec.knot = std::make_shared<Coupled>(acceleration, laws);
  spec.terminal = std::make_shared<Product>();
  spec.bounds = wide(6, 2);
  spec.acceleration_weight = Vector2d(0.3, 0.05);
  spec.joint_names = {"boom", "jib"};
  if (free_times) {
    spec.phases.of_interval = {0, 0, 1, 1, 1, 2};
    spec.phases.lower = VectorXd::Constant(3, 0.1);
    spec.phases.upper = VectorXd::Constant(3, 2.0);
    spec.phases.total_upper = 3.0;
    spec.phases.price = 0.7;
    spec.waypoints = {{2, std::make_shared<Product>()}};
  }
  return Transcription(std::move(spec));
}

VectorXd random_point(const NlpProblem& problem, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  VectorXd x(problem.size().variables);
  for (double& v : x) v = value(generator);
  return x;
}

struct Variant {
  bool acceleration, laws, free_times = false;
};
class EveryVariant : public testing::TestWithParam<Variant> {};

TEST_P(EveryVariant, DerivativesMatchDifferencesOnAnUnevenMesh) {
  Transcription problem = coupled(GetParam().acceleration, GetParam().laws, GetParam().free_times);
  for (unsigned seed : {1u, 2u}) {
    const DerivativeCheck check = check_derivatives(problem, random_point(problem, seed));
    // All functions are polynomials of degree <= 4, for which the extrapolated difference is exact: what is
    // left is rounding, 1e-16 / 1e-3 on values of order 10.
    EXPECT_LT(check.gradient_error, 1e-10) << check.worst_gradient;
    EXPECT_LT(check.jacobian_error, 1e-10) << check.worst_jacobian;
    EXPECT_LT(check.hessian_error, 1e-10) << check.worst_hessian;
  }
}

TEST_P(EveryVariant, ObjectiveIsTheTrapezoidWrittenOut) {
  Transcription problem = coupled(GetParam().acceleration, GetParam().laws, GetParam().free_times);
  Coupled model(GetParam().acceleration, GetParam().laws);
  const VectorXd x = random_point(problem, 3);
  const Trajectory motion = problem.trajectory(x);
  double expected = 0.0;
  for (int k = 0; k < 6; ++k) {
    const double h = motion.t[k + 1] - motion.t[k];
    for (int end : {k, k + 1}) {
      VectorXd z(6);
      z << motion.q.row(end).transpose(), motion.qd.row(end).transpose(),
          motion.qdd.row(k).transpose();
      model.begin_node(end, k);
      expected += 0.5 * h * model.cost(z.data());
    }
    expected += h * (0.3 * std::pow(motion.qdd(k, 0), 2) + 0.05 * std::pow(motion.qdd(k, 1), 2));
  }
  if (GetParam().free_times) expected += 0.7 * motion.duration();
  // The sums differ in order only: a few units in the last place of terms of order 1.
  EXPECT_NEAR(problem.objective(x), expected, 1e-13);
}

TEST_P(EveryVariant, EntriesOfTheHessianAreUniqueAndLower) {
  Transcription problem = coupled(GetParam().acceleration, GetParam().laws, GetParam().free_times);
  Eigen::VectorXi row(problem.size().hessian_nonzeros), column(row.size());
  problem.hessian_structure(row, column);
  std::set<std::pair<int, int>> places;
  for (int i = 0; i < row.size(); ++i) {
    EXPECT_GE(row[i], column[i]);
    EXPECT_TRUE(places.emplace(row[i], column[i]).second) << row[i] << "," << column[i];
  }
}

TEST_P(EveryVariant, ResultsDoNotDependOnTheOrderOfTheCalls) {
  const bool times = GetParam().free_times;
  const VectorXd a = random_point(coupled(false, false, times), 4),
                 b = random_point(coupled(false, false, times), 5);
  Transcription used = coupled(GetParam().acceleration, GetParam().laws, GetParam().free_times);
  VectorXd g(used.size().constraints), jacobian(used.size().jacobian_nonzeros);
  VectorXd hessian(used.size().hessian_nonzeros);
  const VectorXd multiplier = VectorXd::LinSpaced(g.size(), -1.0, 1.0);
  used.objective(a);
  used.jacobian(b, jacobian);
  used.constraints(a, g);
  used.hessian(a, 0.5, multiplier, hessian);
  used.objective(b);
  Transcription fresh = coupled(GetParam().acceleration, GetParam().laws, GetParam().free_times);
  VectorXd g2 = g, jacobian2 = jacobian, hessian2 = hessian;
  fresh.hessian(a, 0.5, multiplier, hessian2);
  EXPECT_EQ(hessian, hessian2);
  fresh.jacobian(b, jacobian2);
  EXPECT_EQ(jacobian, jacobian2);
  fresh.constraints(a, g2);
  EXPECT_EQ(g, g2);
  EXPECT_EQ(used.objective(a), fresh.objective(a));
}

INSTANTIATE_TEST_SUITE_P(Transcription, EveryVariant,
                         testing::Values(Variant{false, false}, Variant{false, true},
                                         Variant{true, false}, Variant{true, true},
                                         Variant{false, false, true}, Variant{false, true, true},
                                         Variant{true, true, true}));

TEST(Transcription, FreeTimesKeepSharesAndHaveNames) {
  Transcription problem = coupled(false, true, true);
  VectorXd x = random_point(problem, 3);
  x.tail(3) << 0.8, 2.4, 0.6;
  const Trajectory motion = problem.trajectory(x);
  // the mesh is 0.5 0.6 | 0.9 | 1.4 1.5 | 2.3 | 2.6: phase 0 had 0.1 and 0.3 s, phase 1 0.5, 0.1 and 0.8
  EXPECT_NEAR(motion.t[1], 0.5 + 0.8 * 0.25, 1e-14);
  EXPECT_NEAR(motion.t[3], 0.5 + 0.8 + 2.4 * 0.5 / 1.4, 1e-14);
  EXPECT_NEAR(motion.duration(), 3.8, 1e-14);
  EXPECT_EQ(problem.variable_name(problem.tau_index(1)), "duration of phase 1");
  EXPECT_EQ(problem.constraint_name(problem.size().constraints - 1), "total duration");
  VectorXd g(problem.size().constraints);
  problem.constraints(x, g);
  EXPECT_NEAR(g[g.size() - 1], 3.8, 1e-14);
}

TEST(Transcription, RowsAndLayoutAreAsDocumented) {
  Transcription plain = coupled(false, false);
  EXPECT_EQ(plain.size().variables, 2 * (7 + 7 + 6));
  EXPECT_EQ(plain.size().constraints, 2 * 6 * 2 + 1 + 2 * 7);
  EXPECT_EQ(plain.q_index(3, 1), 7);
  EXPECT_EQ(plain.qd_index(0, 0), 14);
  EXPECT_EQ(plain.qdd_index(0, 0), 28);
  EXPECT_EQ(plain.variable_name(7), "q[jib] at t = 1.4 s");
  EXPECT_EQ(plain.variable_name(29), "qdd[jib] after t = 0.5 s");
  EXPECT_EQ(plain.constraint_name(0), "position defect of boom after t = 0.5 s");
  EXPECT_EQ(plain.constraint_name(12 + 3), "velocity defect of jib after t = 0.6 s");
  EXPECT_EQ(plain.constraint_name(24), "goal row 0");
  EXPECT_EQ(plain.constraint_name(25 + 3), "height at t = 0.6 s");
  // With acceleration: "swirl" at both ends of 6 intervals, "height" once at each of 7 knots.
  Transcription full = coupled(true, false);
  EXPECT_EQ(full.size().constraints, 2 * 6 * 2 + 1 + 2 * 6 + 7);
}

TEST(Transcription, MotionOfConstantAccelerationsHasNoDefect) {
  Transcription problem = coupled(false, false);
  Trajectory motion;
  motion.t = uneven_times();
  motion.q = motion.qd = motion.qdd = MatrixXd::Zero(7, 2);
  motion.q.row(0) << 0.3, -0.2;
  motion.qd.row(0) << -0.4, 0.9;
  for (int k = 0; k < 6; ++k) {
    const double h = motion.t[k + 1] - motion.t[k];
    motion.qdd.row(k) << std::sin(3.0 * k), 1.0 - 0.4 * k;
    motion.qd.row(k + 1) = motion.qd.row(k) + h * motion.qdd.row(k);
    motion.q.row(k + 1) = motion.q.row(k) + h * motion.qd.row(k) + 0.5 * h * h * motion.qdd.row(k);
  }
  motion.qdd.row(6) = motion.qdd.row(5);
  const VectorXd x = problem.variables(motion);
  VectorXd g(problem.size().constraints);
  problem.constraints(x, g);
  EXPECT_LT(g.head(24).cwiseAbs().maxCoeff(), 1e-14);  // the scheme is exact for such motions
  const Trajectory back = problem.trajectory(x);
  EXPECT_LT((back.q - motion.q).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((back.qdd - motion.qdd).cwiseAbs().maxCoeff(), 1e-13);
  // Sampled 5 times finer, it is the trajectory's own exact refinement.
  const Trajectory fine = motion.refined(5);
  const Trajectory sampled = resampled(motion, fine.t);
  EXPECT_LT((fine.q - sampled.q).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((fine.qd - sampled.qd).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Transcription, MotionRestsOutsideItsTimeAndCanBeStretched) {
  Trajectory motion;
  motion.t = VectorXd::LinSpaced(3, 1.0, 3.0);
  motion.q = (MatrixXd(3, 1) << 0.0, 0.5, 1.0).finished();
  motion.qd = (MatrixXd(3, 1) << 0.0, 1.0, 0.0).finished();
  motion.qdd = (MatrixXd(3, 1) << 1.0, -1.0, -1.0).finished();
  const Trajectory around = resampled(motion, VectorXd::LinSpaced(5, 0.0, 4.0));
  EXPECT_EQ(around.q(0, 0), 0.0);
  EXPECT_EQ(around.q(4, 0), 1.0);
  EXPECT_EQ(around.qd(4, 0), 0.0);
  const Trajectory slow = with_duration(motion, 4.0);
  EXPECT_EQ(slow.t[0], 1.0);
  EXPECT_EQ(slow.t[2], 5.0);
  EXPECT_EQ(slow.qd(1, 0), 0.5);
  EXPECT_EQ(slow.qdd(0, 0), 0.25);
  EXPECT_EQ(resampled(slow, VectorXd::Constant(1, 3.0)).q(0, 0), 0.5) << "the same path";
}

/// From rest at 0 to rest at `distance`, cost the integral of qdd^2.
Transcription rest_to_rest(const VectorXd& t, double distance, double most_acceleration) {
  const int intervals = static_cast<int>(t.size()) - 1;
  TranscriptionSpec spec;
  spec.t = t;
  spec.knot = std::make_shared<Nothing>(1);
  spec.bounds = wide(intervals, 1);
  spec.bounds.qdd_lower.setConstant(-most_acceleration);
  spec.bounds.qdd_upper.setConstant(most_acceleration);
  spec.bounds.rest_to_rest(VectorXd::Zero(1));
  spec.bounds.fix_q(intervals, VectorXd::Constant(1, distance));
  spec.acceleration_weight = VectorXd::Ones(1);
  return Transcription(std::move(spec));
}

TEST(Transcription, LeastAccelerationMotionHasItsClosedForm) {
  // Minimise sum h_k a_k^2 subject to sum h_k a_k = 0 and sum h_k a_k s_k = -d, s_k the interval's middle time
  // minus the h-weighted mean: a_k is proportional to s_k, so the optimum is d^2 / sum h_k s_k^2. For N equal steps
  // the sum is T^3 (1 - 1/N^2) / 12, so the energy is 12 d^2 / (T^3 (1 - 1/N^2)), -> 12 d^2/T^3.
  const double d = 1.7, T = 3.0;
  for (const int n : {4, 20, 100}) {
    Transcription problem = rest_to_rest(VectorXd::LinSpaced(n + 1, 0.0, T), d, 10.0);
    const NlpResult result = solve_with_ipopt(problem);
    ASSERT_EQ(result.status, NlpStatus::kOptimal) << result.brief();
    const double expected = 12.0 * d * d / (T * T * T * (1.0 - 1.0 / (n * n)));
    // Bounds are far away, so the barrier leaves at most its mu ~ 1e-7 in the objective.
    EXPECT_NEAR(result.objective, expected, 1e-6 * expected) << n;
  }
  const VectorXd t = uneven_times();
  const VectorXd h = t.tail(6) - t.head(6), middle = 0.5 * (t.tail(6) + t.head(6));
  const VectorXd s = middle.array() - h.dot(middle) / h.sum();
  Transcription problem = rest_to_rest(t, d, 10.0);
  const NlpResult result = solve_with_ipopt(problem);
  const double expected = d * d / h.dot(s.cwiseAbs2());
  EXPECT_NEAR(result.objective, expected, 1e-6 * expected);
  const Trajectory motion = problem.trajectory(result.x);
  EXPECT_NEAR(motion.qdd(2, 0) / motion.qdd(1, 0), s[2] / s[1], 1e-5)
      << "the shape must agree as well";
}

TEST(Transcription, ShortestTimeIsWhereFeasibilityEnds) {
  // |qdd| <= A from rest to rest over d: T_min = 2 sqrt(d / A), reached exactly on an even mesh.
  const double d = 1.7, A = 0.8, shortest = 2.0 * std::sqrt(d / A);
  Transcription ample = rest_to_rest(VectorXd::LinSpaced(21, 0.0, 1.001 * shortest), d, A);
  const NlpResult feasible = solve_with_ipopt(ample);
  ASSERT_TRUE(feasible.solved()) << feasible.brief();
  const Trajectory motion = ample.trajectory(feasible.x);
  EXPECT_GT(motion.qdd(2, 0), 0.98 * A) << "nearly bang-bang";
  EXPECT_LT(motion.qdd(17, 0), -0.98 * A) << "nearly bang-bang";
  Transcription tight = rest_to_rest(VectorXd::LinSpaced(21, 0.0, 0.99 * shortest), d, A);
  const NlpResult infeasible = solve_with_ipopt(tight);
  EXPECT_EQ(infeasible.status, NlpStatus::kInfeasible) << infeasible.brief();
  EXPECT_FALSE(infeasible.max_violation_at.empty());
}

Transcription three_joints(const TranscriptionBounds& bounds) {
  TranscriptionSpec spec;
  spec.t = VectorXd::LinSpaced(13, 0.0, 4.0);
  spec.knot = std::make_shared<Nothing>(3);
  spec.bounds = bounds;
  spec.acceleration_weight = VectorXd::Ones(3);
  return Transcription(std::move(spec));
}

TEST(Transcription, FrozenJointsDropTheirEmptyRows) {
  TranscriptionBounds bounds = wide(12, 3);
  bounds.rest_to_rest(VectorXd::Zero(3));
  for (MatrixXd* m : {&bounds.qd_lower, &bounds.qd_upper, &bounds.qdd_lower, &bounds.qdd_upper}) {
    m->rightCols(2).setZero();  // joints 1 and 2 are at rest all the time
  }
  bounds.q_lower(12, 0) = bounds.q_upper(12, 0) = 1.0;
  bounds.qd_lower.col(0).setZero();  // joint 0 never reverses
  Transcription problem = three_joints(bounds);
  // There are 36 position rows; of the 36 velocity rows the 24 of joints at rest have no free variable.
  EXPECT_EQ(problem.size().constraints, 36 + 12);
  const NlpResult result = solve_with_ipopt(problem);
  ASSERT_EQ(result.status, NlpStatus::kOptimal) << result.brief();
  const Trajectory motion = problem.trajectory(result.x);
  EXPECT_LT(motion.q.rightCols(2).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR(result.objective, 12.0 / (64.0 * (1.0 - 1.0 / 144.0)), 1e-6);
  // With all joints free again, multipliers by meaning survive the change of rows.
  const TranscriptionMultipliers multipliers = problem.multipliers(result.multipliers);
  EXPECT_EQ(multipliers.qd_defect.col(1).cwiseAbs().maxCoeff(), 0.0);
  TranscriptionBounds loose = wide(12, 3);
  loose.rest_to_rest(VectorXd::Zero(3));
  loose.fix_q(12, Eigen::Vector3d(1.0, 0.0, 0.0));
  Transcription free = three_joints(loose);
  free.set_start(result.x);
  free.set_start_multipliers(multipliers);
  ASSERT_NE(free.start_multipliers(), nullptr);
  EXPECT_EQ(free.start_multipliers()->constraint.size(), 72);
  const NlpResult warm = solve_with_ipopt(free);
  EXPECT_EQ(warm.status, NlpStatus::kOptimal) << warm.brief();
  EXPECT_NEAR(warm.objective, result.objective, 1e-6) << "the same motion is still the best";
}

TEST(Transcription, ContradictingFixedValuesStayAndAreInfeasible) {
  TranscriptionBounds bounds = wide(12, 3);
  bounds.rest_to_rest(VectorXd::Zero(3));
  for (int knot : {4, 5}) bounds.fix_qd(knot, VectorXd::Constant(3, 0.1 * knot));
  bounds.qdd_lower.row(4).setZero();
  bounds.qdd_upper.row(4).setZero();  // a change from 0.4 to 0.5 needs an acceleration
  Transcription problem = three_joints(bounds);
  EXPECT_EQ(problem.size().constraints, 72);
  const NlpResult result = solve_with_ipopt(problem);
  EXPECT_FALSE(result.solved()) << result.brief();
}

TEST(Transcription, StartIsClippedToItsBounds) {
  Transcription problem = rest_to_rest(VectorXd::LinSpaced(5, 0.0, 1.0), 0.2, 0.5);
  Trajectory motion;
  motion.t = Vector2d(0.0, 1.0);
  motion.q = Vector2d(-1.0, 30.0);
  motion.qd = Vector2d(31.0, 31.0);
  motion.qdd = Vector2d(0.0, 0.0);
  problem.set_start(motion);
  VectorXd x(problem.size().variables);
  problem.start(x);
  EXPECT_EQ(x[problem.q_index(0, 0)], 0.0) << "fixed";
  EXPECT_EQ(x[problem.qd_index(2, 0)], 10.0) << "limited";
}

TEST(Transcription, WrongShapesAreErrorsOfTheCaller) {
  TranscriptionSpec spec;
  spec.t = uneven_times();
  spec.knot = std::make_shared<Nothing>(1);
  spec.bounds = wide(5, 1);
  EXPECT_THROW(Transcription{spec}, std::logic_error) << "bounds of another mesh";
  spec.bounds = wide(6, 1);
  spec.t[3] = spec.t[2];
  EXPECT_THROW(Transcription{spec}, std::logic_error) << "two knots at one time";
}

}  // namespace
}  // namespace sparflow
