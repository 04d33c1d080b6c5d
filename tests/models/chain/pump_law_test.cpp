/// The pump's law: exact by hand and against a sorted maximum, smooth against the exact one and finite differences.
#include "models/chain/pump_law.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "models/math/jet.h"
#include "tests/models/numeric.h"

namespace sparflow {
namespace {

using test_support::kDerivativeTolerance;
using test_support::numeric_derivative;

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

TEST(PumpLaw, IsTheLargestDemandOrStandby) {
  PumpLaw law(22e5);
  EXPECT_EQ(law.pressure(), 22e5);
  EXPECT_EQ(law.leader(), -1);
  law.add(3, 20e5);
  EXPECT_EQ(law.pressure(), 22e5);
  EXPECT_EQ(law.leader(), -1);
  law.add(5, 65e5);
  law.add(1, 60e5);
  EXPECT_EQ(law.pressure(), 65e5);
  EXPECT_EQ(law.leader(), 5);
  EXPECT_EQ(pump_pressure(22e5, 65e5), 65e5);
  EXPECT_EQ(pump_pressure(22e5, 20e5), 22e5);
}

TEST(PumpLaw, OfEqualDemandsTheFirstLeadsAndStandbyBeforeAll) {
  PumpLaw law(22e5);
  law.add(0, 22e5);
  EXPECT_EQ(law.leader(), -1);
  law.add(1, 40e5);
  law.add(2, 40e5);
  EXPECT_EQ(law.leader(), 1);
}

TEST(PumpLaw, NotANumberDemandsNothing) {
  PumpLaw law(22e5);
  law.add(0, kNothing);
  law.add(1, 30e5);
  law.add(2, kNothing);
  EXPECT_EQ(law.pressure(), 30e5);
  EXPECT_EQ(law.leader(), 1);
  EXPECT_EQ(pump_pressure(22e5, kNothing), 22e5);
}

/// Demands of a pump's cylinders, NaN where a cylinder demands nothing, and their shares in the smooth law.
template <class T>
struct Pump4 {
  std::vector<int> cylinders;
  std::vector<T> demand, share;
  SmoothPumpPressure<T> at(const SmoothPumpLaw& law) {
    share.assign(demand.size(), T(-1.0));
    return law.pressure<T>(cylinders, [&](int i) -> SmoothDemand<T> {
      const auto k = static_cast<std::size_t>(i);
      if (std::isnan(plain(demand[k]))) return {};
      return {&demand[k], &share[k]};
    });
  }
};

TEST(SmoothPumpLaw, ExceedsTheExactLawByAtMostItsBound) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 200e5);
  const std::vector<int> cylinders = {2, 0, 3};  // the pump does not feed cylinder 1
  for (int trial = 0; trial < 200; ++trial) {
    Pump4<double> pump{cylinders, {}, {}};
    for (int i = 0; i < 4; ++i) pump.demand.push_back(uniform(random));
    if (trial % 3 == 0) pump.demand[0] = kNothing;
    PumpLaw exact(25e5);
    for (const int i : cylinders) exact.add(i, pump.demand[static_cast<std::size_t>(i)]);
    for (const double beta : {1e2, 0.3e5, 1e5, 20e5}) {
      const SmoothPumpPressure<double> soft = pump.at({25e5, beta});
      EXPECT_GE(soft.pressure, exact.pressure());
      // four terms; 1e-7 Pa is the rounding of pressures of 2e7 Pa
      EXPECT_LE(soft.pressure, exact.pressure() + beta * std::log(4.0) + 1e-7);
      EXPECT_EQ(soft.leader, exact.leader());
      double sum = soft.standby_share;
      for (const int i : cylinders) {
        const auto k = static_cast<std::size_t>(i);
        if (!std::isnan(pump.demand[k])) sum += pump.share[k];
      }
      EXPECT_NEAR(sum, 1.0, 1e-14);
      EXPECT_EQ(pump.share[1], -1.0) << "a cylinder of another pump";
    }
  }
}

TEST(SmoothPumpLaw, IsTheLogarithmOfTheSumOfExponentials) {
  Pump4<double> pump{{0, 1}, {31e5, 30e5}, {}};
  const double beta = 1e5;
  const SmoothPumpPressure<double> soft = pump.at({29e5, beta});
  const double sum = std::exp(29.0) + std::exp(31.0) + std::exp(30.0);
  EXPECT_NEAR(soft.pressure, beta * std::log(sum), 1e-7);
  EXPECT_NEAR(pump.share[0], std::exp(31.0) / sum, 1e-14);
  EXPECT_NEAR(pump.share[1], std::exp(30.0) / sum, 1e-14);
  EXPECT_NEAR(soft.standby_share, std::exp(29.0) / sum, 1e-14);
}

TEST(SmoothPumpLaw, JetsCarryItsDerivatives) {
  const double beta = 1.5;
  const std::vector<double> at = {31.0, 30.0, 27.0};
  const auto value = [&](const std::vector<double>& demand) {
    Pump4<double> pump{{0, 1, 2}, demand, {}};
    return pump.at({29.0, beta}).pressure;
  };
  const auto share = [&](const std::vector<double>& demand, std::size_t k) {
    Pump4<double> pump{{0, 1, 2}, demand, {}};
    pump.at({29.0, beta});
    return pump.share[k];
  };
  Pump4<Jet> pump{{0, 1, 2}, {}, {}};
  for (int i = 0; i < 3; ++i)
    pump.demand.push_back(Jet::variable(at[static_cast<std::size_t>(i)], i, 3));
  const SmoothPumpPressure<Jet> soft = pump.at({29.0, beta});
  EXPECT_DOUBLE_EQ(soft.pressure.value, value(at));
  EXPECT_EQ(soft.leader, 0);
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto moved = [&](double x) {
      std::vector<double> demand = at;
      demand[k] = x;
      return demand;
    };
    EXPECT_NEAR(soft.pressure.gradient(i), share(at, k), 1e-14) << "the share is the derivative";
    EXPECT_NEAR(soft.pressure.gradient(i),
                numeric_derivative([&](double x) { return value(moved(x)); }, at[k]),
                kDerivativeTolerance);
    for (int j = 0; j < 3; ++j) {
      const auto other = [&](double x) { return share(moved(x), static_cast<std::size_t>(j)); };
      EXPECT_NEAR(soft.pressure.hessian(i, j), numeric_derivative(other, at[k]),
                  kDerivativeTolerance);
    }
  }
}

}  // namespace
}  // namespace sparflow
