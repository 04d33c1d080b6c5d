// The reference NLP against values computed by an independent implementation (bench/data/reference_checkpoints.json,
// scalar expression graph with automatic differentiation) and against its known optimum.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "bench/reference_model.h"
#include "models/chain/pump_law.h"
#include "models/math/error.h"
#include "optimizer/nlp/derivative_check.h"
#include "optimizer/nlp/ipopt_solver.h"
#include "tests/parsed_json.h"

namespace sparflow::bench {
namespace {

using Eigen::VectorXd;
using Eigen::VectorXi;
using nlohmann::json;

const std::string kData = SPARFLOW_SOURCE_DIR "/bench/data/";

std::shared_ptr<const ReferenceProblem> problem() {
  static const auto read = std::make_shared<const ReferenceProblem>(
      read_reference_problem(kData + "reference_problem.json"));
  return read;
}

const json& checkpoints() {
  static const json document =
      test_support::parsed_json(read_file(kData + "reference_checkpoints.json"));
  return document;
}

VectorXd vector(const json& list) {
  const auto values = list.get<std::vector<double>>();
  return Eigen::Map<const VectorXd>(values.data(), static_cast<int>(values.size()));
}

/// Largest difference of two sparse matrices, relative to the largest entry of the expected one.
double difference(const VectorXi& row, const VectorXi& column, const VectorXd& value,
                  const json& expected) {
  std::map<std::pair<int, int>, double> places;
  for (int i = 0; i < value.size(); ++i) places[{row[i], column[i]}] += value[i];
  double scale = 0.0;
  for (std::size_t i = 0; i < expected["val"].size(); ++i) {
    const double v = expected["val"][i];
    scale = std::max(scale, std::abs(v));
    places[{expected["row"][i], expected["col"][i]}] -= v;
  }
  double worst = 0.0;
  for (const auto& [place, rest] : places) worst = std::max(worst, std::abs(rest));
  return worst / scale;
}

class Checkpoint : public testing::TestWithParam<const char*> {};

// Both sides sum 200 kernel terms whose absolute values add up to as much as 4e6 bar for a pressure of about 50 bar,
// so that pressures agree to about 1e-10 bar, 1e-11 relative to the largest entries; 1e-9 allows for the
// factors (2/eps_v)^2 that the direction's blend multiplies into the Hessian.
constexpr double kAgreement = 1e-9;

TEST_P(Checkpoint, FunctionsAndDerivativesAgree) {
  const json& point = checkpoints()["points"][GetParam()];
  Transcription nlp = reference_transcription(problem());
  const NlpSize size = nlp.size();
  const VectorXd x = vector(point["x"]);
  ASSERT_EQ(size.variables, x.size());

  EXPECT_NEAR(nlp.objective(x), point["f"], kAgreement * point["f"].get<double>());

  VectorXd gradient(size.variables);
  nlp.gradient(x, gradient);
  const VectorXd expected_gradient = vector(point["grad"]);
  EXPECT_LT((gradient - expected_gradient).cwiseAbs().maxCoeff(),
            kAgreement * expected_gradient.cwiseAbs().maxCoeff());

  VectorXd g(size.constraints);
  const VectorXd expected_g = vector(point["g"]);
  ASSERT_EQ(size.constraints, expected_g.size());
  nlp.constraints(x, g);
  // There are two scales: defects and tip are of order 1 (rad, m), flows of order 200 l/min.
  EXPECT_LT((g - expected_g).head(482).cwiseAbs().maxCoeff(), kAgreement);
  EXPECT_LT((g - expected_g).tail(81).cwiseAbs().maxCoeff(), kAgreement * 200.0);

  VectorXi row(size.jacobian_nonzeros), column(size.jacobian_nonzeros);
  VectorXd value(size.jacobian_nonzeros);
  nlp.jacobian_structure(row, column);
  nlp.jacobian(x, value);
  EXPECT_LT(difference(row, column, value, point["jac"]), kAgreement);

  row.resize(size.hessian_nonzeros);
  column.resize(size.hessian_nonzeros);
  value.resize(size.hessian_nonzeros);
  VectorXd multiplier(size.constraints);
  for (int i = 0; i < size.constraints; ++i) multiplier[i] = 0.1 * (1 + i % 7);
  nlp.hessian_structure(row, column);
  nlp.hessian(x, 1.0, multiplier, value);
  EXPECT_EQ(size.hessian_nonzeros, static_cast<int>(point["hess"]["val"].size()));
  EXPECT_LT(difference(row, column, value, point["hess"]), kAgreement);
}

INSTANTIATE_TEST_SUITE_P(ReferenceNlp, Checkpoint, testing::Values("initial_guess", "solution"));

TEST(ReferenceNlp, InitialGuessIsThatOfTheCheckpoints) {
  Transcription nlp = reference_transcription(problem());
  VectorXd x(nlp.size().variables);
  nlp.start(x);
  EXPECT_LT((x - vector(checkpoints()["points"]["initial_guess"]["x"])).cwiseAbs().maxCoeff(),
            1e-15);
}

TEST(ReferenceNlp, IntermediateQuantitiesAgree) {
  Transcription nlp = reference_transcription(problem());
  VectorXd x(nlp.size().variables);
  nlp.start(x);
  ReferenceKnot knot(problem());
  const auto state = [&](int k) {
    VectorXd z(6);
    z << x.segment(nlp.q_index(k, 0), 3), x.segment(nlp.qd_index(k, 0), 3);
    return knot.state(z.data());
  };
  const auto near = [](const std::array<double, 3>& got, const std::array<double, 3>& expected) {
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(got[i], expected[i], 1e-9);
  };
  // Values of the independent implementation, printed with 12 decimals.
  const ReferenceKnot::State first = state(0), middle = state(40);
  near(first.force, {84.841163917837, 17.311881904558, -7.040343643671});
  near(first.flow, {4.853760649796, 4.123340357837, 1.151590057082});
  near(first.pressure, {41.825943428457, 26.397584399003, 25.127912530144});
  EXPECT_NEAR(first.pump, 57.2139618714, 1e-9);
  near(middle.force, {117.658006614858, 45.035315691623, -4.883049875961});
  near(middle.flow, {8.390711318075, 88.108368301526, 60.337425560522});
  near(middle.pressure, {30.413159103642, 44.134303232829, 10.38854451192});
  EXPECT_NEAR(middle.pump, 62.1263314032, 1e-9);
}

// The reference model has a copy of the smooth law, because it is an independent second path.
TEST(ReferenceNlp, PumpPressureIsTheSmoothLawOfTheModel) {
  const ReferenceProblem& p = *problem();
  Transcription nlp = reference_transcription(problem());
  ReferenceKnot knot(problem());
  const VectorXd x = vector(checkpoints()["points"]["solution"]["x"]);
  const std::vector<int> cylinders = {0, 1, 2};
  double least_standby_share = 1.0;
  for (int k = 0; k < 81; ++k) {
    VectorXd z(6);
    z << x.segment(nlp.q_index(k, 0), 3), x.segment(nlp.qd_index(k, 0), 3);
    const ReferenceKnot::State state = knot.state(z.data());
    std::array<double, 3> demand, share;
    for (std::size_t i = 0; i < 3; ++i) {
      const double q2 = state.flow[i] * state.flow[i];
      demand[i] = state.pressure[i] + p.margin * q2 / (q2 + p.q_eps * p.q_eps);
    }
    const SmoothPumpLaw law{p.standby, p.lse_temperature};
    const auto soft = law.pressure<double>(cylinders, [&](int i) -> SmoothDemand<double> {
      const auto c = static_cast<std::size_t>(i);
      return {&demand[c], &share[c]};
    });
    // The copy leaves out terms below a tenth of the last digit of pressures of some 100 bar.
    EXPECT_NEAR(state.pump, soft.pressure, 1e-12 * soft.pressure);
    least_standby_share = std::min(least_standby_share, soft.standby_share);
  }
  EXPECT_LT(least_standby_share, 0.01) << "some knots are led by a cylinder";
}

TEST(ReferenceNlp, EveryInstructionSetGivesTheSameObjective) {
  const KernelIsa before = kernel_isa();
  const VectorXd x = vector(checkpoints()["points"]["solution"]["x"]);
  for (KernelIsa isa : {KernelIsa::kBaseline, KernelIsa::kAvx2, KernelIsa::kAvx512}) {
    if (!set_kernel_isa(isa)) continue;
    Transcription nlp = reference_transcription(problem());
    // Pressures have rounding errors of 1e-10 bar in sums of 4e6 bar: 3e-11 kJ at each knot, 1e-9 kJ if all add up.
    EXPECT_NEAR(nlp.objective(x), 150.65622880306853, 1e-9) << kernel_isa_name(isa);
  }
  set_kernel_isa(before);
}

TEST(ReferenceNlp, DerivativesMatchDifferences) {
  Transcription nlp = reference_transcription(problem());
  const VectorXd x = vector(checkpoints()["points"]["solution"]["x"]);
  // The direction blend varies over eps_v = 5e-3 m/s, so steps of 1e-4 have a truncation error of (1e-4/5e-3)^4 = 2e-7
  // of functions whose second derivatives reach 1e3 at rest.
  const DerivativeCheck check = check_derivatives(nlp, x, 1e-4);
  EXPECT_LT(check.gradient_error, 1e-6) << check.worst_gradient;
  EXPECT_LT(check.jacobian_error, 1e-6) << check.worst_jacobian;
  EXPECT_LT(check.hessian_error, 1e-5) << check.worst_hessian;
}

TEST(ReferenceNlp, BothKktSolversReachTheSameOptimum) {
  NlpOptions options;
  options.kkt_solver = KktSolver::kChain;
  Transcription first = reference_transcription(problem());
  const NlpResult chain = solve_with_ipopt(first, options);
  options.kkt_solver = KktSolver::kMumps;
  Transcription second = reference_transcription(problem());
  const NlpResult mumps = solve_with_ipopt(second, options);
  ASSERT_EQ(chain.kkt_solver, KktSolver::kChain) << chain.kkt_note;
  ASSERT_EQ(mumps.kkt_solver, KktSolver::kMumps);
  ASSERT_TRUE(chain.solved() && mumps.solved());
  // 3e-8 relative, as between tolerances
  EXPECT_NEAR(chain.objective, mumps.objective, 1e-7 * mumps.objective);
  EXPECT_NEAR(chain.iterations, mumps.iterations, 10) << "rounding changes the number by a few";
}

TEST(ReferenceNlp, ReachesTheKnownOptimum) {
  Transcription nlp = reference_transcription(problem());
  const NlpResult result = solve_with_ipopt(nlp);
  ASSERT_EQ(result.status, NlpStatus::kOptimal) << result.brief();
  // Between tolerances of 1e-6 and 1e-10 the objective changes by 3e-8 relative.
  EXPECT_NEAR(result.objective, 150.656228803, 1e-6 * 150.656);
  EXPECT_NEAR(nlp.model_cost(result.x), 150.648987757, 1e-6 * 150.649);
  EXPECT_LT(result.max_violation, 1e-6);
  EXPECT_NEAR(result.iterations, 53, 10) << "rounding changes the number by a few";
  const Trajectory motion = nlp.trajectory(result.x);
  EXPECT_NEAR(motion.q(80, 0), 0.93017064, 1e-4);  // the optimum is flat along the redundancy
  EXPECT_NEAR(motion.q(80, 1), -1.16290205, 1e-4);
  EXPECT_NEAR(motion.q(80, 2), 2.81032820, 1e-4);
  int at_flow_limit = 0;
  for (int k = 0; k <= 80; ++k) at_flow_limit += result.constraints[482 + k] > 200.0 - 1e-3 ? 1 : 0;
  EXPECT_EQ(at_flow_limit, 39);
}

TEST(ReferenceNlp, WarmStartAfterTheGoalMovedSavesIterations) {
  Transcription first = reference_transcription(problem());
  const NlpResult before = solve_with_ipopt(first);
  auto moved = std::make_shared<ReferenceProblem>(*problem());
  moved->goal[0] += 0.05;
  Transcription cold = reference_transcription(moved);
  const NlpResult from_guess = solve_with_ipopt(cold);
  ASSERT_EQ(from_guess.status, NlpStatus::kOptimal) << from_guess.brief();
  EXPECT_NEAR(from_guess.objective, 152.599476, 1e-6 * 152.6);

  Transcription warm = reference_transcription(moved);
  warm.set_start(before.x);
  warm.set_start_multipliers(first.multipliers(before.multipliers));
  const NlpResult from_solution = solve_with_ipopt(warm);
  ASSERT_EQ(from_solution.status, NlpStatus::kOptimal) << from_solution.brief();
  EXPECT_NEAR(from_solution.objective, 152.599476, 1e-6 * 152.6);
  EXPECT_LE(from_solution.iterations, from_guess.iterations / 2)
      << "10 against 46 where it was measured first";
  RecordProperty("cold_iterations", from_guess.iterations);
  RecordProperty("warm_iterations", from_solution.iterations);
}

/// Writes the problem file with one change into the tests' folder.
std::string broken(const std::string& name, const std::function<void(json&)>& change) {
  json document = test_support::parsed_json(read_file(kData + "reference_problem.json"));
  change(document);
  const std::string path = testing::TempDir() + "reference_" + name + ".json";
  std::ofstream(path) << document.dump();
  return path;
}

TEST(ReferenceNlp, ErrorsInTheFileNameTheKey) {
  const std::pair<const char*, std::function<void(json&)>> cases[] = {
      {"T", [](json& d) { d.erase("T"); }},
      {"N", [](json& d) { d["N"] = 80.5; }},
      {"L1", [](json& d) { d["L1"] = "long"; }},
      {"eps_v", [](json& d) { d["eps_v"] = 0.0; }},
      {"q_lb",
       [](json& d) {
         d["q_lb"] = {1.0, 2.0};
       }},
      {"gp", [](json& d) { d["gp"] = json::array(); }},
      {"gp[1][0].lF", [](json& d) { d["gp"][1][0].erase("lF"); }},
      {"gp[2][1].alpha", [](json& d) { d["gp"][2][1]["alpha"].erase(0); }},
      {"gp[0][1].Q[7]", [](json& d) { d["gp"][0][1]["Q"][7] = nullptr; }},
  };
  int number = 0;
  for (const auto& [key, change] : cases) {
    const std::string path = broken(std::to_string(++number), change);
    try {
      read_reference_problem(path);
      FAIL() << key;
    } catch (const InputError& error) {
      EXPECT_EQ(error.key, key) << error.what();
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
    }
  }
  EXPECT_THROW(read_reference_problem(kData + "no_such_file.json"), InputError);
  EXPECT_THROW(read_reference_problem(broken("list", [](json& d) { d = json::array(); })),
               InputError);
  const std::string torn = testing::TempDir() + "reference_torn.json";
  std::ofstream(torn) << "{\n\"T\": 10.0,\n\"N\": ";
  try {
    read_reference_problem(torn);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.place.line, 3) << error.what();
  }
}

TEST(ReferenceNlp, ProgramReportsAndExitsAsDocumented) {
  const std::string program = SPARFLOW_BINARY_DIR "/bench/reference_nlp";
  if (!std::filesystem::exists(program)) GTEST_SKIP() << program << " is not built";
  const std::string out = testing::TempDir() + "reference_out.json";
  const auto run = [&](const std::string& arguments) {
    const int status = std::system((program + " " + arguments + " > /dev/null 2>&1").c_str());
    return WEXITSTATUS(status);
  };
  EXPECT_EQ(run(kData + "reference_problem.json --json " + out), 0);
  const json result = test_support::parsed_json(read_file(out));
  for (const char* key : {"objective", "iterations", "solve_s", "callbacks_s", "linear_solver_s"}) {
    EXPECT_TRUE(result.contains(key) && result[key].is_number()) << key;
  }
  EXPECT_NEAR(result["objective"], 150.656228803, 1e-6 * 150.656);
  EXPECT_EQ(run(kData + "no_such_file.json"), 3);
  EXPECT_EQ(run(broken("run", [](json& d) { d.erase("N"); })), 3);
  EXPECT_EQ(run(kData + "reference_problem.json --json /no/such/folder/out.json"), 3);
  EXPECT_EQ(run("--jsno x"), 2);
  EXPECT_EQ(run(""), 2);
}

}  // namespace
}  // namespace sparflow::bench
