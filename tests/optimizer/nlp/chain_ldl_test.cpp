#include "optimizer/nlp/chain_ldl.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <random>
#include <string>

#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/nlp/ipopt_solver.h"
#include "optimizer/transcription/transcription.h"
#include "tests/optimizer/knot_support.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A symmetric matrix as triplets of its lower triangle and as a dense matrix.
struct Symmetric {
  explicit Symmetric(int order) : dense(MatrixXd::Zero(order, order)) {}
  void add(int i, int j, double v) {
    row.push_back(i);
    column.push_back(j);
    value.push_back(v);
    dense(i, j) += v;
    if (i != j) dense(j, i) += v;
  }
  std::vector<int> row, column;
  std::vector<double> value;
  MatrixXd dense;
};

struct ChainSize {
  int knots = 8, states = 3, rows = 2, border = 2;
};

/// KKT matrix of a chain as Ipopt poses it: [W + Sigma, slacks' Sigma, J^T; J, -delta]. Each knot has `states` positions
/// and controls, its dynamics and inequality rows with slacks; border variables enter all dynamics.
class ChainKkt {
 public:
  ChainKkt(const ChainSize& size, std::mt19937& random, double delta = 0.0, double barrier = 1.0)
      : size_(size), random_(random), barrier_(barrier), matrix_(order(size)) {
    const int n = size.states;
    for (int k = 0; k < size.knots; ++k) {
      for (int a = 0; a < 2 * n;
           ++a) {  // Hessian of one knot, indefinite, and the barrier's diagonal
        for (int b = 0; b <= a; ++b) matrix_.add(variable(k, a), variable(k, b), normal());
        matrix_.add(variable(k, a), variable(k, a), sigma());
      }
      for (int b = 0; b < size.border; ++b) matrix_.add(border(b), variable(k, 0), normal());
      for (int r = 0; r < size.rows; ++r) {
        matrix_.add(slack(k, r), slack(k, r), sigma());
        matrix_.add(inequality(k, r), slack(k, r), -1.0);
        for (int a = 0; a < 2 * n; ++a) matrix_.add(inequality(k, r), variable(k, a), normal());
        matrix_.add(inequality(k, r), inequality(k, r), -delta);
      }
      for (int i = 0; i < n && k + 1 < size.knots; ++i) {
        matrix_.add(dynamics(k, i), variable(k, i), -1.0);
        matrix_.add(dynamics(k, i), variable(k + 1, i), 1.0);
        matrix_.add(dynamics(k, i), variable(k, n + i), -0.1);
        for (int b = 0; b < size.border; ++b) matrix_.add(dynamics(k, i), border(b), normal());
        matrix_.add(dynamics(k, i), dynamics(k, i), -delta);
      }
    }
    for (int b = 0; b < size.border; ++b) matrix_.add(border(b), border(b), sigma());
  }
  Symmetric& matrix() { return matrix_; }
  int constraints() const { return size_.knots * size_.rows + (size_.knots - 1) * size_.states; }
  int variable(int k, int a) const { return k * 2 * size_.states + a; }
  int border(int b) const { return size_.knots * 2 * size_.states + b; }
  int slack(int k, int r) const { return border(size_.border) + k * size_.rows + r; }
  int inequality(int k, int r) const { return slack(size_.knots, 0) + k * size_.rows + r; }
  int dynamics(int k, int i) const { return inequality(size_.knots, 0) + k * size_.states + i; }

 private:
  static int order(const ChainSize& s) {
    return s.knots * 2 * s.states + s.border + 2 * s.knots * s.rows + (s.knots - 1) * s.states;
  }
  double normal() { return std::normal_distribution<>(0.0, 1.0)(random_); }
  /// Barrier terms of the distance to a bound, over many decades.
  double sigma() {
    return barrier_ * std::pow(10.0, std::uniform_real_distribution<>(-8.0, 6.0)(random_));
  }

  ChainSize size_;
  std::mt19937& random_;
  double barrier_;
  Symmetric matrix_;
};

/// Negative eigenvalues of a matrix, and how far the nearest eigenvalue is from zero, after bringing all rows near one
/// (a congruence, which keeps the signs): without, eigenvalues of 1e-8 beside 1e6 would be rounding.
struct Inertia {
  int negative = 0;
  double nearest = 0.0;
};
Inertia inertia_of(MatrixXd a) {
  for (int sweep = 0; sweep < 8; ++sweep) {
    const VectorXd s = a.cwiseAbs().rowwise().maxCoeff().cwiseSqrt().cwiseInverse();
    a = s.asDiagonal() * a * s.asDiagonal();
  }
  const VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(a).eigenvalues();
  return {static_cast<int>((values.array() < 0.0).count()), values.cwiseAbs().minCoeff()};
}

ChainLdl analysed(const Symmetric& m) {
  return ChainLdl(static_cast<int>(m.dense.rows()), m.row, m.column, m.value.data());
}

/// Componentwise backward error, as LAPACK defines it: |b - A x| against |A| |x| + |b|.
double backward_error(const MatrixXd& a, const VectorXd& x, const VectorXd& b) {
  const VectorXd residual = (b - a * x).cwiseAbs();
  const VectorXd size = a.cwiseAbs() * x.cwiseAbs() + b.cwiseAbs();
  return residual.cwiseQuotient(size).maxCoeff();
}

TEST(ChainLdl, InertiaAndSolutionOfRandomChains) {
  std::mt19937 random(1);
  int delayed = 0, pairs = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const ChainSize size{2 + trial % 11, 1 + trial % 4, trial % 3, trial % 4};
    ChainKkt kkt(size, random, trial % 2 == 0 ? 0.0 : 1e-8);
    const Symmetric& m = kkt.matrix();
    ChainLdl ldl = analysed(m);
    const Inertia truth = inertia_of(m.dense);
    // The signs of the dense eigenvalues are reliable only well above rounding.
    if (truth.nearest < 1e-11) continue;
    ASSERT_EQ(ldl.factorise(m.value.data(), 1e-4), LdlOutcome::kRegular) << trial;
    EXPECT_EQ(ldl.statistics().negative, truth.negative) << trial << " nearest " << truth.nearest;
    delayed += ldl.statistics().delayed;
    pairs += ldl.statistics().pairs;
    const VectorXd b = VectorXd::Random(m.dense.rows());
    VectorXd x = b;
    ldl.solve(x.data());
    // one step of refinement, as Ipopt takes at least one
    VectorXd r = b - m.dense * x;
    ldl.solve(r.data());
    x += r;
    EXPECT_LT(backward_error(m.dense, x, b), 1e-9) << trial;
  }
  // The samples must contain delayed pivots and pivots of two rows.
  EXPECT_GT(delayed, 0);
  EXPECT_GT(pairs, 0);
}

/// One row of the Jacobian is a sum of multiples of two others: of rank one less than it has rows.
void make_dependent(ChainKkt& kkt, int row, int first, int second, double share) {
  Symmetric& m = kkt.matrix();
  for (std::size_t e = 0; e < m.row.size(); ++e) {
    if (m.row[e] == row || m.column[e] == row) m.value[e] = 0.0;
  }
  const int entries = static_cast<int>(m.row.size());
  for (int e = 0; e < entries; ++e) {
    const auto k = static_cast<std::size_t>(e);
    for (const int from : {first, second}) {
      if (m.row[k] != from || m.column[k] == from) continue;
      const double value = from == first ? m.value[k] : share * m.value[k];
      const int column = m.column[k];
      m.row.push_back(row);
      m.column.push_back(column);
      m.value.push_back(value);
    }
  }
}

TEST(ChainLdl, DependentRowsAreSingularOrGiveTheWrongInertia) {
  std::mt19937 random(2);
  int singular = 0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    const ChainSize size{3 + trial % 9, 1 + trial % 3, 1 + trial % 2, trial % 3};
    ChainKkt kkt(size, random);
    make_dependent(kkt, kkt.dynamics(1, 0), kkt.dynamics(0, 0), kkt.dynamics(size.knots - 2, 0),
                   trial % 2 == 0 ? 0.0 : 0.7);
    const Symmetric& m = kkt.matrix();
    ChainLdl ldl(static_cast<int>(m.dense.rows()), m.row, m.column, m.value.data());
    const bool is_singular = ldl.factorise(m.value.data(), 1e-4) == LdlOutcome::kSingular;
    singular += is_singular ? 1 : 0;
    // A pivot that is zero but for rounding can have either sign.
    if (!is_singular) {
      EXPECT_GE(ldl.statistics().negative, 0);
    }
  }
  EXPECT_GE(singular, kTrials * 95 / 100);
}

TEST(ChainLdl, AMatrixThatCannotBeFactorisedIsSingular) {
  // An unknown without entries, a value that is NaN, and then regular values in the same object.
  const std::vector<int> row = {0, 1, 1, 2}, column = {0, 0, 1, 2};
  std::vector<double> value = {2.0, 1.0, -3.0, 0.0};
  ChainLdl ldl(3, row, column, value.data());
  EXPECT_EQ(ldl.factorise(value.data(), 1e-4), LdlOutcome::kSingular);
  value[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ldl.factorise(value.data(), 1e-4), LdlOutcome::kSingular);
  value[3] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ldl.factorise(value.data(), 1e-4), LdlOutcome::kSingular);
  value[3] = -4.0;
  ASSERT_EQ(ldl.factorise(value.data(), 1e-4), LdlOutcome::kRegular);
  EXPECT_EQ(ldl.statistics().negative, 2);
  VectorXd x(3);
  x << 3.0, -2.0, 8.0;  // of (1, 1, -2)
  ldl.solve(x.data());
  EXPECT_NEAR(x[0], 1.0, 1e-15);
  EXPECT_NEAR(x[1], 1.0, 1e-15);
  EXPECT_NEAR(x[2], -2.0, 1e-15);
}

TEST(ChainLdl, ValuesWithEqualIndicesAreAddedInEitherTriangle) {
  const std::vector<int> row = {0, 0, 1, 0, 1}, column = {0, 0, 0, 1, 1};
  const std::vector<double> value = {1.0, 2.0, 0.5, 1.5, 4.0};  // (3, 2; 2, 4)
  ChainLdl ldl(2, row, column, value.data());
  ASSERT_EQ(ldl.factorise(value.data(), 1e-4), LdlOutcome::kRegular);
  EXPECT_EQ(ldl.statistics().negative, 0);
  VectorXd x(2);
  x << 5.0, 6.0;
  ldl.solve(x.data());
  EXPECT_NEAR(x[0], 1.0, 1e-15);
  EXPECT_NEAR(x[1], 1.0, 1e-15);
}

TEST(ChainLdl, WorkGrowsWithTheChainAndFrontsDoNot) {
  std::mt19937 random(3);
  ChainKkt small({100, 3, 4, 3}, random), large({200, 3, 4, 3}, random);
  const LdlStatistics a = analysed(small.matrix()).statistics();
  const LdlStatistics b = analysed(large.matrix()).statistics();
  EXPECT_LT(b.multiply_adds, 2.3 * a.multiply_adds);
  EXPECT_LE(b.largest_front, a.largest_front + 12);
  // dense groups of 6 + 8 + 3 unknowns with 6 + 3 beside them: some 25 entries below each pivot at most
  EXPECT_LT(a.factor_entries, 25L * a.order);
}

TEST(ChainLdl, FactorsAreThoseOfTheValuesWhateverValuesWereAnalysed) {
  // The order is found with the first values; later ones may differ completely.
  std::mt19937 random(4);
  for (int trial = 0; trial < 40; ++trial) {
    const ChainSize size{6, 2, 2, 2};
    ChainKkt first(size, random, 0.0, 1.0), second(size, random, 0.0, 1e-6);
    ChainLdl ldl = analysed(first.matrix());
    const Symmetric& m = second.matrix();
    const Inertia truth = inertia_of(m.dense);
    if (truth.nearest < 1e-11) continue;
    ASSERT_EQ(ldl.factorise(m.value.data(), 1e-4), LdlOutcome::kRegular);
    EXPECT_EQ(ldl.statistics().negative, truth.negative) << trial;
  }
}

/// KKT matrix of a crane's motion with two phases of free duration, at a random point with random multipliers.
Symmetric crane_kkt(Transcription& nlp, std::mt19937& random, double delta) {
  const NlpSize size = nlp.size();
  VectorXd xl(size.variables), xu(size.variables), gl(size.constraints), gu(size.constraints);
  nlp.bounds(xl, xu, gl, gu);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  VectorXd x(size.variables), multiplier(size.constraints);
  for (int i = 0; i < size.variables; ++i)
    x[i] = xl[i] + (0.2 + 0.6 * unit(random)) * (xu[i] - xl[i]);
  for (double& v : multiplier) v = std::normal_distribution<>(0.0, 1.0)(random);
  VectorXd jacobian(size.jacobian_nonzeros), hessian(size.hessian_nonzeros);
  Eigen::VectorXi jr(size.jacobian_nonzeros), jc(size.jacobian_nonzeros);
  Eigen::VectorXi hr(size.hessian_nonzeros), hc(size.hessian_nonzeros);
  nlp.jacobian_structure(jr, jc);
  nlp.hessian_structure(hr, hc);
  nlp.jacobian(x, jacobian);
  nlp.hessian(x, 1.0, multiplier, hessian);
  int slacks = 0;
  for (int r = 0; r < size.constraints; ++r) slacks += gl[r] < gu[r] ? 1 : 0;
  Symmetric m(size.variables + slacks + size.constraints);
  const auto sigma = [&] { return std::pow(10.0, -8.0 + 12.0 * unit(random)); };
  for (int k = 0; k < size.hessian_nonzeros; ++k) m.add(hr[k], hc[k], hessian[k]);
  for (int i = 0; i < size.variables; ++i) m.add(i, i, sigma());
  const int rows = size.variables + slacks;
  for (int k = 0; k < size.jacobian_nonzeros; ++k) m.add(rows + jr[k], jc[k], jacobian[k]);
  int slack = size.variables;
  for (int r = 0; r < size.constraints; ++r) {
    m.add(rows + r, rows + r, -delta);
    if (!(gl[r] < gu[r])) continue;
    m.add(slack, slack, sigma());
    m.add(rows + r, slack++, -1.0);
  }
  return m;
}

TEST(ChainLdl, InertiaAndSolutionOfACranesMotion) {
  const CraneModel model =
      test_support::synthetic_model(load_machine(bundled_file("machines/loader_crane.yaml")));
  MotionProblem problem = test_support::problem_for(model.machine, 3);
  problem.obstacles.clear();
  TranscriptionSpec spec;
  const int intervals = 8, n = model.machine.joint_count();
  spec.t = VectorXd::LinSpaced(intervals + 1, 0.0, 8.0);
  spec.knot = std::make_shared<CraneKnotModel>(model, problem, CraneKnotOptions{});
  spec.phases.of_interval = {0, 0, 0, 0, 1, 1, 1, 1};
  spec.phases.lower = VectorXd::Constant(2, 1.0);
  spec.phases.upper = VectorXd::Constant(2, 7.0);
  spec.phases.total_upper = 8.0;
  const VectorXd one = VectorXd::Ones(n);
  spec.bounds = TranscriptionBounds::uniform(intervals, {0.5 * one, 0.9 * one},
                                             {-0.1 * one, 0.1 * one}, {-0.2 * one, 0.2 * one});
  spec.acceleration_weight = 1e-3 * one;
  Transcription nlp(std::move(spec));
  std::mt19937 random(5);
  for (const double delta : {0.0, 1e-8, 1e-4}) {
    for (int trial = 0; trial < 3; ++trial) {
      const Symmetric m = crane_kkt(nlp, random, delta);
      ChainLdl ldl = analysed(m);
      ASSERT_EQ(ldl.factorise(m.value.data(), 1e-4), LdlOutcome::kRegular);
      const Inertia truth = inertia_of(m.dense);
      ASSERT_GT(truth.nearest, 1e-13);
      EXPECT_EQ(ldl.statistics().negative, truth.negative) << "nearest " << truth.nearest;
      EXPECT_LT(ldl.statistics().largest_front, 40);
      const VectorXd b = VectorXd::Random(m.dense.rows());
      VectorXd x = b;
      ldl.solve(x.data());
      VectorXd r = b - m.dense * x;
      ldl.solve(r.data());
      x += r;
      EXPECT_LT(backward_error(m.dense, x, b), 1e-9);
    }
  }
}

/// Minimise 1/2 x^T Q x - sum x under one row with Q dense, which is no chain.
class Dense final : public NlpProblem {
 public:
  explicit Dense(int n) : n_(n) {}
  NlpSize size() const override { return {n_, 1, n_, n_ * (n_ + 1) / 2}; }
  void bounds(Out xl, Out xu, Out gl, Out gu) const override {
    xl.setConstant(-10.0);
    xu.setConstant(10.0);
    gl[0] = gu[0] = 1.0;
  }
  void start(Out x) const override { x.setZero(); }
  // Q = I + 1 1^T
  double objective(In x) override { return 0.5 * (x.squaredNorm() + x.sum() * x.sum()) - x[0]; }
  void gradient(In x, Out gradient) override {
    gradient = x.array() + x.sum();
    gradient[0] -= 1.0;
  }
  void constraints(In x, Out g) override { g[0] = x.sum(); }
  void jacobian_structure(OutIndex row, OutIndex column) const override {
    row.setZero();
    column = Eigen::VectorXi::LinSpaced(n_, 0, n_ - 1);
  }
  void jacobian(In, Out value) override { value.setOnes(); }
  void hessian_structure(OutIndex row, OutIndex column) const override {
    int k = 0;
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j <= i; ++j, ++k) {
        row[k] = i;
        column[k] = j;
      }
    }
  }
  void hessian(In, double factor, In, Out value) override {
    int k = 0;
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j <= i; ++j) value[k++] = factor * (i == j ? 2.0 : 1.0);
    }
  }

 private:
  int n_;
};

TEST(KktSolver, MumpsReplacesItWhereTheMatrixIsNoChain) {
  Dense problem(400);
  const NlpResult result = solve_with_ipopt(problem);
  EXPECT_EQ(result.status, NlpStatus::kOptimal);
  EXPECT_EQ(result.kkt_solver, KktSolver::kMumps);
  EXPECT_NE(result.kkt_note.find("no chain"), std::string::npos) << result.kkt_note;
  // stationary on sum x = 1: x_i + 1 - [i = 0] is the same for all i, so x = e_0
  EXPECT_NEAR(result.x[0] - result.x[1], 1.0, 1e-6);
  EXPECT_NEAR(result.x.sum(), 1.0, 1e-8);
  EXPECT_NEAR(result.x[1], 0.0, 1e-6);
  Dense small(20);
  EXPECT_EQ(solve_with_ipopt(small).kkt_solver, KktSolver::kChain);
}

TEST(KktSolver, IsTheRequestedOne) {
  Dense problem(20);
  NlpOptions options;
  EXPECT_EQ(solve_with_ipopt(problem, options).kkt_solver, KktSolver::kChain);
  options.kkt_solver = KktSolver::kMumps;
  EXPECT_EQ(solve_with_ipopt(problem, options).kkt_solver, KktSolver::kMumps);
  options.kkt_solver = KktSolver::kChain;
  options.more = {{"linear_solver", "mumps"}};  // a linear solver set as Ipopt option has priority
  EXPECT_EQ(solve_with_ipopt(problem, options).kkt_solver, KktSolver::kMumps);
}

}  // namespace
}  // namespace sparflow
