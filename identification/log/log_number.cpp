#include "identification/log/log_number.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

namespace sparflow {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Parses a whole cell with a decimal point. A number that underflows gives 0.
/// @return false for text and for numbers that overflow
bool parse(std::string_view cell, double* value) {
  if (!cell.empty() && cell.front() == '+') cell.remove_prefix(1);
  const char* end = cell.data() + cell.size();
  const auto [stop, error] = std::from_chars(cell.data(), end, *value);
  if (stop != end || error == std::errc::invalid_argument) return false;
  if (error == std::errc::result_out_of_range) {
    if (cell.find("e-") == cell.npos && cell.find("E-") == cell.npos) return false;
    *value = 0.0;
  }
  return true;
}

bool equal_ignoring_case(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return lower(x) == lower(y); });
}

/// @return true for digits in groups of three: 1.234,5  1,234.5  1.234.567  1 234,5  1'234.5
bool looks_like_thousands(std::string_view cell) {
  if (!cell.empty() && (cell.front() == '-' || cell.front() == '+')) cell.remove_prefix(1);
  std::size_t i = 0;
  while (i < cell.size() && is_digit(cell[i])) ++i;
  if (i == 0 || i > 3) return false;
  int separators = 0;
  bool blank = false;
  while (i < cell.size()) {
    const char mark = cell[i];
    if (mark != '.' && mark != ',' && mark != ' ' && mark != '\'') return false;
    std::size_t digits = 0;
    while (i + 1 + digits < cell.size() && is_digit(cell[i + 1 + digits])) ++digits;
    const bool last = i + 1 + digits == cell.size();
    ++separators;
    blank = blank || mark == ' ' || mark == '\'';
    if (digits != 3 && !(last && (mark == '.' || mark == ','))) return false;
    i += 1 + digits;
  }
  return separators >= 2 || (separators == 1 && blank);
}

}  // namespace

CellReader::CellReader(char decimal, std::vector<std::string> missing)
    : decimal_(decimal), missing_(std::move(missing)) {}

Cell CellReader::read(std::string_view cell) {
  if (cell.empty()) return {};
  if (decimal_ != ',' && missing_.empty()) {  // the common case
    double value = 0.0;
    if (parse(cell, &value)) {
      if (!std::isfinite(value)) return {};
      if (decimal_ == 0 && cell.find('.') != cell.npos) decimal_ = '.';
      return {CellKind::kNumber, value};
    }
  }
  return read_odd(cell);
}

Cell CellReader::read_odd(std::string_view cell) {
  for (const std::string& mark : missing_) {
    if (cell == mark) return {};
  }
  static constexpr std::array<std::string_view, 15> kMissing = {
      "-",   "--",   "?",    "nan", "-nan", "na",      "n/a",    "#n/a",
      "#nv", "null", "none", "inf", "-inf", "1.#qnan", "-1.#ind"};
  for (const std::string_view mark : kMissing) {
    if (equal_ignoring_case(cell, mark)) return {};
  }
  double value = 0.0;
  const bool has_point = cell.find('.') != cell.npos;
  const bool has_comma = cell.find(',') != cell.npos;
  if (!has_comma && parse(cell, &value)) {
    if (!std::isfinite(value)) return {};
    if (has_point && decimal_ == ',') return {CellKind::kOtherMark, 0.0};
    if (has_point) decimal_ = '.';
    return {CellKind::kNumber, value};
  }
  if (has_comma && !has_point && cell.size() < 64) {
    std::array<char, 64> copy{};
    std::replace_copy(cell.begin(), cell.end(), copy.begin(), ',', '.');
    if (parse({copy.data(), cell.size()}, &value)) {
      if (decimal_ == '.') return {CellKind::kOtherMark, 0.0};
      decimal_ = ',';
      return {CellKind::kNumber, value};
    }
  }
  return {looks_like_thousands(cell) ? CellKind::kThousands : CellKind::kText, 0.0};
}

}  // namespace sparflow
