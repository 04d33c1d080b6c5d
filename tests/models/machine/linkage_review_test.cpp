#include "models/machine/linkage_review.h"

#include <gtest/gtest.h>

#include "models/files/machine_file.h"
#include "models/machine/linkage.h"

namespace sparflow {
namespace {

Machine bundled(const std::string& name) {
  return load_machine(SPARFLOW_SOURCE_DIR "/problems/machines/" + name + ".yaml");
}

TEST(LinkageReview, NoBundledMachineIsDoubted) {
  int seen = 0;
  for (const char* name :
       {"loader_crane", "hmf_2020_k4", "excavator", "swing_crane", "three_axis"}) {
    const Machine machine = bundled(name);
    for (int i = 0; i < machine.cylinder_count(); ++i, ++seen)
      EXPECT_TRUE(linkage_doubts(machine, i).empty()) << name << " " << i;
  }
  EXPECT_GT(seen, 12);
}

TEST(LinkageReview, AWrongBranchIsDoubtedByItsStrokeOrByItsLeverArm) {
  for (const bool with_stroke : {true, false}) {
    Machine machine = bundled("hmf_2020_k4");
    for (int i = 0; i < 2; ++i) {
      Cylinder& c = machine.cylinders[static_cast<std::size_t>(i)];
      std::get<FourBarLinkage>(c.linkage).branch *= -1;
      if (!with_stroke) c.stroke.reset();
      const std::vector<std::string> doubts = linkage_doubts(machine, i);
      ASSERT_FALSE(doubts.empty()) << c.name;
      EXPECT_NE(doubts.front().find("wrong branch"), std::string::npos);
      EXPECT_NE(doubts.front().find(with_stroke ? "stroke" : "lever arm"), std::string::npos)
          << doubts.front();
    }
  }
}

TEST(LinkageReview, ALengthThatNoCylinderChangesSoMuchIsDoubted) {
  Machine machine = bundled("loader_crane");
  auto& pins = std::get<PinsLinkage>(machine.cylinders[0].linkage);
  // Both pins twice as far from the joint and the barrel's nearly on the circle: drawn in it is short.
  const double before = cylinder_length(machine, 0, machine.joints[0].position.lo);
  pins.parent_pin = machine.joints[0].origin * (0.98 * pins.child_pin);
  EXPECT_LT(cylinder_length(machine, 0, machine.joints[0].position.lo), 0.5 * before);
  const std::vector<std::string> doubts = linkage_doubts(machine, 0);
  ASSERT_EQ(doubts.size(), 1u);
  EXPECT_NE(doubts[0].find("at most 2 times as long"), std::string::npos) << doubts[0];
}

TEST(LinkageReview, SamplesAreThoseOfTheLinkageAndTheStaticForce) {
  const Machine machine = bundled("loader_crane");
  const Eigen::VectorXd middle = middle_posture(machine);
  const std::vector<LinkageSample> samples = linkage_samples(machine, 0, middle, 1000.0, 3);
  ASSERT_EQ(samples.size(), 3u);
  EXPECT_EQ(samples[0].q, machine.joints[0].position.lo);
  EXPECT_EQ(samples[2].q, machine.joints[0].position.hi);
  for (const LinkageSample& s : samples) {
    EXPECT_DOUBLE_EQ(s.length, cylinder_length(machine, 0, s.q));
    EXPECT_DOUBLE_EQ(s.stroke, stroke_at(machine, 0, s.q));
    EXPECT_GT(s.force_loaded, s.force_empty) << "the load presses on the boom";
    // dx/dq by central differences, error of third order in 1e-5
    const double slope =
        (cylinder_length(machine, 0, s.q + 1e-5) - cylinder_length(machine, 0, s.q - 1e-5)) / 2e-5;
    EXPECT_NEAR(s.rate, slope, 1e-8);
  }
}

}  // namespace
}  // namespace sparflow
