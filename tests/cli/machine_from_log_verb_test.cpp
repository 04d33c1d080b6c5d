// `sparflow machine --from-log`: what is found is written, what is not is asked for, and other verbs refuse open values.
#include "tests/cli/cli_fixture.h"

namespace sparflow::test {
namespace {

class MachineFromLogVerb : public Cli {
 protected:
  /// The bundled crane with one text exchanged by another.
  void sketch(const std::string& known, const std::string& blank) const {
    std::string text = slurp(kCrane);
    const std::size_t at = text.find(known);
    ASSERT_NE(at, std::string::npos);
    write("sketch.yaml", text.replace(at, known.size(), blank));
  }
};

TEST_F(MachineFromLogVerb, WritesAMachineThatOtherVerbsRead) {
  sketch("mass: 560, cog: [1.25, 0, 0.05]", "mass: 560, cog: unknown");
  Outcome o =
      run("machine " + at("sketch.yaml") + " --from-log " + kTrain + " -t " + kTest + " -o " +
          at("machine.yaml") + " --json " + at("found.json") + " --report " + at("page.html"));
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  EXPECT_THAT(o.out, HasSubstr("the machine is complete"));
  EXPECT_THAT(o.out, HasSubstr("held out"));
  const json found = json::parse(slurp(at("found.json")));
  EXPECT_TRUE(found["complete"].get<bool>());
  EXPECT_EQ(found["held_out"].size(), 3u);
  EXPECT_THAT(slurp(at("page.html")), HasSubstr("Motions that took no part"));
  EXPECT_THAT(slurp(at("machine.yaml")), HasSubstr("# from the log"));
  EXPECT_EQ(run("machine " + at("machine.yaml")).code, 0);
}

TEST_F(MachineFromLogVerb, AsksByNameAndLeavesTheQuestionInTheFile) {
  sketch("bore: 0.180", "bore: unknown\n    length_at_zero_stroke: unknown");
  Outcome o =
      run("machine " + at("sketch.yaml") + " --from-log " + kTrain + " -o " + at("machine.yaml"));
  EXPECT_EQ(o.code, 4) << o.err << o.out;
  EXPECT_THAT(o.out, HasSubstr("open: cylinders[boom].length_at_zero_stroke: "));
  EXPECT_THAT(slurp(at("machine.yaml")), HasSubstr("# OPEN: "));
  const std::string compare = "compare -l " + kTrain + " -m ";
  for (const std::string& verb : {std::string("machine "), compare, std::string("simulate -m ")}) {
    o = run(verb + at("machine.yaml") + (verb[0] == 's' ? " -o " + at("x.csv") : ""));
    EXPECT_EQ(o.code, 3) << verb;
    EXPECT_THAT(o.err, HasSubstr("is left open (unknown)")) << verb;
    EXPECT_THAT(o.err, HasSubstr("--from-log")) << verb;
  }
}

TEST_F(MachineFromLogVerb, WrongUseIsSaid) {
  EXPECT_EQ(run("machine " + kCrane + " -o " + at("m.yaml")).code, 2);
  EXPECT_EQ(run("machine " + kCrane + " --from-log " + kTrain + " -t " + kTrain).code, 2);
  EXPECT_EQ(run("machine " + kCrane + " --from-log " + kTrain + " -o " + kTrain).code, 2);
  EXPECT_EQ(run("machine " + kCrane + " --from-log " + at("none.csv")).code, 3);
}

}  // namespace
}  // namespace sparflow::test
