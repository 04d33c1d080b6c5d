// selftest as a user runs it.
#include "tests/cli/cli_fixture.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

class CliSelftest : public Cli {};

TEST_F(CliSelftest, HelpAndUsage) {
  const Outcome o = run("selftest --help");
  EXPECT_EQ(o.code, 0);
  EXPECT_THAT(o.out, HasSubstr("sparflow selftest --model"));
  EXPECT_EQ(run("selftest --log " + kTest).code, 2);
  EXPECT_EQ(run("selftest --model " + model() + " --log " + kTest + " --check -1").code, 2);
  EXPECT_EQ(run("selftest --model " + model() + " --log " + kTest + " --reference " + kTest).code,
            2);
  EXPECT_EQ(run("selftest --model nowhere.json --log " + kTest).code, 3);
}

TEST_F(CliSelftest, ReportsWhatTheLogCouldReveal) {
  const Outcome o =
      run("selftest --model " + model() + " --log " + kTrain +
          " --candidates coulomb_friction:boom unmodelled_mass:jib --check 1 --json " +
          at("s.json") + " --report " + at("s.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("checked by injection: 1 of 1 as predicted"));
  const json s = test_support::parsed_json(slurp(at("s.json")));
  ASSERT_EQ(s.at("effects").size(), 2u);
  EXPECT_EQ(s.at("effects").at(0).at("id"), "coulomb_friction");
  EXPECT_EQ(s.at("effects").at(0).at("visibility"), "seen");
  EXPECT_LT(s.at("effects").at(0).at("times_typical").at("power80").get<double>(), 1.0);
  EXPECT_THAT(slurp(at("s.html")), HasSubstr("loader_crane_train.csv"));
}

}  // namespace
}  // namespace sparflow::test
