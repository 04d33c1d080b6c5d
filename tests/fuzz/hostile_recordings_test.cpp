/// 3,000 changed files each of the formats of recordings that a bus logger or a robot writes: none may crash the reader, hold it
/// up or make it take memory without bound. Counts are printed; `./run hostile` runs this under sanitizers.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>

#include "tests/fuzz/mutation.h"

namespace sparflow::fuzz {
namespace {

constexpr int kFiles = 3000;
/// Longest time that one file of some kilobytes may take [s]: a thousand times what most take under sanitizers.
constexpr unsigned kLongest = 10;
/// Memory of the process [MB], as `./run fuzz` permits: files are below 20 kB and values limited to a million, of 16 bytes
/// each; the rest is what sanitizers keep of memory that was given back.
constexpr long kLargestMemory = 2000;

struct Format {
  const char* name;    ///< as it is printed
  const char* target;  ///< the reader
  const char* ending;  ///< of the files in its corpus
};

/// What is being read, for the alarm, which may not build texts.
char g_reading[80] = "";

void end_by_alarm(int) {
  const char* const words = " is read for more than ten seconds\n";
  if (::write(STDERR_FILENO, g_reading, std::strlen(g_reading)) < 0 ||
      ::write(STDERR_FILENO, words, std::strlen(words)) < 0)
    ::_exit(3);
  ::_exit(2);
}

long largest_memory() {  // [MB]
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

class HostileRecordings : public testing::TestWithParam<Format> {};

TEST_P(HostileRecordings, ThreeThousandOfAFormatAreAnswered) {
  const Format format = GetParam();
  const auto target = std::find_if(targets().begin(), targets().end(), [&](const Target& t) {
    return std::strcmp(t.name, format.target) == 0;
  });
  ASSERT_NE(target, targets().end());
  std::vector<Sample> corpus = corpus_of(*target);
  std::erase_if(corpus, [&](const Sample& s) { return !s.name.ends_with(format.ending); });
  ASSERT_FALSE(corpus.empty());
  std::signal(SIGALRM, end_by_alarm);
  Random random(3000);
  int read = 0;
  double slowest = 0.0;
  for (int k = 0; k < kFiles; ++k) {
    // Half of them keep their length, without which most would be refused at the first link.
    const std::string bytes =
        k % 2 == 0 ? changed(corpus, random) : changed_in_place(corpus, random);
    std::snprintf(g_reading, sizeof g_reading, "%s: changed file %d", format.name, k);
    const auto begin = std::chrono::steady_clock::now();
    ::alarm(kLongest);
    try {
      read += target->read(bytes) ? 1 : 0;
    } catch (const std::exception& e) {
      FAIL() << g_reading << ": " << e.what();
    }
    ::alarm(0);
    slowest = std::max(
        slowest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  const long memory = largest_memory();
  std::printf("%s: %d changed files of %zu: %d read, %d refused; slowest %.0f ms, memory %ld MB\n",
              format.name, kFiles, corpus.size(), read, kFiles - read, 1e3 * slowest, memory);
  EXPECT_LT(memory, kLargestMemory);
  // Changes that the reader took for no recording at all would try nothing behind its first bytes.
  // MCAP has checksums and lengths everywhere, so that one in thirty is read.
  EXPECT_GT(read, kFiles / 50);
  EXPECT_GT(kFiles - read, kFiles / 50);
}

std::string format_name(const testing::TestParamInfo<Format>& format) { return format.param.name; }
INSTANTIATE_TEST_SUITE_P(Formats, HostileRecordings,
                         testing::Values(Format{"MDF4", "recording", ".mf4"},
                                         Format{"DBC", "dbc", ".dbc"},
                                         Format{"MCAP", "recording", ".mcap"}),
                         format_name);

}  // namespace
}  // namespace sparflow::fuzz
