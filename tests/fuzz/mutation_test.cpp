/// Calls every reader with its corpus, the bundled files and seeded changes of them. It looks less far than libFuzzer
/// (`./run fuzz`), needs no other compiler, and sees a crash, an endless loop, and an exception that is no refusal.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "tests/fuzz/targets.h"

namespace sparflow::fuzz {
namespace {

namespace fs = std::filesystem;
using Random = std::mt19937_64;

std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<std::string> corpus_of(const Target& target) {
  std::vector<fs::path> files;
  for (const std::string& seed : target.seeds) {
    files.push_back(fs::path(SPARFLOW_SOURCE_DIR) / "problems" / seed);
  }
  const fs::path folder = fs::path(SPARFLOW_SOURCE_DIR) / "tests/fuzz/corpus" / target.name;
  if (fs::is_directory(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> corpus;
  for (const fs::path& file : files) corpus.push_back(content(file));
  return corpus;
}

std::size_t below(Random& random, std::size_t n) {
  return n == 0 ? 0 : std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
}

/// One to eight changes of bytes, stretches and words.
std::string changed(std::string text, const std::vector<std::string>& corpus, Random& random) {
  static const std::vector<std::string> kWords = {",",
                                                  ":",
                                                  "[",
                                                  "]",
                                                  "{",
                                                  "}",
                                                  "- ",
                                                  "\n",
                                                  "  ",
                                                  "\"",
                                                  "'",
                                                  "&a ",
                                                  "*a",
                                                  "!!",
                                                  "|",
                                                  "#",
                                                  "---\n",
                                                  "nan",
                                                  "1e308",
                                                  "-1",
                                                  "0",
                                                  "4294967295",
                                                  "\xFF",
                                                  std::string(4, '\0'),
                                                  std::string(2, '\xFF'),
                                                  "<",
                                                  ">",
                                                  "/>",
                                                  "<link>",
                                                  "(",
                                                  ")",
                                                  "^",
                                                  "1e-320",
                                                  "\x1b[2J",
                                                  "\xEF\xBB\xBF",
                                                  ";",
                                                  "\t",
                                                  "\r"};
  const std::size_t edits = 1 + below(random, 8);
  for (std::size_t e = 0; e < edits; ++e) {
    const std::size_t at = below(random, text.size() + 1);
    const std::size_t length = std::min(below(random, 40), text.size() - at);
    switch (below(random, 7)) {
      case 0:
        text.insert(at, kWords[below(random, kWords.size())]);
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        if (at < text.size()) text[at] = static_cast<char>(below(random, 256));
        break;
      case 3:
        text.insert(below(random, text.size() + 1), text.substr(at, length));
        break;
      case 4:
        text.resize(at);
        break;
      case 5:
        if (at < text.size())
          text[at] = static_cast<char>(text[at] ^ static_cast<char>(1U << below(random, 8)));
        break;
      default: {
        const std::string& other = corpus[below(random, corpus.size())];
        text.insert(at, other.substr(below(random, other.size() + 1), 60));
        break;
      }
    }
  }
  return text;
}

class EveryReader : public testing::TestWithParam<Target> {};

TEST_P(EveryReader, AnswersWhateverItGets) {
  const std::vector<std::string> corpus = corpus_of(GetParam());
  ASSERT_FALSE(corpus.empty());
  for (const std::string& text : corpus) GetParam().read(text);
  Random random(1);
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(1500);
  std::size_t tried = 0;
  // a number of tries that every machine reaches, and more where there is time
  while (tried < 200 || std::chrono::steady_clock::now() < end) {
    const std::string text = changed(corpus[below(random, corpus.size())], corpus, random);
    try {
      GetParam().read(text);
    } catch (const std::exception& e) {
      FAIL() << "try " << tried << ": " << e.what() << "\n" << text.substr(0, 2000);
    }
    ++tried;
  }
  RecordProperty("tries", static_cast<int>(tried));
}

std::string target_name(const testing::TestParamInfo<Target>& target) { return target.param.name; }
INSTANTIATE_TEST_SUITE_P(Readers, EveryReader, testing::ValuesIn(targets()), target_name);

}  // namespace
}  // namespace sparflow::fuzz
