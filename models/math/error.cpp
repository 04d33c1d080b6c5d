#include "models/math/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "models/math/door.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

std::string sentence(const FilePlace& where, const std::string& key, const std::string& message) {
  std::string text = where.file;
  if (where.line > 0) text += fmt::format(":{}", where.line);
  if (where.line > 0 && where.column > 0) text += fmt::format(":{}", where.column);
  if (!text.empty()) text += ": ";
  if (!key.empty()) text += key + ": ";
  return harmless(text + message, QuoteOptions{}.sentence);
}

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replace});
    }
  }
  return row.back();
}

}  // namespace

InputError::InputError(FilePlace where, std::string key_path, const std::string& message)
    : std::runtime_error(sentence(where, key_path, message)),
      place(std::move(where)),
      key(std::move(key_path)) {}

void check_failed(const char* expression, const char* file, int line, const std::string& message) {
  throw std::logic_error(
      fmt::format("internal error: {} ({} at {}:{})", message, expression, file, line));
}

std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string read_file(const std::string& path) { return read_text(path); }

}  // namespace sparflow
