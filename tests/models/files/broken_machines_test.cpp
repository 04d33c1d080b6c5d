// Wrong machine files, each with the whole message that the user sees.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cctype>
#include <filesystem>
#include <ostream>

#include "models/files/machine_file.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

// clang-format off
const std::string kGood =
/* 1*/ "name: crane\n"
/* 2*/ "gravity: [0, 0, -9.81]\n"
/* 3*/ "joints:\n"
/* 4*/ "  - {name: boom, type: revolute, parent: base, origin: {xyz: [0, 0, 2]}, axis: [0, -1, 0], position: [-0.2, 1.3], velocity: [-0.1, 0.1], acceleration: [-0.3, 0.3]}\n"
/* 5*/ "  - {name: jib, type: revolute, parent: boom, origin: {xyz: [3.4, 0, 0]}, axis: [0, -1, 0], position: [-2.3, 0.05], velocity: [-0.2, 0.2], acceleration: [-0.4, 0.4]}\n"
/* 6*/ "  - {name: ext, type: prismatic, parent: jib, origin: {xyz: [3, 0, 0]}, axis: [1, 0, 0], position: [0, 6], velocity: [-0.3, 0.3], acceleration: [-0.6, 0.6]}\n"
/* 7*/ "tip: {joint: ext, xyz: [0, 0, 0]}\n"
/* 8*/ "links:\n"
/* 9*/ "  - {name: inner, joint: boom, mass: 780, cog: [1.5, 0, 0.1], inertia: 820}\n"
/*10*/ "  - {name: stage, joint: jib, slides_with: ext, fraction: 0.5, mass: 150, cog: [1.6, 0, 0], inertia: 105}\n"
/*11*/ "cylinders:\n"
/*12*/ "  - name: boom\n"
/*13*/ "    joint: boom\n"
/*14*/ "    bore: 0.18\n"
/*15*/ "    rod: 0.115\n"
/*16*/ "    linkage: {type: pins, barrel: {frame: base, xyz: [0.4, 0, 0.5]}, rod: {frame: boom, xyz: [0.65, 0, -0.2]}}\n"
/*17*/ "  - name: jib\n"
/*18*/ "    joint: jib\n"
/*19*/ "    bore: 0.15\n"
/*20*/ "    rod: 0.1\n"
/*21*/ "    linkage:\n"
/*22*/ "      type: four_bar\n"
/*23*/ "      barrel:  {frame: boom, xyz: [1.2, 0, -0.35]}\n"
/*24*/ "      rocker:  {frame: boom, xyz: [3.2, 0, 0], length: 0.6}\n"
/*25*/ "      coupler: {frame: jib, xyz: [0.3, 0, 0], length: 0.5}\n"
/*26*/ "      branch: -1\n"
/*27*/ "  - {name: ext, joint: ext, stages: 4, bore: 0.07, rod: 0.05, linkage: {type: direct}}\n"
/*28*/ "pumps:\n"
/*29*/ "  - {name: main, feeds: [boom, jib, ext], max_flow_lpm: 120, max_pressure_bar: 310, standby_bar: 22}\n"
/*30*/ "valves:\n"
/*31*/ "  - {cylinder: boom, max_flow_lpm: {extend: 100, retract: 65}}\n"
/*32*/ "  - {cylinder: jib, max_flow_lpm: {extend: 85, retract: 50}}\n"
/*33*/ "  - {cylinder: ext, max_flow_lpm: {extend: 75, retract: 40}}\n";
// clang-format on

struct Broken {
  std::string what;
  std::string find,
      replace;  ///< one edit of the good file; `find` empty: `replace` is the whole file
  std::string message;
};

void PrintTo(const Broken& broken, std::ostream* out) { *out << broken.what; }

/// `text` with its one occurrence of `find` replaced.
std::string with(std::string text, const std::string& find, const std::string& replace) {
  const std::size_t at = text.find(find);
  EXPECT_NE(at, std::string::npos) << find;
  EXPECT_EQ(text.find(find, at + 1), std::string::npos) << "edits two places: " << find;
  return text.replace(at, find.size(), replace);
}

std::string edited(const Broken& broken) {
  return broken.find.empty() ? broken.replace : with(kGood, broken.find, broken.replace);
}

/// "rod thicker than bore" becomes the test's name rod_thicker_than_bore.
template <class Case>
std::string case_name(const testing::TestParamInfo<Case>& info) {
  std::string name = info.param.what;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
}

class BrokenMachine : public testing::TestWithParam<Broken> {};

TEST_P(BrokenMachine, IsRefusedWithPlaceAndReason) {
  const Broken& broken = GetParam();
  try {
    parse_machine(edited(broken), "crane.yaml", "");
    FAIL() << "accepted: " << broken.what;
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), broken.message);
  }
}

TEST(GoodMachine, TheUneditedFileIsAccepted) {
  std::vector<std::string> warnings;
  EXPECT_NO_THROW(parse_machine(kGood, "crane.yaml", "", &warnings));
  EXPECT_TRUE(warnings.empty());
}

const std::vector<Broken> kText = {
    {"empty file", "", "# nothing\n", "crane.yaml: the file is empty; expected `key: value` lines"},
    {"not a mapping", "", "- a\n- b\n",
     "crane.yaml:1:1: got a list of 2, expected a machine: name, joints, links, cylinders, pumps, "
     "valves"},
    {"two documents", "", kGood + "---\nname: other\n",
     "crane.yaml:35:1: a second document starts here; remove the `---` line"},
    {"tab", "    bore: 0.18\n", "\tbore: 0.18\n",
     "crane.yaml:14:1: a tab indents this line; YAML needs spaces"},
    {"brace not closed", "xyz: [0, 0, 0]}", "xyz: [0, 0, 0]",
     "crane.yaml:8:1: a `{` opened before here is not closed, or a comma is missing; write {key: "
     "value, key: value}"},
    {"bracket not closed", "gravity: [0, 0, -9.81]", "gravity: [0, 0, -9.81",
     "crane.yaml:3:7: a `[` opened before here is not closed, or a comma is missing; write [1, 2, "
     "3]"},
    {"colon in text", "name: crane", "name: crane: small",
     "crane.yaml:1:12: a colon where none can stand; check the indentation or put the text in "
     "quotes"},
    {"indentation", "    rod: 0.115\n", "     rod: 0.115\n",
     "crane.yaml:15:9: a colon where none can stand; check the indentation or put the text in "
     "quotes"},
    {"tab behind a key", "    rod: 0.115\n", "\t    rod: 0.115\n",
     "crane.yaml:15:1: a tab indents this line; YAML needs spaces"},
    {"first key indented", "name: crane", " name: crane",
     "crane.yaml:2:1: this line is indented less than the first key; check its indentation: every "
     "key of the file starts in the first column"},
    {"too little indentation", "    rod: 0.115\n", "   rod: 0.115\n",
     "crane.yaml:15:4: this line fits no list; check its indentation: every `-` of a list starts "
     "in "
     "the same column, every key below it in the column of its first key"},
    {"alias in text", "name: crane", "name: *crane",
     "crane.yaml:1:7: not readable as YAML (the referenced anchor is not defined); if this is "
     "plain "
     "text, put it in single quotes ('...')"},
    {"quote not closed", "name: crane", "name: \"crane",
     "crane.yaml:35:1: a quoted text opened before here is not closed; add the missing quote"},
    {"unknown top key",
     "valves:", "valve:", "crane.yaml:30:1: unknown key \"valve\"; did you mean \"valves\"?"},
    {"unknown key without a near one", "valves:", "hydraulics:",
     "crane.yaml:30:1: unknown key \"hydraulics\"; known here: name, gravity, joints, kinematics, "
     "tip, links, cylinders, pumps, valves"},
    {"unknown key in a cylinder", "    bore: 0.18", "    bor: 0.18",
     "crane.yaml:14:5: cylinders[boom]: unknown key \"bor\"; did you mean \"bore\"?"},
    {"unit left out of a key", "max_flow_lpm: 120", "max_flow: 120",
     "crane.yaml:29:43: pumps[main]: unknown key \"max_flow\"; did you mean \"max_flow_lpm\"?"},
    {"wrong unit in a key", "max_pressure_bar: 310", "max_pressure_Pa: 31e6",
     "crane.yaml:29:62: pumps[main]: unknown key \"max_pressure_Pa\"; did you mean "
     "\"max_pressure_bar\"?"},
    {"duplicate key", "    bore: 0.18\n", "    bore: 0.18\n    bore: 0.2\n",
     "crane.yaml:15:5: cylinders[boom]: key \"bore\" occurs here and on line 14; keep one of them"},
    {"no value", "    bore: 0.18", "    bore:",
     "crane.yaml:14:5: cylinders[boom].bore: has no value; give one or remove the key"},
    {"missing key", ", standby_bar: 22", "",
     "crane.yaml:29:5: pumps[main].standby_bar: missing; expected a pressure that is not negative "
     "[bar]"},
    {"missing name", "name: crane\n", "",
     "crane.yaml:1:1: name: missing; expected the machine's name"},
};

const std::vector<Broken> kNumbers = {
    {"negative bore", "bore: 0.18", "bore: -0.18",
     "crane.yaml:14:11: cylinders[boom].bore: got -0.18, expected a positive diameter [m]"},
    {"bore in millimetres", "bore: 0.18", "bore: 180",
     "crane.yaml:14:11: cylinders[boom].bore: got 180, expected a positive diameter [m] below 3; "
     "in millimetres? then write 0.18"},
    {"number with unit", "bore: 0.18", "bore: 180 mm",
     "crane.yaml:14:11: cylinders[boom].bore: got \"180 mm\", expected a positive diameter [m]; "
     "write the number alone, in m"},
    {"decimal comma", "bore: 0.18", "bore: 0,18",
     "crane.yaml:14:11: cylinders[boom].bore: got \"0,18\", expected a positive diameter [m]; "
     "write a decimal point, not a comma"},
    {"text for a number", "bore: 0.18", "bore: wide",
     "crane.yaml:14:11: cylinders[boom].bore: got \"wide\", expected a positive diameter [m]"},
    {"list for a number", "bore: 0.18", "bore: [0.18]",
     "crane.yaml:14:11: cylinders[boom].bore: got a list of 1, expected a positive diameter [m]"},
    {"not a number", "mass: 780", "mass: .nan",
     "crane.yaml:9:38: links[inner].mass: got .nan, expected a mass that is not negative [kg]; "
     "give a finite number"},
    {"infinite", "mass: 780", "mass: .inf",
     "crane.yaml:9:38: links[inner].mass: got .inf, expected a mass that is not negative [kg]; "
     "give a finite number"},
    {"too large for a double", "mass: 780", "mass: 1e999",
     "crane.yaml:9:38: links[inner].mass: got 1e999, expected a mass that is not negative [kg]; "
     "give a finite number"},
    {"negative mass", "mass: 780", "mass: -780",
     "crane.yaml:9:38: links[inner].mass: got -780, expected a mass that is not negative [kg]"},
    {"negative inertia", "inertia: 820", "inertia: -1",
     "crane.yaml:9:72: links[inner].inertia: got -1, expected a moment of inertia that is not "
     "negative [kg m^2]"},
    {"two numbers for a vector", "cog: [1.5, 0, 0.1]", "cog: [1.5, 0.1]",
     "crane.yaml:9:48: links[inner].cog: got a list of 2, expected three numbers [x, y, z], each a "
     "coordinate [m]"},
    {"text in a vector", "cog: [1.5, 0, 0.1]", "cog: [1.5, 0, up]",
     "crane.yaml:9:57: links[inner].cog[2]: got \"up\", expected a coordinate [m]"},
    {"half a stage", "stages: 4", "stages: 2.5",
     "crane.yaml:27:37: cylinders[ext].stages: got 2.5, expected stages, a whole number of at "
     "least 1"},
    {"no stage", "stages: 4", "stages: 0",
     "crane.yaml:27:37: cylinders[ext].stages: got 0, expected stages, a whole number of at least "
     "1"},
    {"standby above maximum", "standby_bar: 22", "standby_bar: 400",
     "crane.yaml:29:98: pumps[main].standby_bar: got 400, expected less than max_pressure_bar, "
     "310"},
    {"zero flow", "extend: 75", "extend: 0",
     "crane.yaml:33:44: valves[ext].max_flow_lpm.extend: got 0, expected a positive flow [l/min]"},
};

const std::vector<Broken> kJoints = {
    {"position range reversed", "position: [-0.2, 1.3]", "position: [1.3, -0.2]",
     "crane.yaml:4:102: joints[boom].position: got [1.3, -0.2], expected [lo, hi] with lo < hi; "
     "swap the two"},
    {"empty position range", "position: [0, 6]", "position: [6, 6]",
     "crane.yaml:6:100: joints[ext].position: got [6, 6], expected [lo, hi] with lo < hi"},
    {"velocity without rest", "velocity: [-0.1, 0.1]", "velocity: [0.05, 0.1]",
     "crane.yaml:4:125: joints[boom].velocity: got [0.05, 0.1], expected lo < 0 < hi; every motion "
     "starts and ends at rest"},
    {"zero axis", "axis: [1, 0, 0]", "axis: [0, 0, 0]",
     "crane.yaml:6:79: joints[ext].axis: got [0, 0, 0], expected a direction such as [0, -1, 0]"},
    {"unknown joint type", "type: prismatic", "type: prismatc",
     "crane.yaml:6:23: joints[ext].type: got \"prismatc\", expected one of revolute, prismatic; "
     "did you mean \"prismatic\"?"},
    {"continuous joint", "type: prismatic", "type: continuous",
     "crane.yaml:6:23: joints[ext].type: got \"continuous\", expected revolute with a position "
     "range (as many turns as needed)"},
    {"not serial", "parent: jib", "parent: boom",
     "crane.yaml:6:42: joints[ext].parent: got \"boom\", expected jib: the joints stand base to "
     "tip in one serial chain, each on the one before it"},
    {"dh beside axis", "axis: [1, 0, 0]", "axis: [1, 0, 0], dh: {a: 1}",
     "crane.yaml:6:55: joints[ext].origin: is given beside dh; give either dh or origin and axis"},
    {"unknown dh key", "origin: {xyz: [3, 0, 0]}, axis: [1, 0, 0]", "dh: {alfa: 1}",
     "crane.yaml:6:52: joints[ext].dh: unknown key \"alfa\"; did you mean \"alpha\"?"},
    {"joint called base", "{name: boom, type", "{name: base, type",
     "crane.yaml:4:12: joints[base].name: got \"base\", which names the machine's base frame; "
     "expected a name of its own"},
    {"joint name with a blank", "{name: ext, type", "{name: my ext, type",
     "crane.yaml:6:12: joints[my ext].name: got \"my ext\", expected a name of letters, digits, "
     "`_`, `-` and `.` (it names log columns); replace \" \""},
    {"joint twice", "{name: ext, type: prismatic, parent: jib",
     "{name: jib, type: prismatic, parent: jib",
     "crane.yaml:6:12: joints[jib].name: the name jib occurs twice (first on line 5); give each "
     "its own"},
    {"tip on an unknown joint", "tip: {joint: ext", "tip: {joint: extt",
     "crane.yaml:7:14: tip.joint: got \"extt\", expected a frame of this machine (base, boom, jib, "
     "ext); did you mean \"ext\"?"},
    {"link on an unknown joint", "{name: inner, joint: boom", "{name: inner, joint: bom",
     "crane.yaml:9:26: links[inner].joint: got \"bom\", expected a frame of this machine (base, "
     "boom, jib, ext); did you mean \"boom\"?"},
    {"slide on a revolute joint", "slides_with: ext", "slides_with: jib",
     "crane.yaml:10:44: links[stage].slides_with: got \"jib\", expected a prismatic joint"},
    {"slide across a turning joint", "joint: jib, slides_with: ext",
     "joint: boom, slides_with: ext",
     "crane.yaml:10:45: links[stage].slides_with: joint jib turns between the link's frame and "
     "ext; fix the link in the frame that carries ext"},
    {"slide on itself", "joint: jib, slides_with: ext", "joint: ext, slides_with: ext",
     "crane.yaml:10:44: links[stage].slides_with: the link is fixed in a frame that ext moves "
     "already; fix it in the frame that carries ext"},
    {"fraction alone", "slides_with: ext, fraction: 0.5", "fraction: 0.5",
     "crane.yaml:10:41: links[stage].fraction: is given without slides_with; name the prismatic "
     "joint it is a fraction of"},
    {"link twice", "{name: stage", "{name: inner",
     "crane.yaml:10:12: links[inner].name: the name inner occurs twice (first on line 9); give "
     "each its own"},
};

const std::vector<Broken> kCylinders = {
    {"rod thicker than bore", "rod: 0.115", "rod: 0.2",
     "crane.yaml:15:10: cylinders[boom].rod: got 0.2, expected less than the bore, 0.18; rod and "
     "bore are diameters"},
    {"rod without bore", "bore: 0.07, ", "",
     "crane.yaml:27:5: cylinders[ext].bore: missing; expected the bore [m] beside the rod (leave "
     "both out for a drive without hydraulics)"},
    {"negative rod", "rod: 0.115", "rod: -0.1",
     "crane.yaml:15:10: cylinders[boom].rod: got -0.1, expected a diameter that is not negative "
     "[m]"},
    {"motor beside a bore", "stages: 4, ",
     "stages: 4, motor: {displacement_cm3: 100, radius: 0.1}, ",
     "crane.yaml:27:29: cylinders[ext]: unknown key \"stages\"; known here: name, joint, motor, "
     "parallel"},
    {"motor with a ratio of zero", "stages: 4, bore: 0.07, rod: 0.05, linkage: {type: direct}",
     "motor: {displacement_cm3: 100, gear_ratio: 0, radius: 0.1}",
     "crane.yaml:27:72: cylinders[ext].motor.gear_ratio: got 0, expected turns of the motor for "
     "each "
     "turn of the joint or drum"},
    {"motor on a prismatic joint without a drum",
     "stages: 4, bore: 0.07, rod: 0.05, linkage: {type: direct}", "motor: {displacement_cm3: 100}",
     "crane.yaml:27:36: cylinders[ext].motor.radius: missing; expected a positive radius [m]"},
    {"motor turned backwards on a prismatic joint",
     "stages: 4, bore: 0.07, rod: 0.05, linkage: {type: direct}",
     "motor: {displacement_cm3: 100, gear_ratio: -3, radius: 0.1}",
     "crane.yaml:27:72: cylinders[ext].motor.gear_ratio: got -3, expected more than zero: joint "
     "ext "
     "is prismatic, turn its axis round instead"},
    {"motor with a negative displacement",
     "stages: 4, bore: 0.07, rod: 0.05, linkage: {type: direct}",
     "motor: {displacement_cm3: -1, radius: 0.1}",
     "crane.yaml:27:55: cylinders[ext].motor.displacement_cm3: got -1, expected a positive "
     "displacement [cm3]"},
    {"unknown driven joint", "    joint: jib", "    joint: gib",
     "crane.yaml:18:12: cylinders[jib].joint: got \"gib\", expected a frame of this machine (base, "
     "boom, jib, ext); did you mean \"jib\"?"},
    {"drives the base", "    joint: jib", "    joint: base",
     "crane.yaml:18:12: cylinders[jib].joint: got \"base\", expected the joint this cylinder "
     "drives"},
    {"unknown linkage", "type: direct", "type: dirct",
     "crane.yaml:27:79: cylinders[ext].linkage.type: got \"dirct\", expected one of pins, "
     "four_bar, rack, direct; did you mean \"direct\"?"},
    {"key of another linkage", "{type: direct}", "{type: direct, radius: 1}",
     "crane.yaml:27:87: cylinders[ext].linkage: unknown key \"radius\"; known here: type"},
    {"pin on a far link", "rod: {frame: boom", "rod: {frame: jib",
     "crane.yaml:16:83: cylinders[boom].linkage.rod.frame: got \"jib\", expected base or boom: a "
     "pin of the cylinder of joint boom sits on one of the two links which that joint connects"},
    {"both pins on one link", "rod: {frame: boom", "rod: {frame: base",
     "crane.yaml:16:14: cylinders[boom].linkage: barrel and rod pin both sit on base, so the "
     "cylinder moves nothing; expected one on base and one on boom"},
    {"unknown frame", "barrel: {frame: base", "barrel: {frame: bse",
     "crane.yaml:16:43: cylinders[boom].linkage.barrel.frame: got \"bse\", expected a frame of "
     "this machine (base, boom, jib, ext); did you mean \"base\"?"},
    {"four-bar coupler on the parent", "coupler: {frame: jib", "coupler: {frame: boom",
     "crane.yaml:25:16: cylinders[jib].linkage.coupler: the coupler pin sits on boom, expected it "
     "on jib"},
    {"four-bar rocker on the child", "rocker:  {frame: boom", "rocker:  {frame: jib",
     "crane.yaml:24:16: cylinders[jib].linkage.rocker: the rocker pin sits on jib, expected it on "
     "boom"},
    {"branch", "branch: -1", "branch: 2",
     "crane.yaml:26:15: cylinders[jib].linkage.branch: got 2, expected one of -1, 1, +1; did you "
     "mean \"1\"?"},
    {"mass without its place", "    rod: 0.115\n", "    rod: 0.115\n    barrel_mass: 50\n",
     "crane.yaml:12:5: cylinders[boom].barrel_cog: missing; expected a distance that is not "
     "negative [m]"},
    {"negative rod mass", "    rod: 0.115\n", "    rod: 0.115\n    rod_mass: -4\n",
     "crane.yaml:16:15: cylinders[boom].rod_mass: got -4, expected a mass that is not negative "
     "[kg]"},
    {"place without its mass", "    rod: 0.115\n", "    rod: 0.115\n    rod_cog: 0.4\n",
     "crane.yaml:12:5: cylinders[boom].rod_mass: missing; expected the mass [kg] that belongs to "
     "rod_cog"},
    {"rack on a prismatic joint", "{type: direct}", "{type: rack, radius: 0.1}",
     "crane.yaml:27:72: cylinders[ext].linkage: joint ext is prismatic, and a rack turns a "
     "revolute joint; use direct"},
    {"rack of no radius",
     "    linkage: {type: pins, barrel: {frame: base, xyz: [0.4, 0, 0.5]}, rod: {frame: boom, xyz: "
     "[0.65, 0, -0.2]}}",
     "    linkage: {type: rack, radius: 0}",
     "crane.yaml:16:35: cylinders[boom].linkage.radius: got 0, expected the pinion's radius [m]; "
     "negative if the cylinder extends while q falls"},
    {"four-bar on a prismatic joint", "{type: direct}",
     "{type: four_bar, barrel: {frame: jib, xyz: [0, 0, 0]}}",
     "crane.yaml:27:72: cylinders[ext].linkage: joint ext is prismatic, and a four_bar turns a "
     "revolute joint; use pins or direct"},
    {"open four-bar", "length: 0.5}", "length: 0.25}",
     "crane.yaml:17:5: cylinders[jib].linkage: the four-bar cannot close below jib = -93.6 deg "
     "(-1.6333 rad), inside the joint's range [-131.8, 2.9] deg; lengthen rocker or coupler, "
     "correct the pins or narrow the range"},
    {"dead centre of a four-bar", "position: [-2.3, 0.05]", "position: [-0.1, 1.9]",
     "crane.yaml:17:5: cylinders[jib].linkage: dead centre: dx/dq changes sign at jib = 104.0 deg "
     "(1.8146 rad), inside the joint's range [-5.7, 108.9] deg; narrow the range or correct the "
     "pins"},
    {"four-bar open at the upper end", "",
     with(with(kGood, "position: [-2.3, 0.05]", "position: [-0.1, 1.9]"), "length: 0.5}",
          "length: 0.25}"),
     "crane.yaml:17:5: cylinders[jib].linkage: the four-bar cannot close beyond jib = 93.6 deg "
     "(1.6333 rad), inside the joint's range [-5.7, 108.9] deg; lengthen rocker or coupler, "
     "correct "
     "the pins or narrow the range"},
    {"four-bar open everywhere", "length: 0.5}", "length: 0.02}",
     "crane.yaml:17:5: cylinders[jib].linkage: the four-bar cannot close anywhere in the range "
     "[-131.8, 2.9] deg of jib; lengthen rocker or coupler, correct the pins or narrow the range"},
    {"dead centre", "position: [-0.2, 1.3]", "position: [-0.2, 2.2]",
     "crane.yaml:12:5: cylinders[boom].linkage: dead centre: dx/dq changes sign at boom = 122.0 "
     "deg (2.1299 rad), inside the joint's range [-11.5, 126.1] deg; narrow the range or correct "
     "the pins"},
    {"dead centre at the lower end", "position: [-0.2, 1.3]", "position: [-1.2, 1.3]",
     "crane.yaml:12:5: cylinders[boom].linkage: dead centre: dx/dq changes sign at boom = -58.0 "
     "deg (-1.0117 rad), inside the joint's range [-68.8, 74.5] deg; narrow the range or correct "
     "the pins"},
    {"nearly a dead centre", "position: [-0.2, 1.3]", "position: [-0.2, 2.12]",
     "crane.yaml:12:5: cylinders[boom].linkage: nearly a dead centre: dx/dq is only 0.0047 at boom "
     "= 121.5 deg (2.1200 rad), its largest is 0.68; narrow the range or correct the pins"},
    {"two cylinders on one joint", "{name: ext, joint: ext, stages",
     "{name: ext, joint: boom, stages",
     "crane.yaml:27:5: cylinders[ext].joint: joint boom is driven by boom already; equal cylinders "
     "side by side are one cylinder with `parallel: 2`"},
    {"cylinder twice", "{name: ext, joint: ext, stages", "{name: jib, joint: ext, stages",
     "crane.yaml:27:5: cylinders[jib]: the name jib occurs twice (first on line 17); give each its "
     "own"},
};

const std::vector<Broken> kHydraulics = {
    {"pump feeds an unknown cylinder", "feeds: [boom, jib, ext]", "feeds: [boom, jib, slew]",
     "crane.yaml:29:37: pumps[main].feeds[2]: got \"slew\", expected a cylinder of this machine "
     "(boom, jib, ext)"},
    {"pump feeds one twice", "feeds: [boom, jib, ext]", "feeds: [boom, jib, jib]",
     "crane.yaml:29:5: pumps[main].feeds: names cylinder jib twice; keep one"},
    {"two pumps on one cylinder", "valves:",
     "  - {name: second, feeds: [jib], max_flow_lpm: 50, max_pressure_bar: 300, standby_bar: "
     "20}\nvalves:",
     "crane.yaml:30:5: pumps[second].feeds: cylinder jib is fed by pump main already; expected one "
     "pump a cylinder"},
    {"pump twice", "valves:",
     "  - {name: main, feeds: [], max_flow_lpm: 50, max_pressure_bar: 300, standby_bar: "
     "20}\nvalves:",
     "crane.yaml:30:12: pumps[main].name: the name main occurs twice (first on line 29); give each "
     "its own"},
    {"unknown pump type", "{name: main, feeds", "{name: main, type: variable, feeds",
     "crane.yaml:29:24: pumps[main].type: got \"variable\", expected one of load_sensing, "
     "constant_pressure"},
    {"oil for a drive without bore", "stages: 4, bore: 0.07, rod: 0.05, ", "",
     "crane.yaml:29:5: pumps[main].feeds: cylinder ext has no bore, so it takes no oil; give its "
     "bore and rod or take it off the list"},
    {"valve of an unknown cylinder", "cylinder: jib,", "cylinder: gib,",
     "crane.yaml:32:16: valves[gib].cylinder: got \"gib\", expected a cylinder of this machine "
     "(boom, jib, ext); did you mean \"jib\"?"},
    {"two valves", "cylinder: jib,", "cylinder: boom,",
     "crane.yaml:32:5: valves[boom]: this cylinder has a valve already (line 31); keep one"},
    {"one-sided valve", "{extend: 85, retract: 50}", "{extend: 85}",
     "crane.yaml:32:35: valves[jib].max_flow_lpm.retract: missing; expected a positive flow "
     "[l/min]"},
};

INSTANTIATE_TEST_SUITE_P(Text, BrokenMachine, testing::ValuesIn(kText), case_name<Broken>);
INSTANTIATE_TEST_SUITE_P(Numbers, BrokenMachine, testing::ValuesIn(kNumbers), case_name<Broken>);
INSTANTIATE_TEST_SUITE_P(Joints, BrokenMachine, testing::ValuesIn(kJoints), case_name<Broken>);
INSTANTIATE_TEST_SUITE_P(Cylinders, BrokenMachine, testing::ValuesIn(kCylinders),
                         case_name<Broken>);
INSTANTIATE_TEST_SUITE_P(Hydraulics, BrokenMachine, testing::ValuesIn(kHydraulics),
                         case_name<Broken>);

const std::string kGoodUrdf = R"(<robot name="r">
<link name="base_link"/>
<link name="arm"><inertial><mass value="10"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="hook"/>
<joint name="boom" type="revolute"><parent link="base_link"/><child link="arm"/><axis xyz="0 -1 0"/>
 <limit lower="-1" upper="1" effort="0" velocity="0.5"/></joint>
<joint name="fix" type="fixed"><parent link="arm"/><child link="hook"/><origin xyz="2 0 0"/></joint>
</robot>
)";
const std::string kUrdfMachine =
    "name: m\nkinematics: {urdf: r.urdf, limits: {boom: {acceleration: [-1, 1]}}}\n";

struct BrokenUrdfFile {
  std::string what, machine, urdf;  ///< empty `urdf`: no such file
  std::string message;              ///< {} stands for the folder
};

void PrintTo(const BrokenUrdfFile& broken, std::ostream* out) { *out << broken.what; }

class BrokenUrdf : public testing::TestWithParam<BrokenUrdfFile> {};

TEST_P(BrokenUrdf, IsRefusedWithPlaceAndReason) {
  const auto& [what, machine, urdf, message] = GetParam();
  const std::string folder = testing::TempDir() + "sparflow_urdf_" + std::to_string(::getpid());
  std::filesystem::create_directories(folder);
  if (!urdf.empty()) write_file_atomically(folder + "/r.urdf", urdf);
  std::string expected = message;
  const std::size_t at = expected.find("{}");
  if (at != std::string::npos) expected.replace(at, 2, folder);
  try {
    parse_machine(machine, "m.yaml", folder);
    ADD_FAILURE() << "accepted: " << what;
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), expected) << what;
  }
  std::filesystem::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(
    Urdf, BrokenUrdf,
    testing::Values(
        BrokenUrdfFile{"no file", kUrdfMachine, "",
                       "m.yaml:2:20: kinematics.urdf: there is no file {}/r.urdf; the path is "
                       "relative to the machine file"},
        BrokenUrdfFile{
            "not XML", kUrdfMachine, "boom",
            "{}/r.urdf: not readable as URDF: no XML element in it, expected <robot ...>"},
        BrokenUrdfFile{"joints beside it", kUrdfMachine + "joints: []\n", kGoodUrdf,
                       "m.yaml:3:9: joints: is given beside kinematics, whose URDF defines the "
                       "joints; remove one"},
        BrokenUrdfFile{"no acceleration", "name: m\nkinematics: {urdf: r.urdf}\n", kGoodUrdf,
                       "{}/r.urdf: joint[boom]: URDF knows no acceleration limit; give it in the "
                       "machine file: kinematics: {limits: {boom: {acceleration: [lo, hi]}}}"},
        BrokenUrdfFile{
            "continuous", kUrdfMachine, with(kGoodUrdf, "\"revolute\"", "\"continuous\""),
            "{}/r.urdf: joint[boom]: a continuous joint has no position range and needs one; give "
            "it in the machine file: kinematics: {limits: {boom: {position: [lo, hi]}}}"},
        BrokenUrdfFile{"floating", kUrdfMachine, with(kGoodUrdf, "\"revolute\"", "\"floating\""),
                       "{}/r.urdf: joint[boom]: a floating or planar joint; expected revolute, "
                       "continuous, prismatic or fixed joints"},
        BrokenUrdfFile{
            "mimic", kUrdfMachine,
            with(kGoodUrdf, "velocity=\"0.5\"/>", "velocity=\"0.5\"/><mimic joint=\"fix\"/>"),
            "{}/r.urdf: joint[boom]: mimics fix; write the machine with `joints` and `links`, "
            "where a telescope stage is a link with slides_with and fraction"},
        BrokenUrdfFile{"limits of an unknown joint",
                       with(kUrdfMachine, "{boom: {", "{bom: {position: [0, 1]}, boom: {"),
                       kGoodUrdf,
                       "m.yaml:2:42: kinematics.limits: the chain in {}/r.urdf has no moving joint "
                       "\"bom\" (it has boom); did you mean \"boom\"?"},
        BrokenUrdfFile{"unknown tip link", kUrdfMachine + "tip: {link: hok}\n", kGoodUrdf,
                       "m.yaml:3:6: tip: {}/r.urdf has no link \"hok\"; it has arm, base_link, "
                       "hook; did you mean \"hook\"?"},
        BrokenUrdfFile{"two leaves", kUrdfMachine,
                       with(kGoodUrdf, "</robot>",
                            "<link name=\"lamp\"/><joint name=\"l\" type=\"fixed\"><parent "
                            "link=\"arm\"/><child link=\"lamp\"/></joint></robot>"),
                       "m.yaml:2:13: tip: {}/r.urdf branches and has the leaves hook, lamp; say "
                       "which carries the payload: tip: {link: NAME}"}),
    case_name<BrokenUrdfFile>);

}  // namespace
}  // namespace sparflow
