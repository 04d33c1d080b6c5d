// A rod that is held at rest: corrected where the tip is away, left alone where it is not.
#include "simulator/controllers/rest_correction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace sparflow::control {
namespace {

constexpr double kStep = 0.02;    // [s]
constexpr double kFull = 0.1;     // [m/s]
constexpr double kTipWay = 10.0;  // of a boom

/// A rod behind a valve that needs more than it was learned to need, and follows late.
struct LateRod {
  double error = 0.0, speed = 0.0;
  double overlap = 0.015;  // share of the full speed that is asked for without any flow
  RestCorrection correction;
  int open = 0;  // samples with an open valve

  void run(double seconds, double disturbance = 0.0) {
    for (double t = 0.0; t < seconds; t += kStep) {
      const double moved = disturbance * std::sin(2.0 * std::numbers::pi * t / 2.5);
      const double asked = correction.speed({error + moved, speed, kTipWay, kFull, kStep}, 1.4);
      if (asked != 0.0) ++open;
      const double flows = std::max(0.0, std::abs(asked) - overlap * kFull);
      speed += kStep / 0.15 * (std::copysign(flows, asked) - speed);
      error -= speed * kStep;
    }
  }
};

TEST(RestCorrection, BringsTheTipBackThoughTheDeadBandWasLearnedTooSmall) {
  for (const double error : {0.0015, -0.0015, 0.004}) {  // 15 and 40 mm at the tip
    LateRod rod;
    rod.error = error;
    rod.correction.moving();
    rod.run(4.0);
    EXPECT_LT(kTipWay * std::abs(rod.error), 0.005) << error;
    rod.open = 0;
    rod.run(4.0);
    EXPECT_EQ(rod.open, 0) << error;  // and the valve stays closed
  }
}

TEST(RestCorrection, LeavesASmallErrorAlone) {
  LateRod rod;
  rod.error = 0.0004;  // 4 mm at the tip
  rod.correction.moving();
  rod.run(4.0);
  EXPECT_EQ(rod.open, 0);
  EXPECT_DOUBLE_EQ(rod.error, 0.0004);
}

TEST(RestCorrection, IsNotBegunByALoadThatSwings) {
  LateRod rod;
  rod.run(10.0, 0.001);  // 10 mm at the tip to and fro in 2.5 s
  EXPECT_EQ(rod.open, 0);
}

TEST(RestCorrection, GoesByTheWayOfTheTip) {
  RestCorrection rack, telescope;
  rack.moving();
  telescope.moving();
  EXPECT_GT(rack.speed({0.001, 0.0, 40.0, kFull, kStep}, 1.4), 0.0);
  EXPECT_EQ(telescope.speed({0.001, 0.0, 1.0, kFull, kStep}, 1.4), 0.0);
}

}  // namespace
}  // namespace sparflow::control
