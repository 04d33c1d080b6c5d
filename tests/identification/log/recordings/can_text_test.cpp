/// candump traces and the channels that a database makes of them.
#include "identification/log/recordings/can/can_text.h"

#include <gmock/gmock.h>

#include "models/math/error.h"
#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
class CanText : public test::LogFiles {};

TEST_F(CanText, FramesBecomeChannelsByTheDatabase) {
  RecordingOptions options;
  options.dbc_files = {write("a.dbc",
                             "BO_ 68 P: 5 A\n SG_ mux M : 0|8@1+ (1,0) [0|0] \"\" A\n"
                             " SG_ p m1 : 8|16@1- (0.1,0) [0|0] \"bar\" A\n")};
  const std::string trace =
      "(1436509052.250000) vcan0 044#01FFFF0000\n(1436509052.350000) vcan0 044#0200000000\n"
      "(1436509052.450000) vcan0 044##0010A000000\n(1436509052.500000) vcan0 0000044A#00\n";
  ASSERT_TRUE(is_recording(trace));
  const Recording r = read_recording(trace, "a.log", options);
  ASSERT_EQ(r.channels.size(), 2u);
  EXPECT_THAT(r.channels[0].values, ElementsAre(1, 2, 1));
  EXPECT_THAT(r.channels[1].values, ElementsAre(testing::DoubleNear(-0.1, 1e-12), 1.0));
  EXPECT_NEAR(r.channels[1].time[1], 0.2, 1e-6);  // stamps of 1970 have 2e-7 s
  EXPECT_THAT(r.warnings[0], HasSubstr("44Ax (1 frames)"));
  EXPECT_THAT(message_of([&] { read_recording(trace, "a.log"); }),
              HasSubstr("identifiers seen: 44 (3 frames), 44Ax (1 frames)"));
  EXPECT_THAT(message_of([&] { read_recording(trace + "(1) x\n", "a.log", options); }),
              HasSubstr("a.log:5"));
}

TEST_F(CanText, TheColumnsThatCandumpShowsAreReadAsItsLog) {
  RecordingOptions options;
  options.dbc_files = {write("a.dbc",
                             "BO_ 291 A: 8 E\n SG_ a : 0|16@1+ (1,0) [0|0] \"\" E\n"
                             "BO_ 2566848513 B: 12 E\n SG_ b : 88|8@1+ (1,0) [0|0] \"\" E\n")};
  const std::string trace =
      " (1436509052.250000)  can0  123   [8]  11 22 33 44 55 66 77 88\n"
      " (1436509052.350000)  can0  TX - -  123   [3]  12 00 23   '.##'\n"
      " (1436509052.450000)  can0  123   [0]  remote request\n"
      " (1436509052.500000)  can0  20000088   [8]  00 00 00 00 00 00 00 00   ERRORFRAME\n"
      " (1436509052.550000)  can0  18FF0001  [12]  00 00 00 00 00 00 00 00 00 00 00 2A\n";
  ASSERT_TRUE(is_recording(trace));
  const Recording r = read_recording(trace, "a.log", options);
  ASSERT_EQ(r.channels.size(), 2u);
  EXPECT_THAT(r.channels[0].values, ElementsAre(0x2211, 0x12));
  EXPECT_NEAR(r.channels[0].time[1], 0.1, 1e-6);  // stamps of 1970 have 2e-7 s
  EXPECT_THAT(r.channels[1].values, ElementsAre(42));
  EXPECT_NEAR(r.channels[1].time[0], 0.3, 1e-6);
  EXPECT_THAT(r.warnings[0], HasSubstr("2 remote and error frames left out"));
  // fewer bytes than the line says
  EXPECT_THAT(message_of([&] {
                read_recording(trace + " (1436509053.0)  can0  123   [3]  11 22\n", "a.log",
                               options);
              }),
              HasSubstr("a.log:6"));
  const std::string plain = "  can0  123   [8]  11 22 33 44 55 66 77 88\n";
  ASSERT_TRUE(is_recording(plain));
  EXPECT_THAT(message_of([&] { read_recording(plain, "a.log", options); }),
              HasSubstr("a.log:1: the frames have no time stamps; record the trace with `candump "
                        "-l`, or with `candump -ta`"));
  EXPECT_FALSE(is_recording("t_s,q [rad]\n0,1\n"));
}

TEST_F(CanText, AscHasEventsFdFramesAndTwoKindsOfNumbers) {
  RecordingOptions options;
  options.dbc_files = {write("a.dbc",
                             "BO_ 291 A: 8 E\n SG_ a : 0|16@1+ (1,0) [0|0] \"\" E\n"
                             "BO_ 2566848513 B: 12 E\n SG_ b : 80|8@1+ (1,0) [0|0] \"\" E\n")};
  const std::string head = "date Wed Nov 25 09:21:13.159 am 2026\n";
  const std::string hex =
      head +
      "base hex  timestamps absolute\ninternal events logged\n// version 9.0.0\n"
      "Begin Triggerblock Wed Nov 25 09:21:13.159 am 2026\n"
      "   0.000000 Start of measurement\n"
      "   2.500000 1  123             Rx   d 2 28 0A  Length = 0 BitCount = 0\n"
      "   2.510000 1  ErrorFrame\n   2.520000 1  123  Tx   r\n"
      "   2.530000 CANFD   1 Rx 18FF0001x  Name 1 0 9 12 0 0 0 0 0 0 0 0 0 0 7F 0 1 2\n"
      "   2.540000 CANFD   1 Rx 18FF0001x  1 0 9 12 0 0 0 0 0 0 0 0 0 0 80 0\n"
      "   2.600000 1  123             Rx   d 2 FF 00\nEnd TriggerBlock\n";
  ASSERT_TRUE(is_recording(hex));
  const Recording r = read_recording(hex, "a.asc", options);
  ASSERT_EQ(r.channels.size(), 2u);
  EXPECT_THAT(r.channels[0].values, ElementsAre(0x0A28, 255));
  EXPECT_NEAR(r.channels[0].time[1], 0.1, 1e-12);
  EXPECT_THAT(r.channels[1].values, ElementsAre(0x7F, 0x80));
  EXPECT_THAT(r.warnings, testing::Contains(HasSubstr("3 lines that are no data frames")));

  const std::string dec = head +
                          "base dec  timestamps relative\n"
                          "   1.0 1  291  Rx   d 2 40 10\n   0.5 1  291  Rx   d 2 255 0\n";
  const Recording d = read_recording(dec, "a.asc", options);
  EXPECT_THAT(d.channels.at(0).values, ElementsAre(0x0A28, 255));
  EXPECT_NEAR(d.channels[0].time[1], 0.5, 1e-12);
  EXPECT_THAT(message_of([&] {
                read_recording(head + "base hex  timestamps absolute\n 1.0 1 123 Rx d 2 28\n",
                               "a.asc", options);
              }),
              HasSubstr("a.asc:3"));
  EXPECT_THAT(message_of([&] {
                read_recording(hex + "   2.100000 1  123  Rx   d 2 28 0A\n", "a.asc", options);
              }),
              HasSubstr("time decreases"));
}

}  // namespace
}  // namespace sparflow
