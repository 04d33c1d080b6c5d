#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/report/motion_pages/motion_page.h"

namespace sparflow {
namespace {

TEST(MotionText, ComparesWithSeedsByName) {
  OptimizeResult r;
  r.energy.total = 80e3;
  EXPECT_EQ(against_seeds(r), "") << "no seed keeps the limits";
  r.best_seed_energy = 100e3;
  r.best_seed_name = "RRT-Connect 2";
  EXPECT_EQ(against_seeds(r),
            "20 % less than the best seed, RRT-Connect 2 (100.0 kJ) in the same time");
  // A straight line that is also the best seed is named once.
  r.straight_line_energy = r.nearest_line_energy = 100e3;
  r.straight_line_name = r.best_seed_name = "straight line 1";
  EXPECT_EQ(
      against_seeds(r),
      "20 % less than the straight joint line to the nearest goal configuration (100.0 kJ) in the "
      "same time");
  r.straight_line_energy = r.best_seed_energy = 81e3;
  EXPECT_THAT(against_seeds(r),
              testing::EndsWith("and 1.2 % less than the cheapest straight line (81.0 kJ) in the "
                                "same time"));
  r.best_seed_energy = 79e3;
  r.best_seed_name = "BIT* 3";
  EXPECT_THAT(against_seeds(r),
              testing::HasSubstr("1.3 % more than the best seed, BIT* 3 (79.0 kJ)"));
  r.best_seed_energy = 80.02e3;
  EXPECT_THAT(against_seeds(r), testing::HasSubstr("as much as the best seed, BIT* 3 (80.0 kJ)"));
}

TEST(MotionText, ConstantPressureIsSaid) {
  CraneModel model;
  EXPECT_EQ(constant_pressure_note(model), "") << "no pump, nothing to say";
  model.machine.pumps.resize(2);
  model.machine.pumps[0].type = PumpType::kConstantPressure;
  EXPECT_EQ(constant_pressure_note(model), "") << "one of two senses the load";
  model.machine.pumps[1].type = PumpType::kConstantPressure;
  EXPECT_THAT(constant_pressure_note(model), testing::HasSubstr("depends on the strokes alone"));
}

TEST(MotionText, HeadlineTellsTheGapAndWhatTheModelHasNotLearned) {
  OptimizeResult r;
  EXPECT_EQ(motion_headline(r), "no motion was found");
  r.motion.t = Eigen::Vector2d(0.0, 16.0);
  r.duration = 16.0;
  r.energy.total = 82e3;
  r.energy.moving_share_outside_data = 0.4;
  EXPECT_EQ(motion_headline(r), "82.0 kJ in 16.00 s") << "no bound, and most was learned";
  r.lower_bound = 80e3;
  EXPECT_NEAR(bound_gap(r), 0.025, 1e-12);  // rounding
  EXPECT_THAT(motion_headline(r),
              testing::HasSubstr("; 2.5 % above the estimated bound of 80.0 kJ"));
  r.energy.moving_share_outside_data = 0.67;
  EXPECT_THAT(motion_headline(r),
              testing::EndsWith("; most of the motion (67 % of the moving time) lies outside what "
                                "the model has learned"));
}

}  // namespace
}  // namespace sparflow
