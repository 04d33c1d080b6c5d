/// Conversions, column storage and shared masters of MDF 4 files, against values computed by hand.
#include <gmock/gmock.h>

#include <cmath>

#include "identification/log/recordings/recording_formats.h"
#include "models/math/error.h"
#include "models/math/nan.h"
#include "tests/identification/log/recordings/mdf_writer.h"

namespace sparflow {
namespace {

using test::conversion;
using test::le;
using test::MdfWriter;
using test::real;
using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::HasSubstr;
using testing::NanSensitiveDoubleEq;

/// Physical values of the stored numbers 0 to 9 by a rule. @param whole they are stored as integers, else as reals
Recording converted(MdfWriter w, std::uint64_t rule, bool whole) {
  std::string data;
  for (unsigned i = 0; i < 10; ++i) data += real(0.1 * i) + (whole ? le(i, 8) : real(i));
  const auto at = w.block("DT", {}, data);
  const auto first =
      test::channels(w, {{"t", 2, 1, 4, 0, 0, 64}, {"x", 0, 0, whole ? 0U : 4U, 0, 8, 64, rule}});
  w.first(w.block("DG", {0, test::group(w, 0, first, {0, 10, 16, 0}), at, 0}, le(0, 8)));
  return read_recording(w.file, "a.mf4");
}

void expect_converted(const MdfWriter& w, std::uint64_t rule, const std::vector<double>& values,
                      bool whole = true) {
  const Recording r = converted(w, rule, whole);
  ASSERT_EQ(r.channels.size(), 1u);
  std::vector<testing::Matcher<double>> expected;
  for (const double v : values) expected.push_back(NanSensitiveDoubleEq(v));
  EXPECT_THAT(r.channels[0].values, ElementsAreArray(expected));
}

TEST(MdfConversion, RationalIsAQuotientOfTwoSquarePolynomials) {
  MdfWriter w;
  const auto rule = conversion(w, 2, {1, 2, 3, 0, 1, 4});  // (x^2 + 2x + 3) / (x + 4)
  std::vector<double> expected;
  for (int x = 0; x < 10; ++x) expected.push_back((x * x + 2.0 * x + 3.0) / (x + 4.0));
  expect_converted(w, rule, expected);
  MdfWriter pole;  // 1 / (x - 2) has no value at 2
  const auto one = conversion(pole, 2, {0, 0, 1, 0, 1, -2});
  EXPECT_TRUE(std::isnan(converted(pole, one, true).channels[0].values[2]));
}

TEST(MdfConversion, FormulasAreEvaluated) {
  MdfWriter w;
  const auto rule = conversion(w, 3, {}, {w.text("X*X/2 + 1")});
  expect_converted(w, rule, {1, 1.5, 3, 5.5, 9, 13.5, 19, 25.5, 33, 41.5});
}

TEST(MdfConversion, TablesInterpolateOrTakeTheNearestKey) {
  const std::vector<double> table = {2, 10, 4, 20, 8, 100};
  MdfWriter a;
  expect_converted(a, conversion(a, 4, table), {10, 10, 10, 15, 20, 40, 60, 80, 100, 100});
  MdfWriter b;  // in the middle of two keys, at 3 and 6, the lower one counts
  expect_converted(b, conversion(b, 5, table), {10, 10, 10, 10, 20, 20, 20, 100, 100, 100});
}

TEST(MdfConversion, RangesContainTheirUpperEndForIntegersOnly) {
  const std::vector<double> ranges = {0, 2, 7, 5, 6, 9, -1};
  MdfWriter a;
  expect_converted(a, conversion(a, 6, ranges), {7, 7, 7, -1, -1, 9, 9, -1, -1, -1});
  MdfWriter b;
  expect_converted(b, conversion(b, 6, ranges), {7, 7, -1, -1, -1, 9, -1, -1, -1, -1}, false);
}

TEST(MdfConversion, TextsBesideNumbersAreMissingValues) {
  MdfWriter a;  // 1 is "off", 2 is a number of its own, all others have the last rule
  const auto off = a.text("off"), own = conversion(a, 1, {0, 100}),
             rest = conversion(a, 1, {1000, 1});
  const auto keys = conversion(a, 7, {1, 2}, {off, own, rest});
  expect_converted(a, keys, {1000, kNaN, 200, 1003, 1004, 1005, 1006, 1007, 1008, 1009});
  MdfWriter b;  // 0 to 1 is "low", 4 to 6 twice the number, and nothing is said of others
  const auto low = b.text("low"), twice = conversion(b, 1, {0, 2});
  const auto ranges = conversion(b, 8, {0, 1, 4, 6}, {low, twice, 0});
  expect_converted(b, ranges, {kNaN, kNaN, kNaN, kNaN, 8, 10, 12, kNaN, kNaN, kNaN});
  MdfWriter c;  // names of all states: the number is the state
  const auto names = conversion(c, 7, {0, 1}, {c.text("off"), c.text("on"), c.text("?")});
  const Recording r = converted(c, names, true);
  EXPECT_EQ(r.channels[0].values[3], 3.0);
  EXPECT_THAT(r.warnings, ElementsAre("left out, only the texts that name states: x"));
}

TEST(MdfConversion, ARuleOfAWrongSizeIsRefused) {
  MdfWriter w;
  const auto rule = conversion(w, 4, {2, 10, 1, 20});  // its keys decrease
  try {
    converted(w, rule, true);
    FAIL() << "a table out of order was read";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("block CC: a conversion of type 4 with 4 numbers"));
  }
}

/// Column storage of version 4.20: time stands in a DV block of its own group, two channels in lists of DV blocks whose
/// invalidation bytes stand apart (DI), and both share the time of the first group.
std::string columns_file(unsigned value_rows) {
  MdfWriter w;
  std::string time;
  for (unsigned i = 0; i < 6; ++i) time += real(0.5 * i);
  const auto time_data = w.block("DV", {}, time);
  const auto master =
      test::group(w, 0, test::channels(w, {{"t", 2, 1, 4, 0, 0, 64}}), {0, 6, 8, 0});
  std::string values, invalid;
  for (unsigned i = 0; i < value_rows; ++i) {
    values += le(100 + i, 2);
    invalid += le(i == 4 ? 1 : 0, 1);
  }
  // two blocks of four and two rows
  const auto v1 = w.block("DV", {}, values.substr(0, 8)), v2 = w.block("DV", {}, values.substr(8));
  const auto i1 = w.block("DI", {}, invalid.substr(0, 4)),
             i2 = w.block("DI", {}, invalid.substr(4));
  const auto list =
      w.block("LD", {0, v1, v2, i1, i2}, le(0x80000000U, 4) + le(2, 4) + le(0, 8) + le(4, 8));
  const auto first = test::channels(w, {{"x", 0, 0, 0, 0, 0, 16, 0, 2, 0}});
  const auto shared = test::group(w, 0, first, {0, value_rows, 2, 1}, master);
  const auto last = w.block("DG", {0, master, time_data, 0}, le(0, 8));
  // The group that shares the time comes first in the file.
  w.first(w.block("DG", {last, shared, list, 0}, le(0, 8)));
  return w.file;
}

TEST(MdfColumns, ListsOfColumnsShareTheMasterOfAnotherGroup) {
  const Recording r = read_recording(columns_file(6), "a.mf4");
  ASSERT_EQ(r.channels.size(), 1u);
  EXPECT_EQ(r.channels[0].name, "x");
  EXPECT_THAT(r.channels[0].time, ElementsAre(0, 0.5, 1, 1.5, 2, 2.5));
  EXPECT_THAT(r.channels[0].values,
              ElementsAre(100, 101, 102, 103, NanSensitiveDoubleEq(kNaN), 105));
  try {
    read_recording(columns_file(5), "a.mf4");
    FAIL() << "times of another number of rows were taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("groups that share another's time and have another number"));
  }
}

}  // namespace
}  // namespace sparflow
