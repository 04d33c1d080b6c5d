/// Every dialect of text gives the same numbers; the reading speed is measured.
#include "identification/log/log_dialect.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <cmath>

#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using test::LogFiles;
using test::plain_log;
using testing::IsEmpty;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string utf16(const std::string& ascii, bool big_endian) {
  std::string out = big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : ascii) {
    if (big_endian) out += '\0';
    out += c;
    if (!big_endian) out += '\0';
  }
  return out;
}

/// Name, the plain log in that dialect.
struct Dialect {
  std::string name, text;
};

std::vector<Dialect> dialects() {
  const std::string plain = plain_log();
  const std::size_t first_row = plain.find('\n') + 1;
  const std::string header = plain.substr(0, first_row), rows = plain.substr(first_row);
  const std::string european = replaced(replaced(plain, ",", ";"), ".", ",");
  std::string quoted;
  for (std::size_t at = 0; at < plain.size();) {
    const std::size_t end = plain.find('\n', at);
    quoted += "\"" + replaced(plain.substr(at, end - at), ",", "\",\"") + "\"\n";
    at = end + 1;
  }
  return {
      {"semicolon", replaced(plain, ",", ";")},
      {"tab", replaced(plain, ",", "\t")},
      {"blanks", replaced(plain, ",", "   ")},
      {"decimal comma, semicolon", european},
      {"decimal comma, tab", replaced(european, ";", "\t")},
      {"decimal comma, quoted, comma",
       replaced(replaced(replaced(quoted, "\",\"", "\x01"), ".", ","), "\x01", "\",\"")},
      {"quoted", quoted},
      {"byte order mark", "\xEF\xBB\xBF" + plain},
      {"UTF-16 little endian", utf16(plain, false)},
      {"UTF-16 big endian", utf16(plain, true)},
      {"CRLF", replaced(plain, "\n", "\r\n")},
      {"CR", replaced(plain, "\n", "\r")},
      {"no line end at the end", plain.substr(0, plain.size() - 1)},
      {"blank lines", replaced(plain, "\n", "\n\n")},
      {"comments", "# recorded on a cold day\n" + header + "# start\n" + rows + "# end\n"},
      {"header in a comment", "# " + plain},
      {"trailing separators", replaced(plain, "\n", ",\n")},
      {"trailing separators under the header only", header + replaced(rows, "\n", ",,\n")},
      {"blanks around", replaced(plain, ",", " , ")},
      {"units row", header + "s,rad,m,-,bar,bar,kg,°C\n" + rows},
      {"units row in brackets", header + "[s],[rad],[m],[-],[bar],[bar],[kg],[°C]\n" + rows},
      {"spreadsheet hint", "sep=;\r\n" + replaced(replaced(plain, ",", ";"), "\n", "\r\n")},
      {"plus signs and exponents",
       replaced(replaced(plain, ",0.25,", ",+2.5e-1,"), ",800,", ",8E2,")},
      {"units beside names",
       "t [s],q_boom (rad),q_extension [m],u_boom,pA_boom [bar],p_main [bar],payload [kg],oil "
       "[degC]\n" +
           rows},
      {"units below names",
       "t,q_boom,q_extension,u_boom,pA_boom,p_main,payload,oil\ns,rad,m,,bar,bar,kg,C\n" + rows},
  };
}

TEST_F(LogFiles, SameNumbersFromEveryDialect) {
  const Log plain = load_log(write("plain.csv", plain_log()), test::small_crane());
  for (const Dialect& dialect : dialects()) {
    SCOPED_TRACE(dialect.name);
    Log log;
    ASSERT_NO_THROW(log = load(dialect.text));
    ASSERT_EQ(log.samples(), plain.samples());
    ASSERT_EQ(log.channels.size(), plain.channels.size());
    EXPECT_EQ(log.time, plain.time);
    for (std::size_t i = 0; i < plain.channels.size(); ++i) {
      EXPECT_EQ(log.channels[i].signal, plain.channels[i].signal);
      EXPECT_EQ(log.channels[i].values, plain.channels[i].values) << plain.channels[i].signal;
    }
    EXPECT_THAT(log.warnings, IsEmpty());
  }
}

TEST_F(LogFiles, DialectIsDescribedInWords) {
  EXPECT_EQ(load(plain_log()).dialect, "\",\" between values, decimal point");
  EXPECT_EQ(load(replaced(replaced(plain_log(), ",", ";"), ".", ",")).dialect,
            "\";\" between values, decimal comma");
}

TEST(ReadingSpeed, IsReported) {  // not asserted, because it depends on the computer
  std::string text = "t_s";
  for (int c = 0; c < 15; ++c) text += fmt::format(",signal_{}", c);
  text += '\n';
  for (int i = 0; i < 15000; ++i) {
    text += fmt::format("{:.3f}", 0.02 * i);
    for (int c = 0; c < 15; ++c) text += fmt::format(",{:.4f}", std::sin(0.01 * i + c) * 100.0);
    text += '\n';
  }
  double best = 1e9;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    const RawTable table = read_delimited("log.csv", text);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    best = std::min(best, took.count());
    ASSERT_EQ(table.rows(), 15000u);
  }
  const double rate = static_cast<double>(text.size()) / best / 1e6;
  RecordProperty("megabytes_per_second", fmt::format("{:.0f}", rate));
  fmt::print("reading {:.1f} MB, 15 000 rows: {:.1f} ms, {:.0f} MB/s\n",
             static_cast<double>(text.size()) / 1e6, best * 1e3, rate);
}

}  // namespace
}  // namespace sparflow
