/// Faulty and unusual logs with the messages that the user gets.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using test::LogFiles;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct BrokenLog {
  const char* name;
  std::string text;
  const char* message;
};

const std::string kHeader = "t_s,q_boom_rad,q_extension_m,pA_boom_bar\n";

std::string rows(int from, int to) {
  std::string text;
  for (int i = from; i < to; ++i) text += fmt::format("{:.2f},0.5,1.5,{}\n", 0.02 * i, 80 + i % 7);
  return text;
}

// Over 80 lines because it is a table with two or three lines a case.
std::vector<BrokenLog> broken_logs() {
  return {
      {"empty", "", "log.csv: the file is empty"},
      {"blank", "\n  \n\n", "log.csv: the file is empty"},
      {"comments only", "# a\n# b\n", "log.csv: the file is empty"},
      {"header only", kHeader, "log.csv:1: no rows of numbers under the header"},
      {"units row and no more", kHeader + "s,rad,m,bar\n",
       "log.csv:1: no rows of numbers under the header"},
      {"no header", rows(0, 5),
       "log.csv:1: the first line holds numbers only, expected a header with the columns' names, "
       "e.g. "
       "\"t_s,q_boom_rad,pA_boom_bar\""},
      {"one column", "t_s\n0\n1\n",
       "log.csv:1: only one column, \"t_s\", expected several separated by \",\", \";\", tab or "
       "blanks"},
      {"decimal commas between commas", kHeader + "0,00,0,5,1,5,80,1\n0,02,0,5,1,5,80,1\n",
       "log.csv:2: 8 values where the header names 4 columns; decimal commas between values "
       "separated "
       "by commas? Export with \";\" or decimal points"},
      {"rows too short", kHeader + "0.00,0.5\n0.02,0.5\n" + rows(2, 6),
       "log.csv:2: 2 values where the header names 4 columns; every row needs one value (or "
       "nothing "
       "between separators) for each column. If lines of text stand before the header, a mapping "
       "file "
       "says how many: skip_rows: N"},
      {"thousands separators, European",
       "t_s;q_boom_rad;q_extension_m;force_boom_N\n0,00;0,5;1,5;1.234,5\n",
       "log.csv:2: force_boom_N: got \"1.234,5\", expected a number without thousands separators; "
       "export it without them"},
      {"thousands separators, English",
       "t_s;q_boom_rad;q_extension_m;force_boom_N\n0.00;0.5;1.5;1,234.5\n",
       "log.csv:2: force_boom_N: got \"1,234.5\", expected a number without thousands separators; "
       "export it without them"},
      {"decimal marks mixed", "t_s;q_boom_rad;q_extension_m\n0.00;0.5;1.5\n0.02;0,5;1.5\n",
       "log.csv:3: q_boom_rad: got \"0,5\", but the numbers above have a decimal point; export the "
       "log "
       "with one decimal mark, or set `decimal` in a mapping file"},
      {"decimal marks mixed, comma first", "t_s;q_boom_rad;q_extension_m\n0,00;0,5;1.5\n",
       "log.csv:2: q_extension_m: got \"1.5\", but the numbers above have a decimal comma; export "
       "the "
       "log with one decimal mark, or set `decimal` in a mapping file"},
      {"open quote in the header", "\"t_s,q_boom_rad,q_extension_m\n0,1,1\n",
       "log.csv:1: a quote is opened and not closed"},
      {"open quote in a row", kHeader + rows(0, 3) + "0.06,\"0.5,1.5,80\n",
       "log.csv:5: a quote is opened and not closed on its line"},
      {"a spreadsheet", std::string("PK\x03\x04\x14\0\x06\0", 8),
       "log.csv: this is a spreadsheet or an archive, expected text; save the sheet as CSV"},
      {"gzip", "\x1F\x8B\x08rest",
       "log.csv: this is a gzip archive, expected text; unpack it first"},
      {"UTF-16 without its mark", std::string("t\0_\0s\0,\0", 8),
       "log.csv: the text holds zero bytes (UTF-16 without a byte order mark, or not text at all); "
       "save "
       "it as UTF-8"},
      {"no time", "Time [ms],q_boom_rad,q_extension_m\n0,0.5,1\n20,0.5,1\n",
       "log.csv:1: t_s: no column of this name; found Time [ms], q_boom_rad, q_extension_m; rename "
       "the "
       "column of time, or give a mapping file with columns: {t_s: \"...\"}, and skip_rows: N if "
       "lines of "
       "text stand before the header"},
      {"clock time", "t_s,q_boom_rad,q_extension_m\n12:00:01,0.5,1\n12:00:02,0.5,1\n",
       "log.csv:2: t_s: got \"12:00:01\", expected a number of seconds from any start; export "
       "relative "
       "time instead of clock time"},
      {"time goes back", kHeader + rows(0, 50) + rows(48, 60),
       "log.csv:52: t_s: time goes back from 0.98 to 0.96 s; sort the rows, or cut the log here"},
      {"two logs in one", kHeader + rows(0, 50) + rows(0, 50),
       "log.csv:52: t_s: time goes back from 0.98 to 0 s; two logs in one file? Cut it here"},
      {"milliseconds called seconds", "t_s,q_boom_rad,q_extension_m\n0,0.5,1\n20,0.5,1\n40,0.5,1\n",
       "log.csv:3: t_s: the samples are 20 s apart, too slow to see a motion; if the numbers are "
       "milliseconds, name the column t_ms"},
      {"days called seconds",
       "t_s,q_boom_rad,q_extension_m\n0,0.5,1\n0.00000023,0.5,1\n0.00000046,0.5,1\n",
       "log.csv:3: t_s: the samples are 2.3e-07 s apart; if the numbers are days or hours, convert "
       "them in a mapping file, e.g. t_s: \"Time * 86400\""},
      {"one row", kHeader + rows(0, 1),
       "log.csv:1: t_s: 1 row with a distinct time, expected at least two"},
      {"constant time", kHeader + "1,0.5,1,80\n1,0.5,1,81\n1,0.5,1,82\n",
       "log.csv:1: t_s: 1 row with a distinct time, expected at least two"},
      {"time is empty", kHeader + ",0.5,1,80\n,0.5,1,81\n",
       "log.csv:1: t_s: 0 rows with a distinct time, expected at least two"},
      {"a joint is missing", "t_s,q_boom_rad,pA_boom_bar\n0,0.5,80\n0.02,0.5,81\n",
       "log.csv:1: no position of joint extension: expected column q_extension_m or x_extension_m; "
       "found t_s, q_boom_rad, pA_boom_bar; rename it, or give a mapping file"},
      {"a joint is misspelled", "t_s,q_bom_rad,q_extension_m\n0,0.5,1\n0.02,0.5,1\n",
       "log.csv:1: no position of joint boom: expected column q_boom_rad or x_boom_m; found t_s, "
       "q_bom_rad, q_extension_m; is \"q_bom_rad\" meant to be q_boom_rad?"},
      {"a joint's column is empty", "t_s,q_boom_rad,q_extension_m\n0,,1\n0.02,nan,1\n",
       "log.csv:1: no position of joint boom: expected column q_boom_rad or x_boom_m; found t_s, "
       "q_boom_rad, q_extension_m; rename it, or give a mapping file"},
      {"a joint's column is text", "t_s,q_boom_rad,q_extension_m\n0,up,1\n0.02,down,1\n",
       "log.csv:1: no position of joint boom: expected column q_boom_rad or x_boom_m; found t_s, "
       "q_boom_rad, q_extension_m; rename it, or give a mapping file"},
      {"an unknown unit", "t_s,q_boom_grad,q_extension_m\n0,0.5,1\n",
       "log.csv:1: q_boom_grad: unit \"grad\" is not known for an angle, expected one of: rad, "
       "deg, "
       "mrad"},
      {"an angle in metres", "t_s,q_boom_m,q_extension_m\n0,0.5,1\n",
       "log.csv:1: q_boom_m: unit \"m\" is not known for an angle, expected one of: rad, deg, "
       "mrad"},
      {"a pressure without unit", "t_s,q_boom_rad,q_extension_m,pA_boom\n0,0.5,1,80\n",
       "log.csv:1: pA_boom: no unit, expected e.g. \"pA_boom_bar\""},
      {"a command in volts", "t_s,q_boom_rad,q_extension_m,u_boom_V\n0,0.5,1,5\n",
       "log.csv:1: u_boom_V: unit \"V\" is not known for a command, expected one of: none, "
       "percent, "
       "pct, permille"},
      {"name and units row disagree",
       "t_s,q_boom_rad,q_extension_m\ns,deg,m\n0,0.5,1\n0.02,0.5,1\n",
       "log.csv:1: q_boom_rad: the name says \"rad\" and the unit given with it is \"deg\"; rename "
       "the "
       "column or correct the unit"},
      {"one quantity twice", "t_s,q_boom_rad,q_boom_deg,q_extension_m\n0,0.5,30,1\n",
       "log.csv:1: q_boom_deg: measures the same as column q_boom_rad; leave one out, or name it "
       "under "
       "`ignore` in a mapping file"},
      {"two times", "t_s,t_ms,q_boom_rad,q_extension_m\n0,0,0.5,1\n",
       "log.csv:1: t_ms: measures the same as column t_s; leave one out, or name it under `ignore` "
       "in a "
       "mapping file"},
  };
}

TEST_F(LogFiles, BrokenLogsAreRefusedWithAMessage) {
  EXPECT_GE(broken_logs().size(), 20u);
  for (const BrokenLog& broken : broken_logs()) {
    EXPECT_EQ(error_of(broken.text), broken.message) << broken.name;
  }
}

TEST_F(LogFiles, AMissingFileIsAnError) {
  EXPECT_EQ(message_of([&] { load_log(path("none.csv"), test::small_crane()); }),
            "none.csv: cannot read: No such file or directory; check the path");
}

TEST_F(LogFiles, ImplausibleLogsAreReadWithAWarning) {
  const auto with = [&](const std::string& name, const std::string& values) {
    std::string text = "t_s,q_boom_rad,q_extension_m," + name + "\n";
    for (int i = 0; i < 40; ++i)
      text += fmt::format("{:.2f},0.5,1.5,{}\n", 0.02 * i,
                          fmt::format(fmt::runtime(values), 1 + i % 7));
    return text;
  };
  std::string one_short = kHeader + rows(0, 50) + "1.00,0.5\n";
  std::string one_error = kHeader + rows(0, 50) + "1.00,0.5,1.5,ERR\n" + rows(51, 60);
  std::string jump = kHeader + rows(0, 50) + "1.00,1.2,1.5,80\n" + rows(51, 60);
  std::string hung = kHeader;
  for (int i = 0; i < 300; ++i) {
    hung += fmt::format("{:.2f},0.5,1.5,{:.2f}\n", 0.02 * i,
                        i > 100 && i < 220 ? 71.25 : 70 + std::sin(i));
  }
  std::string degrees = "t_s,q_boom_rad,q_extension_m\n", millimetres = degrees, outside = degrees;
  for (int i = 0; i < 40; ++i) {
    degrees += fmt::format("{:.2f},{},1.5\n", 0.02 * i, 30.0 + 0.01 * i);
    millimetres += fmt::format("{:.2f},0.5,{}\n", 0.02 * i, 1500 + i);
    outside += fmt::format("{:.2f},{},1.5\n", 0.02 * i, 1.40 - 0.001 * i);
  }
  std::string repeated = "t_s,q_boom_rad,q_extension_m,rpm,rpm\n0,0.5,1,7,8\n0.02,0.5,1,7,8\n";
  for (const BrokenLog& odd : std::vector<BrokenLog>{
           {"cut off", one_short,
            "1 row left out: line 52 has 2 values where the header names 4 columns"},
           {"a cell that is no number", one_error,
            "pA_boom_bar: 1 cell is no number (the first \"ERR\" in line 52), taken as missing"},
           {"degrees called radians", degrees,
            "q_boom_rad: values up to 30.39 rad; are they in degrees? Then name the column "
            "q_boom_deg"},
           {"millimetres called metres", millimetres,
            "q_extension_m: values up to 1539 m; are they in millimetres? Then name the column "
            "q_extension_mm"},
           {"outside the range", outside,
            "q_boom_rad: 47.5 % of the samples lie outside the joint's range of the machine file "
            "(-0.2 to "
            "1.35 rad, measured 1.361 to 1.4); check sign, zero and unit"},
           {"a jump", jump,
            "q_boom_rad: 2 jumps faster than ten times the joint's velocity limit, the first at "
            "1.00 s "
            "(line 52); outliers, or a wrong unit of time?"},
           {"pascals called bar", with("pA_boom_bar", "8{}00000"),
            "pA_boom_bar: values up to 8.7e+06 bar; are they in Pa? Then name the column "
            "pA_boom_Pa"},
           {"kilopascals called bar", with("pA_boom_bar", "2{}000"),
            "pA_boom_bar: values up to 2.7e+04 bar; are they in kPa? Then name the column "
            "pA_boom_kPa"},
           {"pounds a square inch called bar", with("pA_boom_bar", "1{}00"),
            "pA_boom_bar: values up to 1700 bar; are they in psi? Then name the column "
            "pA_boom_psi"},
           {"below vacuum", with("pB_boom_bar", "-5.{}"),
            "pB_boom_bar: values down to -5.7 bar, below vacuum; check the sensor's zero"},
           {"a dead sensor",
            kHeader + "0,0.5,1,80\n" +
                [] {
                  std::string text;
                  for (int i = 1; i < 40; ++i) text += fmt::format("{:.2f},0.5,1,80\n", 0.02 * i);
                  return text;
                }(),
            "pA_boom_bar: the same value in all samples; is the sensor connected?"},
           {"a sensor that hung", hung,
            "pA_boom_bar: exactly the same value from 2.02 to 4.38 s; did the sensor hang?"},
           {"percent called -1..1", with("u_boom", "{}0"),
            "u_boom: values up to 70, expected -1 to 1; are they in percent? Then name the column "
            "u_boom_percent"},
           {"stroke in millimetres", with("x_boom_m", "10{}"),
            "x_boom_m: values up to 107 m; are they in millimetres? Then name the column "
            "x_boom_mm"},
           {"stroke too long", with("x_boom_m", "0.8{}"),
            "x_boom_m: 85 % of the samples lie outside the cylinder's stroke of the machine file "
            "(0 to "
            "0.8 m, measured 0.81 to 0.87); check sign, zero and unit"},
           {"a pump misspelled", with("p_mian_bar", "{}"),
            "column p_mian_bar names no part of the machine; did you mean p_main_bar?"},
           {"letters in the wrong case", with("pa_boom_bar", "{}"),
            "column pa_boom_bar names no part of the machine; did you mean pA_boom_bar?"},
           {"an empty column", with("engine", ""), "column engine left out: it is empty"},
           {"a column twice", repeated, "column rpm occurs twice; the second is left out"},
       }) {
    Log log;
    ASSERT_EQ(message_of([&] { log = load(odd.text); }), "") << odd.name;
    EXPECT_THAT(log.warnings, ElementsAre(odd.message)) << odd.name;
  }
}

TEST_F(LogFiles, MarksForMissingValuesAreRecognised) {
  std::string text = kHeader;
  const char* marks[] = {"",     "-",    "NaN", "nan",  "NAN",     "#N/A", "n/a",
                         "null", "None", "inf", "-inf", "1.#QNAN", "?",    "--"};
  int i = 0;
  for (const char* mark : marks) {
    text += fmt::format("{:.2f},0.5,1.5,80\n{:.2f},0.5,1.5,{}\n", 0.02 * i, 0.02 * (i + 1), mark);
    i += 2;
  }
  text += fmt::format("{:.2f},0.5,1.5,81\n", 0.02 * i);
  const Log log = load(text);
  EXPECT_EQ(log.counts.cells_missing, 14);
  EXPECT_EQ(log.counts.cells_interpolated, 14);
  EXPECT_EQ(log.counts.cells_unreadable, 0);
  EXPECT_THAT(log.warnings, IsEmpty());
}

TEST_F(LogFiles, NumbersOutsideTheRangeOfADoubleAreAccepted) {
  const Log log = load(
      "t_s,q_boom_rad,q_extension_m,a,b\n0,0.5,1,1e-400,1\n0.02,0.5,1,-1e-320,1e999\n0.04,.5,1.,5,"
      "3\n");
  EXPECT_EQ(log.find("a")->values[0], 0.0);
  EXPECT_NEAR(log.find("b")->values[1], 2.0, 1e-12);  // too large: missing, filled
}

TEST_F(LogFiles, OtherEncodingsArePrintable) {
  // Latin-1 degree sign in a unit, a stray byte in a text column: messages must be valid UTF-8.
  const Log log = load("t_s;q_boom [\xB0];q_extension_m;note\n0;45;1;\xFF\x01\n0.02;45;1;b\n");
  EXPECT_NEAR(log.find(Role::kJointPosition, 0)->values[0], 0.7853981633974483, 1e-15);
  EXPECT_THAT(log.warnings, ElementsAre(HasSubstr("line 1 is not UTF-8 (nor are 1 later ones)"),
                                        "column note left out: it holds text (\"ÿ?\" in line 2)"));
}

TEST_F(LogFiles, ALogThatIsFasterThanNeededIsThinnedByMeans) {
  std::string text = "t_s,q_boom_rad,q_extension_m,pA_boom_bar\n";
  for (int i = 0; i < 20'000; ++i) {
    // a ripple of the pressure at half the sampling rate vanishes in the means
    text +=
        fmt::format("{:.4f},{:.5f},1,{}\n", 1e-4 * i, 0.5 + 1e-5 * i, 80 + (i % 2 == 0 ? 3 : -3));
  }
  const Log log = load(text);
  EXPECT_EQ(log.samples(), 2000);
  // Rounding of times with four decimals.
  EXPECT_NEAR(log.step, 1e-3, 1e-9);
  EXPECT_THAT(log.warnings, Contains(HasSubstr("thinned from 20000 to 2000 samples")));
  const Channel& p = *log.find(Role::kPressureA, 0);
  // Rounding; the ripple itself is 3e5 Pa.
  EXPECT_LT((p.values.array() - 80e5).abs().maxCoeff(), 1.0);
  // value and time are means over the same samples, so that a ramp stays one
  const Channel& q = *log.find(Role::kJointPosition, 0);
  EXPECT_LT((q.values.array() - 0.5 - 0.1 * log.time.array()).abs().maxCoeff(), 1e-9);
}

TEST_F(LogFiles, AThousandSamplesASecondStayAsTheyAre) {
  std::string text = "t_s,q_boom_rad,q_extension_m\n";
  for (int i = 0; i < 500; ++i) text += fmt::format("{:.3f},{:.5f},1\n", 1e-3 * i, 0.5 + 1e-4 * i);
  EXPECT_EQ(load(text).samples(), 500);
}

TEST_F(LogFiles, FiftyRowsOfAMicrosecondAreNoMotion) {
  std::string text = "t_s,q_boom_rad,q_extension_m\n";
  for (int i = 0; i < 50; ++i) text += fmt::format("{:.6f},0.5,1\n", 1e-6 * i);
  EXPECT_THAT(error_of(text), HasSubstr("the log lasts"));
}

TEST_F(LogFiles, ValuesThatNoMachineHasAreNamedWithTheirLine) {
  EXPECT_THAT(error_of("t_s,q_boom_rad,q_extension_m,pA_boom_bar\n0,0.5,1,80\n0.02,0.5,1,80e300\n"),
              AllOf(HasSubstr("log.csv:3: pA_boom_bar: got 8e+301"), HasSubstr("unit")));
}

TEST_F(LogFiles, TooManyColumnsAreRefused) {
  std::string header = "t_s,q_boom_rad,q_extension_m", row = "0,0.5,1";
  for (int i = 0; i < 10'000; ++i) header += fmt::format(",c{}", i), row += ",1";
  EXPECT_THAT(error_of(header + "\n" + row + "\n"), HasSubstr("columns, the limit is 10000"));
}

TEST_F(LogFiles, AFolderIsNoEmptyLog) {
  try {
    load_log(std::filesystem::temp_directory_path().string(), test::small_crane());
    FAIL() << "nothing thrown";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("this is a folder"));
  }
}

TEST_F(LogFiles, ZeroBytesAtTheEndAreLeftOut) {
  const Log log = load(kHeader + rows(0, 200) + std::string(500, '\0'));
  EXPECT_EQ(log.samples(), 200);
  EXPECT_EQ(log.counts.rows_wrong_width, 1);
}

}  // namespace
}  // namespace sparflow
