/// Tests of the one clock: which instants it has, and that no value is invented between samples too far apart.
#include "identification/log/one_clock.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/math/error.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

RecordedChannel recorded(const std::string& name, const std::string& group, double step, int count,
                         double start = 0.0) {
  RecordedChannel c;
  c.name = name;
  c.group = group;
  for (int i = 0; i < count; ++i) {
    c.time.push_back(start + step * i);
    c.values.push_back(3.0 * c.time.back() + 0.25);  // a line, which linear interpolation repeats
  }
  return c;
}

const std::vector<double>& column(const RawTable& table, const std::string& name) {
  for (const RawColumn& c : table.columns) {
    if (c.name == name) return c.values;
  }
  throw std::runtime_error("no column " + name);
}

double line(double t) { return 3.0 * t + 0.25; }

TEST(OneClock, AGroupWithHalfOfTheChannelsKeepsItsStamps) {
  Recording r;
  r.channels = {recorded("a", "fast", 0.02, 51), recorded("b", "fast", 0.02, 51),
                recorded("c", "slow", 0.1, 11)};
  r.channels[0].time[7] += 0.003, r.channels[1].time[7] += 0.003;  // kept as it is
  const RawTable table = on_one_clock(r);
  EXPECT_EQ(column(table, "t_s"), r.channels[0].time);
  EXPECT_EQ(column(table, "a"), r.channels[0].values);
  const auto& c = column(table, "c");
  for (std::size_t i = 0; i < c.size(); ++i) {
    EXPECT_NEAR(c[i], line(r.channels[0].time[i]), 1e-12) << i;  // rounding
  }
  EXPECT_THAT(table.dialect, HasSubstr("the time stamps of 2 channels (fast)"));
}

TEST(OneClock, WithoutSuchAGroupTheGridHasTheFastestRate) {
  Recording r;
  r.channels = {recorded("a", "1", 0.01, 101), recorded("b", "2", 0.01, 101, 0.003),
                recorded("c", "3", 0.05, 21)};
  const RawTable table = on_one_clock(r);
  const auto& t = column(table, "t_s");
  ASSERT_EQ(t.size(), 101u);
  EXPECT_DOUBLE_EQ(t[60], 0.6);
  EXPECT_TRUE(std::isnan(column(table, "b")[0]));  // before its first sample
  EXPECT_NEAR(column(table, "b")[1], line(0.01), 1e-12);
  EXPECT_NEAR(column(table, "c")[100], line(1.0), 1e-12);
  EXPECT_THAT(table.dialect, HasSubstr("a row every 0.01 s"));
}

TEST(OneClock, NothingIsInventedInAGap) {
  Recording r;
  r.channels = {recorded("a", "1", 0.01, 201), recorded("b", "2", 0.02, 101)};
  RecordedChannel& b = r.channels[1];
  b.time.erase(b.time.begin() + 30, b.time.begin() + 40);
  b.values.erase(b.values.begin() + 30, b.values.begin() + 40);
  const RawTable table = on_one_clock(r);
  const auto& t = column(table, "t_s");
  for (std::size_t i = 0; i < t.size(); ++i) {
    const bool inside = t[i] > 0.5801 && t[i] < 0.7999;
    EXPECT_EQ(std::isnan(column(table, "b")[i]), inside) << t[i];
  }
}

TEST(OneClock, WhereAllChannelsHaveAGapNoRowsStand) {
  Recording r;
  r.channels = {recorded("a", "1", 0.01, 100), recorded("b", "2", 0.01, 100, 0.001)};
  for (RecordedChannel& c : r.channels) {
    for (std::size_t i = 50; i < 100; ++i) c.time[i] += 3600.0;
  }
  const auto table = on_one_clock(r);
  EXPECT_THAT(column(table, "t_s").size(), testing::Le(101u));
  EXPECT_GT(column(table, "t_s").back(), 3600.0);
}

TEST(OneClock, StatesAreHeldAndReadingsInterpolated) {
  Recording r;
  r.channels = {recorded("a", "1", 0.01, 5), recorded("gear", "2", 0.02, 3)};
  r.channels[1].values = {1.0, 3.0, 3.0};
  EXPECT_THAT(column(on_one_clock(r), "gear"), ElementsAre(1.0, 1.0, 3.0, 3.0, 3.0));
  r.channels[1].values = {1.0, 3.5, 3.0};
  EXPECT_THAT(column(on_one_clock(r), "gear"),
              ElementsAre(1.0, DoubleNear(2.25, 1e-9), 3.5, DoubleNear(3.25, 1e-9), 3.0));
}

TEST(OneClock, BesideASampleThatIsNotValidNothingIsInterpolated) {
  Recording r;
  r.channels = {recorded("a", "1", 0.01, 7), recorded("b", "2", 0.02, 4)};
  r.channels[1].values[1] = kNaN;
  const auto table = on_one_clock(r);
  const auto& b = column(table, "b");
  EXPECT_FALSE(std::isnan(b[0]));
  EXPECT_TRUE(std::isnan(b[1]) && std::isnan(b[2]) && std::isnan(b[3]));
  EXPECT_FALSE(std::isnan(b[4]));
}

TEST(OneClock, TheLeadingChannelsAndTheGivenStepDecide) {
  Recording r;
  r.channels = {recorded("noise", "1", 0.001, 1001), recorded("a", "2", 0.02, 51),
                recorded("b", "3", 0.02, 51, 0.001)};
  ClockOptions options;
  options.leading = {1, 2};
  EXPECT_THAT(column(on_one_clock(r, options), "t_s"), SizeIs(51));
  options.step = 0.1;
  EXPECT_THAT(column(on_one_clock(r, options), "t_s"), SizeIs(11));
}

TEST(OneClock, WhatHasNoRateIsLeftOutWithASentence) {
  Recording r;
  r.channels = {recorded("a", "1", 0.01, 5), recorded("once", "2", 1.0, 1),
                recorded("back", "3", -0.1, 4)};
  const RawTable table = on_one_clock(r);
  EXPECT_THAT(table.columns, SizeIs(2));
  ASSERT_THAT(table.warnings, SizeIs(2));
  EXPECT_THAT(table.warnings[0], HasSubstr("fewer than two instants (once)"));
  EXPECT_THAT(table.warnings[1], HasSubstr("time decreases (back)"));
}

TEST(OneClock, TooManyRowsAreRefusedBeforeTheyAreMade) {
  Recording r;
  r.channels = {recorded("a", "1", 0.01, 5), recorded("b", "2", 1e12, 5),
                recorded("c", "3", 0.01, 5)};
  ClockOptions options;
  options.step = 1e-9;
  options.leading = {1};
  EXPECT_THROW(on_one_clock(r, options), InputError);
  options.step = 1e-300;
  options.leading = {0};
  EXPECT_THROW(on_one_clock(r, options), InputError);
}

}  // namespace
}  // namespace sparflow
