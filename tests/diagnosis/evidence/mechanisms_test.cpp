#include "diagnosis/evidence/mechanisms.h"

#include <gtest/gtest.h>

namespace sparflow {
namespace {

TEST(Mechanisms, WhatIsSwitchedOffDoesNotActAndIsRecordedAllTheSame) {
  Mechanisms all;
  EXPECT_TRUE(all.act(Mechanism::kMerge));
  EXPECT_FALSE(all.act(Mechanism::kMerge, false)) << "it decides nothing";
  EXPECT_FALSE(all.acted(Mechanism::kMerge)) << "nothing is recorded unless asked";
  all.record();
  all.switch_off(Mechanism::kMerge);
  EXPECT_FALSE(all.enabled(Mechanism::kMerge));
  EXPECT_FALSE(all.act(Mechanism::kMerge));
  EXPECT_TRUE(all.acted(Mechanism::kMerge));
  EXPECT_TRUE(all.enabled(Mechanism::kMinor));
}

TEST(Mechanisms, ADecisionThatNothingChangesIsNotRecorded) {
  Mechanisms one;
  one.record();
  const Mechanisms copy = one;
  copy.act(Mechanism::kMinor, false);
  EXPECT_FALSE(one.acted(Mechanism::kMinor));
  copy.act(Mechanism::kMinor);
  EXPECT_TRUE(one.acted(Mechanism::kMinor)) << "copies share the record";
}

}  // namespace
}  // namespace sparflow
