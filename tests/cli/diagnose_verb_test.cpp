// diagnose, extend and improve as a user runs them: usage, exit codes, JSON keys, files that can be read back.
#include <algorithm>
#include <sstream>
#include <vector>

#include "tests/cli/cli_fixture.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

class CliDiagnose : public Cli {
 protected:
  /// A bundled log with dry friction on the boom cylinder: `bar` more on its bore side extending, less retracting.
  std::string with_friction(const std::string& log, const std::string& name, double bar) const {
    std::istringstream in(slurp(log));
    std::string line, out;
    std::getline(in, line);
    std::vector<std::string> header = fields(line);
    const auto column = [&](const std::string& key) {
      return std::find(header.begin(), header.end(), key) - header.begin();
    };
    const auto u = column("u_boom"), a = column("pA_boom_bar");
    out = line + "\n";
    while (std::getline(in, line)) {
      std::vector<std::string> row = fields(line);
      const double command = std::stod(row[static_cast<std::size_t>(u)]);
      double p = std::stod(row[static_cast<std::size_t>(a)]);
      p += command > 0.0 ? bar : command < 0.0 ? -bar : 0.0;
      row[static_cast<std::size_t>(a)] = std::to_string(p);
      for (std::size_t i = 0; i < row.size(); ++i) out += (i > 0 ? "," : "") + row[i];
      out += "\n";
    }
    write(name, out);
    return at(name);
  }

 private:
  static std::vector<std::string> fields(const std::string& line) {
    std::vector<std::string> out;
    std::istringstream in(line);
    for (std::string field; std::getline(in, field, ',');) out.push_back(field);
    return out;
  }
};

TEST_F(CliDiagnose, AFolderOfManyLogsIsOneLogOfTheirSize) {
  // Twelve pieces of the bundled log, as a logger writes them hour by hour; a shell gives them all by one pattern.
  std::istringstream in(slurp(kTest));
  std::string header, line, logs;
  std::getline(in, header);
  int rows = 0, files = 0;
  while (std::getline(in, line)) {
    const std::string name = "piece_" + std::to_string(files) + ".csv";
    std::string text = header + "\n" + line + "\n";
    for (int k = 1; k < 500 && std::getline(in, line); ++k) text += line + "\n";
    rows += static_cast<int>(std::count(text.begin(), text.end(), '\n')) - 1;
    write(name, text);
    logs += " " + at(name);
    ++files;
  }
  ASSERT_EQ(files, 12);
  const std::string model = kData + "/models/loader_crane.json";
  const Outcome o = run("diagnose --model " + model + " --log" + logs + " --json " + at("d.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(test_support::parsed_json(slurp(at("d.json"))).at("verdict"), "none");
  const Outcome compared =
      run("compare --model " + model + " --log" + logs + " --json " + at("c.json"));
  ASSERT_EQ(compared.code, 0) << compared.err;
  EXPECT_EQ(test_support::parsed_json(slurp(at("c.json"))).at("samples"), rows);
}

TEST_F(CliDiagnose, HelpHasExamples) {
  for (const char* verb : {"diagnose", "extend", "improve"}) {
    const Outcome o = run(std::string(verb) + " --help");
    EXPECT_EQ(o.code, 0) << verb;
    EXPECT_THAT(o.out, HasSubstr("Examples:")) << verb;
    EXPECT_THAT(o.out, HasSubstr(std::string("sparflow ") + verb)) << verb;
  }
}

TEST_F(CliDiagnose, WrongUsageExitsWithTwo) {
  EXPECT_EQ(run("diagnose --log " + kTest).code, 2);
  EXPECT_EQ(run("improve --model " + model() + " --log " + kTest).code, 2);  // no output
  Outcome o = run("extend --model " + model() + " --log " + kTest + " -o " + at("m.json"));
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("--add"));
  EXPECT_THAT(o.err, HasSubstr("--remove"));
  o = run("diagnose --model " + model() + " --log " + kTest + " --test " + kTest);
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("given as --log and as --test"));
  o = run("improve --model " + model() + " --log " + kTest + " -o " + model());
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("overwrite"));
}

TEST_F(CliDiagnose, BadInputExitsWithThree) {
  const std::string extend =
      "extend --model " + model() + " --log " + kTest + " -o " + at("m.json") + " --add ";
  Outcome o = run(extend + "colomb_friction:boom");
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("coulomb_friction"));
  o = run(extend + "coulomb_friction:bom");
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("coulomb_friction:boom"));
  o = run("extend --model " + model() + " --log " + kTest + " -o " + at("m.json") +
          " --remove coulomb_friction:boom");
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("no effects to remove"));
  EXPECT_EQ(run("diagnose --model nowhere.json --log " + kTest).code, 3);
  EXPECT_EQ(run("diagnose --model " + model() + " --log nowhere.csv").code, 3);
  EXPECT_FALSE(fs::exists(at("m.json")));
}

TEST_F(CliDiagnose, FrictionIsNamedAddedAndRemoved) {
  const std::string log = with_friction(kTrain, "train.csv", 6.0);
  const std::string test = with_friction(kTest, "test.csv", 6.0);
  // Few candidates suffice, because tests of the diagnosis search the whole catalogue; an effect without a place stands
  // for all its places.
  const std::string few = " --candidates coulomb_friction unmodelled_mass:jib";
  Outcome o = run("diagnose --model " + model() + " --log " + log + few + " --json " +
                  at("d.json") + " --report " + at("d.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.err, HasSubstr("reference for forces only"));
  json d = test_support::parsed_json(slurp(at("d.json")));
  EXPECT_EQ(d.at("verdict"), "missing");
  EXPECT_EQ(d.at("effects").at(0).at("id"), "coulomb_friction");
  EXPECT_EQ(d.at("effects").at(0).at("at"), "boom");
  EXPECT_THAT(slurp(at("d.html")), HasSubstr("train.csv"));

  o = run("improve --model " + model() + " --log " + log + " --test " + test + few + " -o " +
          at("m2.json") + " --json " + at("i.json") + " --report " + at("i.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  json i = test_support::parsed_json(slurp(at("i.json")));
  ASSERT_EQ(i.at("steps").size(), 1u);
  EXPECT_EQ(i.at("steps").at(0).at("added"), "coulomb_friction:boom");
  const json& force = i.at("steps").at(0).at("stages").at("force").at("boom");
  EXPECT_LT(force.at("after").at("rmse").get<double>(),
            0.5 * force.at("before").at("rmse").get<double>());
  EXPECT_FALSE(i.at("stopped_because").get<std::string>().empty());
  EXPECT_THAT(slurp(at("m2.json")), HasSubstr("coulomb_friction"));
  EXPECT_THAT(slurp(at("i.html")), HasSubstr("Error after each step"));

  // The other verbs read the same model.
  o = run("compare --model " + at("m2.json") + " --log " + test + " --json " + at("c.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  json c = test_support::parsed_json(slurp(at("c.json")));
  EXPECT_NEAR(c.at("stages").at("force").at("boom").at("rmse").get<double>(),
              force.at("after").at("rmse").get<double>(),
              1.0);  // [N] both verbs run the same computation

  o = run("extend --model " + at("m2.json") + " --remove coulomb_friction:boom --log " + log +
          " --test " + test + " -o " + at("m3.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("removed"));
}

TEST_F(CliDiagnose, AnEffectOfTheUsersOwnIsFoundAndCarried) {
  // A copy of the catalogue's friction, which is not among the --candidates here.
  write("mine.yaml",
        "effects:\n"
        "  - id: seal_drag\n"
        "    stage: force\n"
        "    law: Fc * direction\n"
        "    parameters:\n"
        "      Fc: {unit: kN, bounds: [0, 60], typical: 8}\n");
  const std::string log = with_friction(kTrain, "train.csv", 6.0);
  const std::string own = " --effects " + at("mine.yaml");
  const std::string few = " --candidates seal_drag:boom unmodelled_mass:jib";
  const std::string diagnose = "diagnose --model " + model() + " --log " + log + few;
  EXPECT_EQ(run(diagnose).code, 3);  // without --effects seal_drag is unknown
  Outcome o = run(diagnose + own + " --json " + at("d.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json effect = test_support::parsed_json(slurp(at("d.json"))).at("effects").at(0);
  EXPECT_EQ(effect.at("id"), "seal_drag");
  EXPECT_EQ(effect.at("parameters").at(0).at("unit"), "kN");

  o = run("extend --model " + model() + " --add seal_drag:boom --log " + log + own + " -o " +
          at("m2.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(slurp(at("m2.json")), HasSubstr("\"user_effects\": ["));
  // The model file contains the effect.
  o = run("extend --model " + at("m2.json") + " --remove seal_drag:boom --log " + log + " -o " +
          at("m3.json"));
  EXPECT_EQ(o.code, 0) << o.err;
  // Another law with the same name is refused.
  write("other.yaml",
        "effects:\n"
        "  - {id: seal_drag, stage: force, law: B * v, parameters: {B: {unit: N s/m, bounds: [0, "
        "1e6], typical: 1e4}}}\n");
  o = run("diagnose --model " + at("m2.json") + " --log " + log + " --effects " + at("other.yaml"));
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("other.yaml:2"));
  EXPECT_THAT(o.err, HasSubstr("seal_drag_2"));
  o = run("extend --model " + model() + " --add seal_drag:boom --log " + log + own + " -o " +
          at("mine.yaml"));
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("overwrite"));
}

}  // namespace
}  // namespace sparflow::test
