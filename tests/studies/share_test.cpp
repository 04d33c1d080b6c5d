#include "studies/share.h"

#include <gtest/gtest.h>

namespace sparflow::bench {
namespace {

// R. G. Newcombe (1998), Stat. Med. 17, 2635-2650, table II, method 10: 20, 12, 2 and 16 of 50 pairs
TEST(PairedDifference, IsThatOfThePublishedExample) {
  const PairedDifference d = paired_difference(20, 12, 2, 16);
  EXPECT_NEAR(d.value, 0.2, 1e-12);
  EXPECT_NEAR(d.lower, 0.0562, 1e-4);
  EXPECT_NEAR(d.upper, 0.3292, 1e-4);
}

TEST(PairedDifference, ExchangingBothSidesExchangesTheLimits) {
  const PairedDifference one = paired_difference(90, 6, 1, 3),
                         other = paired_difference(90, 1, 6, 3);
  EXPECT_NEAR(one.value, -other.value, 1e-12);
  EXPECT_NEAR(one.lower, -other.upper, 1e-12);
  EXPECT_NEAR(one.upper, -other.lower, 1e-12);
}

TEST(PairedDifference, RunsThatAreAllRightLeaveWilsonsUncertainty) {
  const PairedDifference d = paired_difference(100, 0, 0, 0);
  const double wilson = 1.0 - share_limits(100, 100).first;
  EXPECT_EQ(d.value, 0.0);
  EXPECT_NEAR(d.upper, wilson, 1e-12);
  EXPECT_NEAR(d.lower, -wilson, 1e-12);
}

}  // namespace
}  // namespace sparflow::bench
