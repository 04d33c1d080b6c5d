#pragma once
/// Numbers as the reports of this room print them.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

namespace sparflow {

/// Three digits or more: 0.12, 1.23, 12.3, 123, 1234.
inline std::string short_number(double value) {
  const double size = std::abs(value);
  return fmt::format("{:.{}f}", value, size >= 100.0 ? 0 : size >= 10.0 ? 1 : 2);
}

/// Null where there is no number: JSON knows no NaN.
inline nlohmann::json json_number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

}  // namespace sparflow
