#include "studies/trust/said_effect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sparflow::bench {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

DiagnosedEffect said_with(const char* id, double probability, double with_rivals) {
  DiagnosedEffect e;
  e.id = id;
  e.at = "boom";
  e.probability = probability;
  e.set_probability = with_rivals;
  return e;
}

TEST(SaidEffects, AreThoseThatTheVerdictNamesAndRivalsCountForTheSet) {
  Diagnosis d;
  d.verdict = Verdict::kMissing;
  d.effects = {said_with("leakage", 0.95, 0.95), said_with("valve_lag", 0.6, 0.9),
               said_with("line_loss", 0.1, 0.2)};  // too improbable to be named
  d.effects[1].rivals = {{"sensor_delay:boom", 2.0}};
  const auto hidden = [](const std::string& key) { return key == "sensor_delay:boom"; };
  const std::vector<SaidEffect> said = said_effects(d, hidden);
  ASSERT_EQ(said.size(), 2U);
  EXPECT_EQ(said[0].key, "leakage:boom");
  EXPECT_FALSE(said[0].set_right);
  EXPECT_FALSE(said[1].right);
  EXPECT_TRUE(said[1].set_right);
  d.verdict = Verdict::kUnknown;
  EXPECT_TRUE(said_effects(d, hidden).empty());
}

TEST(Reliability, CountsWhatIsRightInEachRangeOfProbability) {
  const std::vector<SaidEffect> said = {{"a", 0.95, 0.95, true, true},
                                        {"b", 0.93, 0.995, false, true},
                                        {"c", 0.75, 0.75, false, false}};
  const std::string text = reliability_text(said);
  EXPECT_THAT(text, HasSubstr("90 ..  99 %          2     94.0 %   50.0 %"));
  EXPECT_THAT(text, HasSubstr("70 ..  90 %          1     75.0 %    0.0 %"));
  EXPECT_THAT(text, HasSubstr("99 .. 100 %          1     99.5 %  100.0 %"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace sparflow::bench
