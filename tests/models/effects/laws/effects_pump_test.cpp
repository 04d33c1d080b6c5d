// Effects of pressures and pumps: each law against a closed form, its derivatives, and the parameters that its columns
// recover.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "models/effects/hydraulics.h"
#include "tests/models/effects/effect_series.h"

namespace sparflow::test_support {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using units::kBar;
using units::kBarPerLpm;
using units::kBarPerLpm2;
using units::kLitrePerMinute;

class PumpEffects : public ::testing::Test {
 protected:
  Machine machine = two_direct_cylinders();
  MachineSeries log = two_cylinder_series(machine);
  double a = machine.cylinders[0].area_piston(), b = machine.cylinders[0].area_rod();

  std::vector<double> pressure(const std::string& id, const Instant<double>& s,
                               const std::vector<double>& p, int at = -1) const {
    std::vector<double> out(2, 0.0);
    effect_named(id).add_pressure(s, at, p, out);
    return out;
  }
  std::vector<double> rise(const std::string& id, const Instant<double>& s,
                           const std::vector<double>& p) const {
    std::vector<double> out(2, 0.0);
    effect_named(id).add_return(s, -1, p, out);
    return out;
  }
  std::vector<double> demand(const std::string& id, const Instant<double>& s,
                             const std::vector<double>& p, int at) const {
    std::vector<double> out(2, 0.0);
    effect_named(id).add_demand(s, at, p, out);
    return out;
  }
};

// The second path integrates p''/w^2 + 2 d p'/w + p = demand, the stages with their own time constants, or the build-up by the
// margin, in small steps.
TEST_F(PumpEffects, PumpLagsOfAllFormsFollowTheirDifferentialEquations) {
  const double tau = 0.2;
  const VectorXd& demand = log.pumps[0].demand;
  log.pumps[0].standby = 5 * kBar;  // so that the demand's steps exceed it
  for (const int form : {0, 1, 2, 3, 4}) {
    VectorXd late = demand;
    for (const auto& [first, last] : log.runs) {
      double x = demand[first], y = x, slope = 0.0;
      for (Index k = first + 1; k < last; ++k) {
        constexpr int kSteps = 2000;
        const double h = log.step / kSteps;
        for (int i = 0; i < kSteps; ++i) {
          const auto stage = [&](double in, double out) {
            const double t = form == 0 ? tau : form == 1 ? 0.5 * tau : (in > out ? 0.2 : 0.8) * tau;
            return (in - out) / t * h;
          };
          if (form == 3) {
            const double d = 0.3, w = 2.0 * d / tau;
            slope += (w * w * (demand[k] - y) - 2.0 * d * w * slope) * h;
            y += slope * h;
          } else if (form == 4) {
            y += std::min(demand[k] - y, log.pumps[0].standby) / tau * h;
          } else {
            x += form == 0 ? demand[k] - x : stage(demand[k], x);
            y += stage(x, y);
          }
        }
        late[k] = y;
      }
    }
    MatrixXd c;
    ASSERT_TRUE(effect_named("pump_lag")
                    .columns(log, {EvidenceKind::kPump, 0}, 0,
                             std::vector{tau, static_cast<double>(form)}, c));
    const VectorXd exact = late - demand;
    // Explicit steps of 10 us are accurate to about h / tau; between samples the second stage takes the first one as constant.
    EXPECT_LT((c.col(0) - exact).norm(), (form == 1 || form == 2 ? 0.15 : 1e-3) * exact.norm())
        << form;
  }
}

/// Demand by the definition: a valve is open where its lever was beyond `opening` five samples ago, and asks for what its lever asked
/// last on that side. NaN where all are closed. [Pa]
VectorXd demand_of_open_valves(const MachineSeries& log, double opening) {
  constexpr Index kLate = 5;
  VectorXd demand = VectorXd::Constant(log.samples(), std::numeric_limits<double>::quiet_NaN());
  for (const auto& [first, last] : log.runs) {
    for (Index k = first; k < last; ++k) {
      for (Index i = 0; i < 2; ++i) {
        const VectorXd& lever = log.cylinders[static_cast<std::size_t>(i)].command;
        const double valve = lever[std::max(first, k - kLate)];
        if (std::abs(valve) <= opening) continue;
        Index asked = k;
        while (asked > first && lever[asked] * valve <= 0.0) --asked;
        const double standby = log.pumps[0].standby;
        demand[k] = std::fmax(std::fmax(demand[k], standby), log.pumps[0].asked(asked, i));
      }
    }
  }
  return demand;
}

// While every valve is closed the pressure falls by leakage, from what it was; a valve opens a time after its lever.
TEST_F(PumpEffects, ThePumpLagOfLateValvesDischargesWhileTheyAreClosed) {
  const double tau = 0.2, rest = 0.5, late = 5 * log.step, opening = 0.15;
  PumpSeries& pump = log.pumps[0];
  pump.standby = 12 * kBar;
  pump.feeds = {0, 1};
  pump.asked = MatrixXd::Constant(log.samples(), 2, std::numeric_limits<double>::quiet_NaN());
  for (Index k = 0; k < log.samples(); ++k) {
    for (Index i = 0; i < 2; ++i) {
      const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(i)];
      if (c.direction[k] != 0)
        pump.asked(k, i) = (c.direction[k] > 0 ? c.pressure_a : c.pressure_b)[k] + 15 * kBar;
    }
  }
  const VectorXd open = demand_of_open_valves(log, opening);
  ASSERT_GT(open.array().isNaN().count(), 100);
  for (const int form : {0, 4}) {
    VectorXd p = pump.demand;
    for (const auto& [first, last] : log.runs) {
      p[first] = std::isnan(open[first]) ? pump.standby : open[first];
      for (Index k = first + 1; k < last; ++k) {
        constexpr int kSteps = 2000;
        const double h = log.step / kSteps;
        double y = p[k - 1];
        for (int i = 0; i < kSteps; ++i) {
          const double to = std::isnan(open[k]) ? pump.standby : open[k];
          const double gap = form == 4 ? std::min(to - y, pump.standby) : to - y;
          const bool leaks = std::isnan(open[k]) && y > to;
          y += leaks ? std::max(-y / rest * h, to - y) : gap / tau * h;
        }
        p[k] = y;
      }
    }
    MatrixXd c;
    ASSERT_TRUE(effect_named("pump_lag")
                    .columns(log, {EvidenceKind::kPump, 0}, 0,
                             std::vector{tau, static_cast<double>(form), rest, late, opening}, c));
    const VectorXd exact = p - pump.demand;
    // Explicit steps of 10 us are accurate to about h / tau.
    EXPECT_LT((c.col(0) - exact).norm(), 1e-3 * exact.norm()) << form;
  }
}

// A regulator of several stages is no lower than what leakage leaves.
TEST_F(PumpEffects, APumpOfSeveralStagesFallsNoFasterThanByLeakage) {
  const double rest = 0.5;
  PumpSeries& pump = log.pumps[0];
  pump.standby = 20 * kBar;
  pump.feeds = {0, 1};
  pump.asked = MatrixXd::Constant(log.samples(), 2, 100 * kBar);
  for (CylinderSeries& c : log.cylinders) {
    c.command.setConstant(1.0);
    c.command.segment(100, 200).setZero();
  }
  pump.demand.setConstant(100 * kBar);
  pump.demand.segment(100, 200).setConstant(pump.standby);
  for (const double form : {1.0, 2.0}) {
    MatrixXd c;
    ASSERT_TRUE(effect_named("pump_lag")
                    .columns(log, {EvidenceKind::kPump, 0}, 0,
                             std::vector{0.05, form, rest, 1e-9, 0.1}, c));
    const VectorXd p = c.col(0) + pump.demand;
    for (const Index k : {110, 130, 170})
      EXPECT_NEAR(p[k],
                  std::max(pump.standby,
                           p[100] * std::exp(-log.step * static_cast<double>(k - 100) / rest)),
                  1e-6 * p[100]);
    EXPECT_NEAR(p[299], pump.standby, 1e-3 * kBar);
  }
}

/// A first-order lag in small steps. [Pa]
VectorXd followed(const MachineSeries& log, const VectorXd& demand, double tau) {
  VectorXd out = demand;
  for (const auto& [first, last] : log.runs) {
    double y = demand[first];
    for (Index k = first + 1; k < last; ++k) {
      constexpr int kSteps = 2000;
      for (int i = 0; i < kSteps; ++i) y += (demand[k] - y) / tau * log.step / kSteps;
      out[k] = y;
    }
  }
  return out;
}

// What adds to a demand reaches the pressure of a pump that is late as late as the demand does; the model's lag says how late.
TEST_F(PumpEffects, ChangesOfTheDemandShowByTheLagOfThePump) {
  const double tau = 0.3, share = 0.8;
  const auto columns = [&](const std::string& id, std::vector<double> shape, int at) {
    MatrixXd c;
    EXPECT_TRUE(effect_named(id).columns(log, {EvidenceKind::kPump, 0}, at, shape, c)) << id;
    return c;
  };
  const std::vector<std::tuple<std::string, std::vector<double>, int>> changes = {
      {"line_loss", {0.0}, 0}, {"flow_dependent_margin", {}, 0}, {"pressure_offset", {1.0}, 0}};
  for (const auto& [id, shape, at] : changes) {
    log.pumps[0].following = {};
    const MatrixXd at_once = columns(id, shape, at);
    log.pumps[0].following = {&effect_named("pump_lag"), 0, {share, tau, 0.0}};
    const MatrixXd late = columns(id, shape, at);
    for (Index k = 0; k < late.cols(); ++k) {
      const VectorXd exact =
          (1.0 - share) * at_once.col(k) + share * followed(log, at_once.col(k), tau);
      // steps of 10 us are accurate to about h / tau
      EXPECT_LT((late.col(k) - exact).norm(), 1e-3 * exact.norm()) << id;
      EXPECT_GT((late.col(k) - at_once.col(k)).norm(), 0.01 * exact.norm()) << id;
    }
  }
}

// A pump that builds up by its own margin is not linear in its demand. The sum of demand, lag and loss is then the late pressure of
// the whole demand where the loss has its usual size.
TEST_F(PumpEffects, ALossAndALagOfThePumpAddUpToTheLateWhole) {
  const Effect &lag = effect_named("pump_lag"), &loss = effect_named("line_loss");
  const double k = loss.info().parameters[0].typical;
  log.pumps[0].standby = 5 * kBar;  // so that the demand's steps exceed it
  const std::vector<double> shape = {0.2, 4.0};
  MatrixXd at_once, late, lagging;
  ASSERT_TRUE(loss.columns(log, {EvidenceKind::kPump, 0}, 0, std::vector{0.0}, at_once));
  ASSERT_TRUE(lag.columns(log, {EvidenceKind::kPump, 0}, 0, shape, lagging));
  log.pumps[0].following = {&lag, 0, {1.0, shape[0], shape[1]}};
  ASSERT_TRUE(loss.columns(log, {EvidenceKind::kPump, 0}, 0, std::vector{0.0}, late));
  const VectorXd sum = log.pumps[0].demand + lagging.col(0) + k * late.col(0);
  MachineSeries whole = log;
  whole.pumps[0].demand += k * at_once.col(0);
  ASSERT_TRUE(lag.columns(whole, {EvidenceKind::kPump, 0}, 0, shape, lagging));
  const VectorXd exact = whole.pumps[0].demand + lagging.col(0);
  EXPECT_LT((sum - exact).norm(), 1e-9 * exact.norm()) << "rounding only";
}

TEST_F(PumpEffects, TankLineRaisesEveryReturnChamberThatMoves) {
  Instant<double> s = two_cylinder_instant<double>(machine);
  const double k = 1e-3 * kBarPerLpm2;
  const double total = 0.1 * b + 0.08 * a;
  const std::vector<double> out = rise("return_back_pressure", s, {k});
  EXPECT_NEAR(out[0], k * total * total, 1e-6);
  EXPECT_NEAR(out[1], k * total * total, 1e-6);
  s.side[1] = 0;
  EXPECT_EQ(rise("return_back_pressure", s, {k})[1], 0.0) << "push rests";
  EXPECT_EQ(pressure("return_back_pressure", s, {k})[0], 0.0) << "what reaches the supply the "
                                                                 "learned pressure says";
}

TEST_F(PumpEffects, TankLineIsRecoveredFromTheOthersFlow) {
  const double k = 8e-4 * kBarPerLpm2;
  MatrixXd c;
  ASSERT_TRUE(effect_named("return_back_pressure")
                  .columns(log, {EvidenceKind::kReturnExtend, 0}, -1, {}, c));
  const VectorXd& own = log.cylinders[0].return_flow;
  const VectorXd all = own + log.cylinders[1].return_flow;
  const VectorXd y =
      (3e5 + 1e9 * own.array() + 2e11 * own.array().square() + k * all.array().square()).matrix();
  MatrixXd x(y.size(), 4);
  x << VectorXd::Ones(y.size()), own, own.cwiseAbs2(), c;
  EXPECT_NEAR(scaled_least_squares(x, y)[3] / k, 1.0,
              1e-9);  // the same law without noise: rounding only
}

TEST_F(PumpEffects, LineLossAddsToDemandOrToForce) {
  const Instant<double> s = two_cylinder_instant<double>(machine);
  const double k = 2e-3 * kBarPerLpm2, k1 = 0.1 * kBarPerLpm;
  const double q = 0.1 * a, loss = k * q * q + k1 * q;
  EXPECT_NEAR(demand("line_loss", s, {k, k1, 0.0}, 0)[0], loss, 1e-6);
  EXPECT_EQ(demand("line_loss", s, {k, k1, 1.0}, 0)[0], 0.0);
  std::vector<double> force(2, 0.0);
  const double at_valve[] = {k, k1, 1.0};
  effect_named("line_loss").add_force(s, 0, at_valve, force);
  EXPECT_NEAR(force[0], a * loss, 1e-6);
  MatrixXd c;
  const double at_cylinder[] = {0.0};
  ASSERT_TRUE(effect_named("line_loss").columns(log, {EvidenceKind::kPump, 0}, 1, at_cylinder, c));
  for (Index i = 0; i < log.samples(); ++i) {
    const double flow = log.pumps[0].leader[i] == 1 ? log.cylinders[1].flow[i] : 0.0;
    ASSERT_NEAR(c(i, 0), flow * flow, 1e-15);
    ASSERT_NEAR(c(i, 1), flow, 1e-15);
  }
}

// Pilot ratio 4, setting 200 bar: opening balance p_load + R p + (A_supply/A_hold) p = p_set.
TEST_F(PumpEffects, CounterbalanceOpensAtItsBalance) {
  Instant<double> s = two_cylinder_instant<double>(machine);
  const double ratio = 4.0, set = 200 * kBar, phi = b / a;  // push retracts: supply rod side
  const double slope = 1.0 / (ratio + phi), load = 10e3 / a;
  const double p = pressure("counterbalance", s, {slope * set, slope, -1.0}, 1)[1];
  EXPECT_NEAR(load + ratio * p + phi * p, set, 1e-3);
  // It is continuous through zero load and vanishes where the load alone requires more.
  s.force[1] = 1e-6;
  const double below = pressure("counterbalance", s, {slope * set, slope, -1.0}, 1)[1];
  s.force[1] = -1e-6;
  EXPECT_NEAR(pressure("counterbalance", s, {slope * set, slope, -1.0}, 1)[1], below, 1.0);
  EXPECT_EQ(pressure("counterbalance", s, {slope * set, slope, 1.0}, 1)[1], 0.0)
      << "the valve of the other side";
  s.force[1] = -100e3;
  EXPECT_EQ(pressure("counterbalance", s, {slope * set, slope, -1.0}, 1)[1], 0.0);
  MatrixXd c;
  const double lowers[] = {-1.0}, lifts[] = {1.0};
  EXPECT_FALSE(
      effect_named("counterbalance").columns(log, {EvidenceKind::kSupplyRetract, 1}, 1, lifts, c));
  ASSERT_TRUE(
      effect_named("counterbalance").columns(log, {EvidenceKind::kSupplyRetract, 1}, 1, lowers, c));
  for (Index i = 0; i < log.samples(); ++i) {
    const bool there = log.cylinders[1].direction[i] < 0;
    ASSERT_EQ(c(i, 0), there ? 1.0 : 0.0);
    ASSERT_NEAR(c(i, 1), there ? -log.cylinders[1].force[i] / a : 0.0, 1e-9);
  }
}

TEST_F(PumpEffects, ColdOilRaisesLossesAndTheReferenceTemperatureDoesNot) {
  Instant<double> s = two_cylinder_instant<double>(machine);
  // slopes of losses of 4 and 6 bar
  const std::vector<double> p = {0.03 * 4 * kBar, 0.03 * 6 * kBar, 0.03};
  const double excess = std::exp(0.03 * 15.0) - 1.0;
  EXPECT_NEAR(demand("oil_temperature", s, p, -1)[0], 6 * kBar * excess * 0.1 * a / 1.2e-3, 1e-6);
  EXPECT_NEAR(rise("oil_temperature", s, p)[0], 4 * kBar * excess * 0.1 * b / (1.2e-3 * b / a),
              1e-6);
  s.oil = 40.0;
  EXPECT_EQ(demand("oil_temperature", s, p, -1)[0], 0.0);
  log.oil.resize(0);
  MatrixXd c;
  const double beta[] = {0.03};
  EXPECT_FALSE(effect_named("oil_temperature").columns(log, {EvidenceKind::kPump, 0}, -1, beta, c));
}

TEST_F(PumpEffects, OilTemperatureIsRecoveredFromTheReturnChamber) {
  MatrixXd c;
  const double beta[] = {0.03};
  ASSERT_TRUE(
      effect_named("oil_temperature").columns(log, {EvidenceKind::kReturnExtend, 0}, -1, beta, c));
  const VectorXd& own = log.cylinders[0].return_flow;
  const double full = 1.2e-3 * b / a;
  const VectorXd y =
      (5e5 + 8 * kBar / full * own.array() * (-0.03 * (log.oil.array() - 40.0)).exp()).matrix();
  MatrixXd x(y.size(), 3);
  x << VectorXd::Ones(y.size()), own, c.col(0);
  EXPECT_NEAR(scaled_least_squares(x, y)[2] / kBar, 8.0 * 0.03, 1e-6);
}

TEST_F(PumpEffects, MarginGrowsWithTheWholeFlowButNotBelowStandby) {
  const Instant<double> s = two_cylinder_instant<double>(machine);
  const double k = 7e-4 * kBarPerLpm2, q = s.pump_flow[0];
  const std::vector<double> out = demand("flow_dependent_margin", s, {k}, 0);
  EXPECT_NEAR(out[0], k * q * q, 1e-6);
  EXPECT_NEAR(out[1], k * q * q, 1e-6);
  MatrixXd c;
  ASSERT_TRUE(
      effect_named("flow_dependent_margin").columns(log, {EvidenceKind::kPump, 0}, 0, {}, c));
  const VectorXd flow = pump_flow(log, 0);
  for (Index i = 0; i < log.samples(); ++i) {
    ASSERT_NEAR(c(i, 0), log.pumps[0].leader[i] < 0 ? 0.0 : flow[i] * flow[i], 1e-15);
  }
}

TEST_F(PumpEffects, PressureIsCutAtThePowerLimit) {
  const Instant<double> s = two_cylinder_instant<double>(machine);
  const double asked = 85e5 * s.pump_flow[0];
  std::vector<double> out(1, 0.0);
  const double half[] = {1.0, 0.5 * asked}, twice[] = {1.0, 2.0 * asked};
  effect_named("torque_limit").add_pump(s, 0, half, out);
  EXPECT_NEAR((85e5 + out[0]) * s.pump_flow[0], 0.5 * asked, 1e-6 * asked);
  out[0] = 0.0;
  effect_named("torque_limit").add_pump(s, 0, twice, out);
  EXPECT_EQ(out[0], 0.0);
}

TEST_F(PumpEffects, PowerLimitIsRecoveredAndItsGridCoversTheLog) {
  const VectorXd flow = pump_flow(log, 0);
  const double power = 0.6 * log.pumps[0].demand.cwiseProduct(flow).maxCoeff();
  VectorXd cut = VectorXd::Zero(log.samples());
  for (Index i = 0; i < log.samples(); ++i) {
    cut[i] = std::min(0.0, flow[i] > 0.0 ? power / flow[i] - log.pumps[0].demand[i] : 0.0);
  }
  MatrixXd c;
  const double shape[] = {power};
  ASSERT_TRUE(effect_named("torque_limit").columns(log, {EvidenceKind::kPump, 0}, 0, shape, c));
  EXPECT_NEAR(scaled_least_squares(c, cut)[0], 1.0, 0.02);  // the demand is averaged over 0.3 s
  const std::vector<double> grid = effect_named("torque_limit").grid(log, 0, 0);
  ASSERT_FALSE(grid.empty());
  EXPECT_LT(grid.front(), power);
  EXPECT_GT(grid.back(), power);
}

TEST_F(PumpEffects, PumpEffectsActOnLoadSensingPumpsOnly) {
  for (const char* id : {"flow_dependent_margin", "torque_limit"}) {
    EXPECT_EQ(effect_named(id).places(machine), (std::vector<int>{0}));
    Machine constant = machine;
    constant.pumps[0].type = PumpType::kConstantPressure;
    EXPECT_TRUE(effect_named(id).places(constant).empty()) << id;
  }
  Machine dry = machine;
  for (Cylinder& c : dry.cylinders) c.bore = 0.0;
  for (const char* id : {"return_back_pressure", "oil_temperature"}) {
    EXPECT_EQ(effect_named(id).places(machine), (std::vector<int>{-1}));
    EXPECT_TRUE(effect_named(id).places(dry).empty()) << id;
  }
}

// Speeds and forces as functions of two variables; jets against central differences, for every law and branch.
TEST_F(PumpEffects, JetsAgreeWithNumericDerivatives) {
  struct Case {
    std::string id;
    int at;
    std::vector<double> p;
  };
  const std::vector<Case> cases = {
      {"return_back_pressure", -1, {1e-3 * kBarPerLpm2}},
      {"line_loss", 0, {2e-3 * kBarPerLpm2, 0.1 * kBarPerLpm, 0.0}},
      {"line_loss", 0, {2e-3 * kBarPerLpm2, 0.1 * kBarPerLpm, 1.0}},
      {"counterbalance", 1, {40 * kBar, 0.2, -1.0}},
      {"oil_temperature", -1, {0.12 * kBar, 0.18 * kBar, 0.03}},
      {"flow_dependent_margin", 0, {7e-4 * kBarPerLpm2}},
      {"torque_limit", 0, {1.0, 3e3}},
  };
  const auto instant = [&]<class T>(const T& x, const T& y) {
    Instant<T> s = two_cylinder_instant<T>(machine);
    s.speed[0] = 0.1 * (1.0 + x);
    s.force[0] = 50e3 * (1.0 + x * y);
    s.force[1] = 10e3 * (1.0 + y);
    s.flow[0] = s.speed[0] * a;
    s.return_flow[0] = s.speed[0] * b;
    s.pump_flow[0] = s.flow[0] + s.flow[1];
    s.pump_pressure[0] = 85e5 * (1.0 + 0.5 * y);
    return s;
  };
  for (const Case& law : cases) {
    const Effect& effect = effect_named(law.id);
    const auto sum = [&]<class T>(const T& x, const T& y) {
      const Instant<T> s = instant(x, y);
      std::vector<T> force(2, T(0.0)), pressure(2, T(0.0)), asked(2, T(0.0)), pump(1, T(0.0)),
          back(2, T(0.0));
      effect.add_force(s, law.at, law.p, force);
      effect.add_pressure(s, law.at, law.p, pressure);
      effect.add_return(s, law.at, law.p, back);
      effect.add_demand(s, law.at, law.p, asked);
      effect.add_pump(s, law.at, law.p, pump);
      return T(1e-5 * (force[0] + pressure[0] + 2.0 * pressure[1] + back[0] + 2.0 * back[1] +
                       asked[0] + 3.0 * asked[1] + pump[0]));
    };
    const double x = 0.1, y = 0.2;
    const Jet j = sum(Jet::variable(x, 0, 2), Jet::variable(y, 1, 2));
    EXPECT_NE(j.value, 0.0) << law.id;
    EXPECT_NEAR(j.value, sum(x, y), 1e-12 * std::abs(j.value)) << law.id;
    const auto dx = [&](double v) { return sum(v, y); };
    const auto dy = [&](double v) { return sum(x, v); };
    const double size = std::abs(j.value) + std::abs(j.gradient(0)) + std::abs(j.gradient(1)) +
                        std::abs(j.hessian(0, 0));
    EXPECT_NEAR(j.gradient(0), numeric_derivative(dx, x), kDerivativeTolerance * size) << law.id;
    EXPECT_NEAR(j.gradient(1), numeric_derivative(dy, y), kDerivativeTolerance * size) << law.id;
    const auto jx = [&](double v) {
      return sum(Jet::variable(v, 0, 2), Jet::variable(y, 1, 2)).gradient(0);
    };
    const auto jy = [&](double v) {
      return sum(Jet::variable(x, 0, 2), Jet::variable(v, 1, 2)).gradient(0);
    };
    EXPECT_NEAR(j.hessian(0, 0), numeric_derivative(jx, x), kDerivativeTolerance * size) << law.id;
    EXPECT_NEAR(j.hessian(1, 0), numeric_derivative(jy, y), kDerivativeTolerance * size) << law.id;

    // With every linear parameter zero the effect changes nothing.
    std::vector<double> none = law.p;
    const auto& parameters = effect.info().parameters;
    for (std::size_t i = 0; i < none.size(); ++i) {
      if (parameters[i].linear) none[i] = 0.0;
    }
    std::vector<double> out(2, 0.0);
    const Instant<double> s = instant(x, y);
    effect.add_force(s, law.at, none, out);
    effect.add_pressure(s, law.at, none, out);
    effect.add_return(s, law.at, none, out);
    effect.add_demand(s, law.at, none, out);
    effect.add_pump(s, law.at, none, out);
    EXPECT_EQ(std::abs(out[0]) + std::abs(out[1]), 0.0) << law.id;
  }
}

}  // namespace
}  // namespace sparflow::test_support
