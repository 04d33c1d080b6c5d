#pragma once
/// Formats numbers for the reports of identification and diagnosis.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

namespace sparflow {

/// Fixed notation with two decimals below 10, one below 100 and none above: 0.12, 1.23, 12.3, 123, 1234.
inline std::string short_number(double value) {
  const double size = std::abs(value);
  return fmt::format("{:.{}f}", value, size >= 100.0 ? 0 : size >= 10.0 ? 1 : 2);
}

/// Fixed notation with at least `digits` significant digits: 12170, 0.0123; "-" for NaN and infinity.
inline std::string plain_number(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  if (value == 0.0) return "0";
  const int before = static_cast<int>(std::floor(std::log10(std::abs(value)))) + 1;
  return fmt::format("{:.{}f}", value, std::clamp(digits - before, 0, 9));
}

/// Half width of a parameter's 95 % interval, over the larger of its value and its typical size, from which the logs do not
/// determine it and no output shows it to a person.
/// @threshold [1] 1..100; chosen: of three times the size at which an effect is clearly seen, nothing is known
inline constexpr double kUndeterminedWidth = 3.0;

/// Whether an interval says something about a parameter. An interval that is not known (NaN) is no reason to hide a value.
/// @param typical size at which the effect is clearly visible, in the unit of the others; 0 = not known
inline bool is_determined(double value, double lower95, double upper95, double typical) {
  if (std::isnan(lower95) || std::isnan(upper95)) return true;
  const double half = 0.5 * (upper95 - lower95);
  return half <= kUndeterminedWidth * std::max(std::abs(value), std::abs(typical));
}

/// Fixed notation with `decimals`, without a sign before a zero: 0.0, never -0.0.
inline std::string fixed_number(double value, int decimals) {
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  const bool zero = text.find_first_not_of("-0.") == std::string::npos;
  return zero && text.front() == '-' ? text.substr(1) : text;
}

/// @return null for NaN and infinity, which JSON cannot represent
inline nlohmann::json json_number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

}  // namespace sparflow
