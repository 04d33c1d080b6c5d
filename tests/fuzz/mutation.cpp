#include "tests/fuzz/mutation.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace sparflow::fuzz {
namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

const std::vector<std::string>& words() {
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
  return kWords;
}

/// Writes a length, link or count over what stands there: one that is just inside, just beyond or far beyond the file.
void put_number(std::string& text, std::size_t at, Random& random) {
  const std::array<std::uint64_t, 9> numbers = {0,
                                                1,
                                                text.size() - 1,
                                                text.size(),
                                                below(random, text.size() + 1) / 8 * 8,
                                                0x7FFFFFFF,
                                                0xFFFFFFFF,
                                                0x7FFFFFFFFFFFFFFF,
                                                0xFFFFFFFFFFFFFFFF};
  const std::uint64_t number = numbers[below(random, numbers.size())];
  const std::array<std::size_t, 3> widths = {2, 4, 8};
  const std::size_t width = widths[below(random, widths.size())];
  // links of MDF stand at multiples of eight
  if (below(random, 2) == 0) at = at / 8 * 8;
  for (std::size_t k = 0; k < width && at + k < text.size(); ++k)
    text[at + k] = static_cast<char>(number >> (8 * k) & 0xFF);
}

}  // namespace

std::vector<Sample> corpus_of(const Target& target) {
  std::vector<fs::path> files;
  for (const std::string& seed : target.seeds) {
    files.push_back(fs::path(SPARFLOW_SOURCE_DIR) / "problems" / seed);
  }
  const fs::path folder = fs::path(SPARFLOW_SOURCE_DIR) / "tests/fuzz/corpus" / target.name;
  if (fs::is_directory(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Sample> corpus;
  corpus.reserve(files.size());
  for (const fs::path& file : files) corpus.push_back({file.filename().string(), content(file)});
  return corpus;
}

std::size_t below(Random& random, std::size_t n) {
  return n == 0 ? 0 : std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
}

std::string changed(const std::vector<Sample>& corpus, Random& random) {
  std::string text = corpus[below(random, corpus.size())].bytes;
  const std::size_t edits = 1 + below(random, 8);
  for (std::size_t e = 0; e < edits; ++e) {
    const std::size_t at = below(random, text.size() + 1);
    const std::size_t length = std::min(below(random, 40), text.size() - at);
    switch (below(random, 8)) {
      case 0:
        text.insert(at, words()[below(random, words().size())]);
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
      case 6:
        put_number(text, at, random);
        break;
      default: {
        const std::string& other = corpus[below(random, corpus.size())].bytes;
        text.insert(at, other.substr(below(random, other.size() + 1), 60));
        break;
      }
    }
  }
  return text;
}

std::string changed_in_place(const std::vector<Sample>& corpus, Random& random) {
  std::string text = corpus[below(random, corpus.size())].bytes;
  if (text.empty()) return text;
  const std::size_t edits = 1 + below(random, 3);
  for (std::size_t e = 0; e < edits; ++e) {
    const std::size_t at = below(random, text.size());
    switch (below(random, 3)) {
      case 0:
        text[at] = static_cast<char>(below(random, 256));
        break;
      case 1:
        text[at] = static_cast<char>(text[at] ^ static_cast<char>(1U << below(random, 8)));
        break;
      default:
        put_number(text, at, random);
        break;
    }
  }
  return text;
}

}  // namespace sparflow::fuzz
