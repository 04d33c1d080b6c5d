// Cases of the blind test are drawn from a row's name: the same everywhere, and the same as those of the published tables.
#include "studies/stable_hash.h"

#include <gtest/gtest.h>

namespace sparflow::bench {
namespace {

TEST(StableHash, GivesTheValuesThatThePublishedTablesWereDrawnWith) {
  EXPECT_EQ(stable_hash("clear"), 5606814492162332952U);
  EXPECT_EQ(stable_hash("pairs"), 15464554473149818330U);
  EXPECT_EQ(stable_hash("none"), 7402518939710932964U);
  EXPECT_EQ(stable_hash("small"), 18427721411923125921U);
  EXPECT_EQ(stable_hash("outside"), 11474941028218511228U);
  EXPECT_EQ(stable_hash("fault"), 6457438247996244078U);
  EXPECT_EQ(stable_hash(""), 6142509188972423790U);
  EXPECT_EQ(stable_hash("a row of more than eight"), 4523591542403951237U);
}

}  // namespace
}  // namespace sparflow::bench
