/// Thousands of damaged files are either read or refused with an InputError.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "identification/log/log_dialect.h"
#include "identification/log/log_mapping.h"
#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using test::LogFiles;
using Random = std::mt19937;

std::size_t below(Random* random, std::size_t n) {
  return n == 0 ? 0 : std::uniform_int_distribution<std::size_t>(0, n - 1)(*random);
}

std::string seed_log(std::size_t kind) {
  const char sep = kind % 3 == 0 ? ',' : kind % 3 == 1 ? ';' : '\t';
  std::string text = "t_s,q_boom_rad,q_extension_m,u_boom,pA_boom_bar,note\n";
  if (kind % 2 == 0) text += "s,rad,m,-,bar,-\n";
  for (int i = 0; i < 40; ++i) {
    text += fmt::format("{:.3f},{:.4f},{:.4f},{:.2f},{},\"a {}\"\n", 0.02 * i, 0.5 + 0.001 * i,
                        1.0 + 0.002 * i, 0.25,
                        i % 9 == 4 ? std::string("nan") : fmt::format("{}", 80 + i), i);
  }
  for (char& c : text) {
    if (c == ',') c = sep;
    if (c == '.' && sep != ',' && kind % 5 == 0) c = ',';
  }
  return text;
}

std::string mutated(std::string text, Random* random) {
  static const std::vector<std::string> kPieces = {",",
                                                   ";",
                                                   "\t",
                                                   "\"",
                                                   "\n",
                                                   "\r",
                                                   "#",
                                                   "-",
                                                   ".",
                                                   "1.234,5",
                                                   "1e999",
                                                   "nan",
                                                   "inf",
                                                   "\xFF\xFE",
                                                   "\xEF\xBB\xBF",
                                                   std::string(3, '\0'),
                                                   "\xC3",
                                                   "t_s",
                                                   "q_boom_deg",
                                                   "sep=;\n",
                                                   "(",
                                                   "]",
                                                   "`",
                                                   " ",
                                                   "e",
                                                   "9999999999999999999999",
                                                   "0x1p3",
                                                   "+",
                                                   "--5",
                                                   "{",
                                                   "}",
                                                   ":",
                                                   "^",
                                                   "[ms]"};
  const std::size_t edits = 1 + below(random, 6);
  for (std::size_t e = 0; e < edits; ++e) {
    const std::size_t at = below(random, text.size() + 1);
    const std::size_t length = std::min(below(random, 30), text.size() - std::min(at, text.size()));
    switch (below(random, 6)) {
      case 0:
        text.insert(at, kPieces[below(random, kPieces.size())]);
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        text.insert(at, text.substr(at, length));
        break;
      case 3:
        if (at < text.size()) text[at] = static_cast<char>(below(random, 256));
        break;
      case 4:
        text.resize(at);
        break;
      case 5: {  // move a piece elsewhere
        const std::string piece = text.substr(at, length);
        text.erase(at, length);
        text.insert(below(random, text.size() + 1), piece);
        break;
      }
    }
  }
  return text;
}

/// Calls `load` and counts the outcome; anything but success and InputError fails the test.
template <class Load>
void expect_read_or_refused(Load load, const std::string& text, int* read, int* refused) {
  try {
    load();
    ++*read;
  } catch (const InputError& error) {
    ++*refused;
    EXPECT_GT(std::string(error.what()).size(), 10u);
  } catch (const std::exception& error) {
    ADD_FAILURE() << error.what() << "\n" << text;
  }
}

TEST_F(LogFiles, DamagedTextLogsAreReadOrRefused) {
  Random random(20250423);
  int read = 0, refused = 0;
  for (std::size_t i = 0; i < 4000; ++i) {
    const std::string text = mutated(seed_log(i), &random);
    expect_read_or_refused(
        [&] {
          const Log log = load(text);
          // A log that is read is consistent: time increases, runs cover the samples, marks and values agree.
          for (Eigen::Index k = 1; k < log.samples(); ++k) ASSERT_GT(log.time[k], log.time[k - 1]);
          Eigen::Index covered = 0;
          for (const SampleRange& run : log.runs) covered += run.size();
          ASSERT_EQ(covered, log.samples());
          for (const Channel& channel : log.channels) {
            ASSERT_TRUE((channel.values.array().isFinite() == channel.valid).all());
          }
        },
        text, &read, &refused);
  }
  EXPECT_GT(read, 400);  // both outcomes occur often, or the damage is not the right kind
  EXPECT_GT(refused, 400);
}

TEST_F(LogFiles, DamagedMappingFilesAreReadOrRefused) {
  Random random(7);
  const std::string seed =
      "columns:\n  t_s: \"t_s * 1\"\n  q_boom_rad: max(q_boom_rad, 0.1) ^ 1\n  a: (u_boom - 2) / "
      "`note` + sin(pi)\n"
      "ignore: [note]\ndelimiter: ','\nskip_rows: 0\nmissing: [-999]\n";
  const RawTable table = read_delimited("log.csv", seed_log(3));
  int read = 0, refused = 0;
  for (int i = 0; i < 1500; ++i) {
    const std::string text = mutated(seed, &random);
    expect_read_or_refused(
        [&] {
          RawTable copy = table;
          apply_mapping(parse_log_mapping("map.yaml", text), &copy);
        },
        text, &read, &refused);
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace sparflow
