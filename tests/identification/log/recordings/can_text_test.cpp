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

}  // namespace
}  // namespace sparflow
