/// Bit numbering of DBC files: the example of canmatrix's documentation (signal byte order) and frames packed by hand.
#include "identification/log/recordings/can/dbc.h"

#include <gmock/gmock.h>

#include <array>
#include <random>

#include "models/math/error.h"

namespace sparflow {
namespace {

const std::string kText =
    "VERSION \"\"\nNS_ :\n\tCM_\n\tSG_MUL_VAL_\nBS_:\nBU_: A\n"
    "BO_ 291 Frame: 8 ECU\n"
    " SG_ signal1 : 7|32@0- (1,0) [0|0] \"\" ECU\n"
    " SG_ signal2 : 39|32@0- (1,0) [0|0] \"\" ECU\n"
    "BO_ 2147483650 Mux: 8 A\n"
    " SG_ M0 M : 0|8@1+ (1,0) [0|0] \"\" A\n"
    " SG_ a m0 : 12|12@1- (0.5,1) [0|0] \"bar\" A\n"
    " SG_ b m1 : 11|4@0+ (1,0) [0|0] \"\" A\n"
    "CM_ SG_ 2147483650 a \"text\nBO_ 1 no: 8 A\";\n"
    "SG_MUL_VAL_ 2147483650 b M0 1-1, 3-5;\n";

TEST(Dbc, SignalsStandWhereTheDocumentationsSay) {
  const Dbc dbc = parse_dbc("a.dbc", kText);
  ASSERT_EQ(dbc.messages.size(), 2u);
  const std::array<std::uint8_t, 8> frame = {0x12, 0x34, 0x56, 0x78, 0xFF, 0xFF, 0xFF, 0xFE};
  const auto& signals = dbc.messages[0].signals;
  EXPECT_EQ(dbc_bits(signals[0], frame), 0x12345678u);
  EXPECT_EQ(dbc_value(signals[1], dbc_bits(signals[1], frame)), -2.0);
  EXPECT_EQ(signals[1].bytes(), 8u);
  const DbcMessage& mux = dbc.messages[1];
  EXPECT_TRUE(mux.extended);
  EXPECT_EQ(mux.id, 2u);
  // bits 12 to 23, lowest first: 0xFFF is -1
  EXPECT_EQ(dbc_value(mux.signals[1],
                      dbc_bits(mux.signals[1], std::array<std::uint8_t, 8>{0, 0xF0, 0xFF})),
            0.5);
  // github.com/bit-dream/candied/issues/45: 11|4@0+ in 3, 65 is 1
  EXPECT_EQ(dbc_bits(mux.signals[2], std::array<std::uint8_t, 8>{3, 65, 13, 55}), 1u);
  EXPECT_EQ(mux.signals[2].switches.size(), 2u);
  EXPECT_EQ(mux.signals[2].parent, 0);
}

TEST(Dbc, ThreeThousandChangedFilesAreReadOrRefused) {
  std::mt19937 random(1);
  for (int k = 0; k < 3000; ++k) {
    std::string text = kText;
    for (int e = 0; e < 3; ++e) {
      const std::size_t at = random() % text.size();
      if (random() % 2 == 0) {
        text.erase(at, random() % 8);
      } else {
        text[at] = static_cast<char>(random() % 256);
      }
    }
    try {
      const Dbc dbc = parse_dbc("a.dbc", text);
      const std::array<std::uint8_t, 64> frame = {};
      for (const DbcMessage& m : dbc.messages) {
        for (const DbcSignal& s : m.signals) {
          ASSERT_LE(s.bytes(), 64u);
          dbc_value(s, dbc_bits(s, frame));
        }
      }
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace sparflow
