// `sparflow demo` as a newcomer runs it: fit, compare, optimize, then the loop of trust on the dynamic plant.
#include "tests/cli/cli_fixture.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

class CliDemo : public Cli {};

TEST_F(CliDemo, EndsWithPredictedAndTrueEnergyBeforeAndAfterImprove) {
  const Outcome o = run("demo --out " + at("out"));
  ASSERT_EQ(o.code, 0) << o.err;
  for (const char* words : {"1. Learn", "2. Compare", "3. Optimise", "4. Close the loop",
                            "before improve", "after improve", "Predicted energy is within"})
    EXPECT_THAT(o.out, HasSubstr(words));
  const std::string page = slurp(at("out/index.html"));
  EXPECT_THAT(page, HasSubstr("On the plant: A model of the plant, before and after improve"));
  EXPECT_THAT(page, HasSubstr("Predicted and true energy of each move"));
  // what improve found stands in the model that the demo leaves
  const json improved = test_support::parsed_json(slurp(at("out/improved.json")));
  EXPECT_GT(improved["effects"].size(), 0u);
  EXPECT_EQ(run("compare --model " + at("out/improved.json") + " -l " + kTest).code, 0);
}

}  // namespace
}  // namespace sparflow::test
