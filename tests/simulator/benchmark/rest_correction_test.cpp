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
  double stiction = 0.0;   // share of the full speed that is asked for when a resting rod begins
  double tip_way = kTipWay, lag = 0.15;  // [-], [s]
  RestCorrection correction;
  int open = 0;  // samples with an open valve

  void run(double seconds, double disturbance = 0.0) {
    for (double t = 0.0; t < seconds; t += kStep) {
      const double moved = disturbance * std::sin(2.0 * std::numbers::pi * t / 2.5);
      const double asked = correction.speed({error + moved, speed, tip_way, kFull, kStep}, 1.4);
      if (asked != 0.0) ++open;
      const bool stuck = std::abs(speed) < 1e-4 && std::abs(asked) < stiction * kFull;
      const double flows = stuck ? 0.0 : std::max(0.0, std::abs(asked) - overlap * kFull);
      speed += kStep / lag * (std::copysign(flows, asked) - speed);
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

/// Samples with an open valve in the second minute of a rack whose lever has risen beyond the dead band when friction lets
/// go: each correction moves the tip to the other side.
int open_in_the_second_minute(double calming) {
  RestCorrectionOptions options;
  options.calming = calming;
  LateRod rack;
  rack.correction = RestCorrection(options);
  rack.error = 0.001;
  rack.correction.moving();
  rack.stiction = 0.1;
  rack.tip_way = 40.0;
  rack.lag = 0.4;
  rack.run(60.0);
  rack.open = 0;
  rack.run(60.0);
  return rack.open;
}

TEST(RestCorrection, CalmsDownWhereEachOneOvershoots) {
  EXPECT_GT(open_in_the_second_minute(1.0), 100);
  EXPECT_EQ(open_in_the_second_minute(RestCorrectionOptions().calming), 0);
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
