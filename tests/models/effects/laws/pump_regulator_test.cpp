// The flow balance of a load-sensing pump's line: closed forms, small explicit steps, and the valves that the pump's lag hands to it.
#include "models/effects/laws/hydraulic/pump_regulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "models/effects/hydraulics.h"
#include "tests/models/effects/effect_series.h"

namespace sparflow::test_support {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using units::kBar;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kStandby = 20 * kBar, kMargin = 15 * kBar;
/// Of the law, from its literature; a second copy, so that a change of one shows.
constexpr double kDamping = 0.7, kDropOverMargin = 0.5;

class PumpRegulatorTest : public ::testing::Test {
 protected:
  Machine machine = two_direct_cylinders();
  MachineSeries log = two_cylinder_series(machine);
  VectorXd start = VectorXd::Constant(log.samples(), kStandby);

  OpenSection section(double load, double flow) const {
    return {VectorXd::Constant(log.samples(), load), VectorXd::Constant(log.samples(), kMargin),
            VectorXd::Constant(log.samples(), flow)};
  }
};

// A load that the pump cannot lift yet lets no oil pass, and the line senses its own pressure: the error is the margin, so that
// the pressure rises by 2 D m t / tau + m t^2 / (2 tau^2), the line's leakage being nothing.
TEST_F(PumpRegulatorTest, BelowTheLoadThePressureRisesByTheRegulatorAlone) {
  const double tau = 0.3, load = 250 * kBar;
  const PumpRegulator regulator{tau, 1e-11, 1e9};
  const VectorXd p = regulated_pressure(log, 1 * kBar, {section(load, 1e-3)}, regulator, start);
  for (const Index k : {5, 10, 20}) {
    const double t = log.time[k];
    const double exact =
        kStandby + 2.0 * kDamping * kMargin * t / tau + kMargin * t * t / (2.0 * tau * tau);
    ASSERT_LT(exact, load);
    // the implicit step is of first order: one step of t / h
    EXPECT_NEAR(p[k] - kStandby, exact - kStandby,
                1.5 / static_cast<double>(k) * (exact - kStandby));
  }
}

TEST(PassedShare, IsTheRootOfTheDropUpToTheFullOne) {
  const double full = kDropOverMargin * kMargin;
  EXPECT_DOUBLE_EQ(passed_share(0.25 * full, kMargin), 0.5);
  EXPECT_DOUBLE_EQ(passed_share(full, kMargin), 1.0);
  EXPECT_DOUBLE_EQ(passed_share(2.0 * full, kMargin), 1.0);
  EXPECT_DOUBLE_EQ(passed_share(-full, kMargin), 0.0);
}

// At rest the error is zero: load and margin of the highest section, or standby where all are closed.
TEST_F(PumpRegulatorTest, ItSettlesAtTheHighestDemand) {
  const PumpRegulator regulator{0.1, 1e-11, 0.4};
  const std::vector<OpenSection> two = {section(80 * kBar, 1e-3), section(120 * kBar, 5e-4)};
  EXPECT_NEAR(regulated_pressure(log, kStandby, two, regulator, start)[1199], 135 * kBar,
              1e-3 * kBar);
  const std::vector<OpenSection> none = {section(kNan, 1e-3)};
  const VectorXd high = VectorXd::Constant(log.samples(), 150 * kBar);
  EXPECT_NEAR(regulated_pressure(log, kStandby, none, regulator, high)[1199], kStandby,
              1e-3 * kBar);
}

// While the pump's flow falls short, the pressure stays at the load; a lag of the demand would be at the margin above it.
TEST_F(PumpRegulatorTest, ThePressureStaysAtTheLoadUntilTheFlowIsThere) {
  const PumpRegulator slow{0.5, 1e-11, 0.4};
  const double load = 60 * kBar;
  const VectorXd p = regulated_pressure(log, kStandby, {section(load, 3e-4)}, slow, start);
  Index reached = 0;
  while (p[reached] < load) ++reached;
  const Index second = static_cast<Index>(std::lround(1.0 / log.step));
  EXPECT_LT(p[reached + second], load + 0.1 * kMargin);
  EXPECT_NEAR(p[1199], load + kMargin, 0.02 * kMargin);
}

/// What a valve passes, by small explicit steps of the law as pump_regulator.h states it. [Pa]
VectorXd by_small_steps(const MachineSeries& log, const std::vector<OpenSection>& sections,
                        const PumpRegulator& r, const VectorXd& start) {
  VectorXd out = start;
  for (const auto& [first, last] : log.runs) {
    double p = start[first], y = p / r.rest;
    for (Index k = first + 1; k < last; ++k) {
      constexpr int kSteps = 2000;
      const double h = log.step / kSteps;
      for (int i = 0; i < kSteps; ++i) {
        double set = kStandby, taken = 0.0;
        for (const OpenSection& s : sections) {
          if (std::isnan(s.load[k])) continue;
          set = std::max(set, std::min(p, s.load[k]) + s.margin[k]);
          const double drop = std::max(0.0, p - s.load[k]) / (kDropOverMargin * s.margin[k]);
          taken += s.flow[k] / r.capacity * std::sqrt(std::min(1.0, drop));
        }
        const double e = set - p, asked = y + 2.0 * kDamping * e / r.tau,
                     held = std::clamp(asked, 0.0, r.most_flow / r.capacity);
        p += (held - taken - p / r.rest) * h;
        y += (e / (r.tau * r.tau) + (held - asked) / r.tau) * h;
      }
      out[k] = p;
    }
  }
  return out;
}

// In front of closed valves the pump can only stand still; a valve that opens then finds a regulator that has not wound up.
TEST_F(PumpRegulatorTest, ItDoesNotWindUpWhileItsPressureIsTooHigh) {
  const PumpRegulator tight{0.3, 1e-11, 1e9};
  OpenSection late = section(140 * kBar, 1e-3);
  late.load.head(100).setConstant(kNan);
  const VectorXd high = VectorXd::Constant(log.samples(), 150 * kBar);
  log.runs = {{0, 200}};
  const VectorXd p = regulated_pressure(log, kStandby, {late}, tight, high);
  EXPECT_NEAR(p[99], 150 * kBar, 1e-3 * kBar);
  const VectorXd exact = by_small_steps(log, {late}, tight, high);
  for (const Index k : {120, 150, 180}) EXPECT_NEAR(p[k], exact[k], 0.02 * kMargin) << k;
}

// An edge passes the root of its pressure drop, so that a pump of 0.6 of the flow keeps 0.36 of the drop.
TEST_F(PumpRegulatorTest, APumpAtItsLargestFlowKeepsTheDropThatPassesIt) {
  PumpRegulator r{0.1, 1e-11, 1e9};
  r.most_flow = 3e-4;
  const VectorXd p = regulated_pressure(log, kStandby, {section(80 * kBar, 5e-4)}, r, start);
  EXPECT_NEAR(p[1199], 80 * kBar + 0.36 * kDropOverMargin * kMargin, 1e-3 * kBar);
  // the flow that lacks once the load rises is no flow that the regulator has asked for meanwhile
  OpenSection falls = section(80 * kBar, 5e-4);
  falls.flow.tail(1000).setConstant(1e-4);
  log.runs = {{0, 300}};
  const VectorXd exact = by_small_steps(log, {falls}, r, start);
  const VectorXd fallen = regulated_pressure(log, kStandby, {falls}, r, start);
  for (const Index k : {220, 250, 280}) EXPECT_NEAR(fallen[k], exact[k], 0.02 * kMargin) << k;
}

class PumpLineTest : public PumpRegulatorTest {
 protected:
  static constexpr Index kLate = 5;
  static constexpr double kOpening = 0.15;
  const PumpRegulator r{0.3, 2e-11, 0.5};
  const std::vector<double> shape = {r.tau, 5.0, r.rest, kLate* log.step, kOpening, r.capacity};

  std::vector<OpenSection> valves();
};

/// The sections as the pump's lag should make them from the log: a valve is open where its lever was beyond `opening` five samples
/// ago, at the pressure of that side's chamber, with the margin that its lever asked for last there.
std::vector<OpenSection> PumpLineTest::valves() {
  PumpSeries& pump = log.pumps[0];
  pump.standby = kStandby;
  pump.feeds = {0, 1};
  pump.asked = MatrixXd::Constant(log.samples(), 2, kNan);
  std::vector<OpenSection> sections(2, section(kNan, 0.0));
  for (Index i = 0; i < 2; ++i) {
    CylinderSeries& c = log.cylinders[static_cast<std::size_t>(i)];
    const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
    const double gain[] = {0.12, 0.2};  // [m/s] retracting, extending
    OpenSection& s = sections[static_cast<std::size_t>(i)];
    c.speed.setZero();
    for (const auto& [first, last] : log.runs) {
      for (Index k = first; k < last; ++k) {
        if (c.direction[k] != 0)
          pump.asked(k, i) = (c.direction[k] > 0 ? c.pressure_a : c.pressure_b)[k] + kMargin;
        const double valve = c.command[std::max(first, k - kLate)];
        if (std::abs(valve) <= kOpening) continue;
        const double side = valve > 0.0 ? 1.0 : -1.0, beyond = std::abs(valve) - kOpening;
        s.load[k] = (side > 0.0 ? c.pressure_a : c.pressure_b)[k];
        const double speed = gain[side > 0.0 ? 1 : 0] * beyond;
        s.flow[k] = speed * (side > 0.0 ? cylinder.area_piston() : cylinder.area_rod());
        // the log's pump is at its demand of this instant, which need not be above this load
        const double drop = (pump.pressure[k] - s.load[k]) / (kDropOverMargin * kMargin);
        c.speed[k] = side * speed * std::sqrt(std::clamp(drop, 0.0, 1.0));
      }
    }
  }
  return sections;
}

TEST_F(PumpLineTest, ThePumpLagOfTheFlowBalanceFollowsItsDifferentialEquations) {
  const std::vector<OpenSection> sections = valves();
  MatrixXd c;
  ASSERT_TRUE(effect_named("pump_lag").columns(log, {EvidenceKind::kPump, 0}, 0, shape, c));
  const VectorXd& demand = log.pumps[0].demand;
  const VectorXd exact = by_small_steps(log, sections, r, demand) - demand;
  // the implicit step of first order has an error of about h / tau
  EXPECT_LT((c.col(0) - exact).norm(), log.step / r.tau * exact.norm());
}

// What a limit costs by the law that the model has of the pump's line, in proportion to that law's share.
TEST_F(PumpLineTest, AFlowLimitCostsWhatTheBalanceWithItLacks) {
  const std::vector<OpenSection> sections = valves();
  const double share = 1.1;
  std::vector<double> values = {share};
  values.insert(values.end(), shape.begin(), shape.end());
  PumpSeries& pump = log.pumps[0];
  PumpRegulator limited = r;
  double largest = 0.0;
  for (Index k = 0; k < log.samples(); ++k)
    largest = std::max(largest, sections[0].flow[k] + sections[1].flow[k]);
  limited.most_flow = 0.5 * largest;
  MatrixXd c;
  const auto acts = [&](double limit) {
    const std::vector<double> by_line = {limit, 3.0};
    return effect_named("flow_saturation").columns(log, {EvidenceKind::kPump, 0}, 0, by_line, c);
  };
  EXPECT_FALSE(acts(limited.most_flow)) << "the model has no law of the line";
  pump.following = {&effect_named("pump_lag"), 0, values};
  ASSERT_TRUE(acts(limited.most_flow));
  const VectorXd exact = share * (by_small_steps(log, sections, limited, pump.demand) -
                                  by_small_steps(log, sections, r, pump.demand));
  ASSERT_LT(exact.minCoeff(), -0.2 * kMargin);
  EXPECT_LT((c.col(0) - exact).norm(), log.step / r.tau * exact.norm());
  EXPECT_TRUE(c.col(1).isZero(0.0));
  EXPECT_FALSE(acts(10.0 * largest)) << "the limit is never reached";
}

// No variant without its parameters: the flow balance needs capacity and late valves, and no other variant has a capacity.
TEST_F(PumpRegulatorTest, ThePumpLagActsOnlyWithTheParametersOfItsVariant) {
  PumpSeries& pump = log.pumps[0];
  pump.feeds = {0, 1};
  pump.asked = MatrixXd::Constant(log.samples(), 2, 100 * kBar);
  MatrixXd c;
  const auto acts = [&](const std::vector<double>& shape) {
    return effect_named("pump_lag").columns(log, {EvidenceKind::kPump, 0}, 0, shape, c);
  };
  EXPECT_TRUE(acts({0.2, 5.0, 0.4, 0.1, 0.1, 1e-11}));
  EXPECT_TRUE(acts({0.2, 4.0, 0.4, 0.1, 0.1, 0.0}));
  EXPECT_FALSE(acts({0.2, 5.0, 0.4, 0.1, 0.1, 0.0}));
  EXPECT_FALSE(acts({0.2, 5.0, 0.0, 0.0, 0.0, 0.0}));
  EXPECT_FALSE(acts({0.2, 4.0, 0.4, 0.1, 0.1, 1e-11}));
  log.cylinders[1].pressure_b.resize(0);
  EXPECT_FALSE(acts({0.2, 5.0, 0.4, 0.1, 0.1, 1e-11})) << "a chamber is not measured";
  const std::vector<double> whole = {1.0, 0.2, 5.0, 0.4, 0.1, 0.1, 1e-11};
  EXPECT_EQ(effect_named("pump_lag").followed_demand(log, 0, 0, whole, pump.demand).size(), 0);
}

}  // namespace
}  // namespace sparflow::test_support
