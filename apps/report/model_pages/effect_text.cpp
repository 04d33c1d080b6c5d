#include "apps/report/model_pages/effect_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/page/page.h"
#include "identification/comparison/report_numbers.h"

namespace sparflow {
namespace {

using Eigen::Index;

/// Significant digits of a value that show its interval's half-width with two digits.
int digits_for(double value, double half_width) {
  if (!(half_width > 0.0) || value == 0.0) return 4;
  const double ratio = std::max(std::abs(value), half_width) / half_width;
  return std::clamp(2 + static_cast<int>(std::floor(std::log10(ratio))), 2, 6);
}

}  // namespace

std::pair<double, std::string> readable_error(double si, const FieldUnit& unit) {
  if (unit.name == "N" && std::abs(si) >= 1e3) return {si / 1e3, "kN"};
  return {si / unit.si, unit.name};
}

std::string parameter_text(const ParameterEstimate& p) {
  if (!p.determined) return p.name + " is not determined by these logs";
  double scale = 1.0;
  std::string unit = p.unit;
  if (unit == "N" && std::max(std::abs(p.value), std::abs(p.upper95)) >= 1e3) {
    scale = 1e-3;
    unit = "kN";
  }
  const double value = scale * p.value, lower = scale * p.lower95, upper = scale * p.upper95;
  const std::string tail = unit.empty() || unit == "-" ? "" : " " + unit;
  if (!p.variant.empty()) return fmt::format("{} {:g} ({})", p.name, value, p.variant);
  if (!std::isfinite(lower) || !std::isfinite(upper))
    return fmt::format("{} {}{}", p.name, display_number(value, 4), tail);
  if (lower == upper) return fmt::format("{} {:g}{}", p.name, value, tail);
  const double half = 0.5 * (upper - lower);
  const int digits = digits_for(value, half);
  if (std::abs(value - 0.5 * (lower + upper)) < 0.05 * half) {
    return fmt::format("{} {} \u00B1 {}{}", p.name, display_number(value, digits),
                       display_number(half, 2), tail);
  }
  return fmt::format("{} {} ({} to {}){}", p.name, display_number(value, digits),
                     display_number(lower, digits), display_number(upper, digits), tail);
}

std::string parameters_text(const std::vector<ParameterEstimate>& parameters) {
  std::string text;
  for (const ParameterEstimate& p : parameters)
    text += (text.empty() ? "" : ", ") + parameter_text(p);
  return text;
}

std::vector<ParameterEstimate> estimates_of(const AppliedEffect& effect) {
  std::vector<ParameterEstimate> out;
  const auto& parameters = effect.effect->info().parameters;
  for (std::size_t i = 0; i < effect.values.size(); ++i) {
    const EffectParameter& p = parameters[i];
    if (is_absent(p, effect.values[i])) continue;
    const bool known = i < effect.lower95.size() && i < effect.upper95.size();
    out.push_back(
        {p.name, p.unit, p.meaning, effect.values[i] / p.si,
         known ? effect.lower95[i] / p.si : std::nan(""),
         known ? effect.upper95[i] / p.si : std::nan(""),
         !known || p.choice ||
             is_determined(effect.values[i], effect.lower95[i], effect.upper95[i], p.typical),
         variant_text(p, effect.values[i])});
  }
  return out;
}

std::string change_text(double ratio) {
  if (!std::isfinite(ratio)) return "\u2014";
  const double percent = 100.0 * (ratio - 1.0);
  if (std::abs(percent) < 0.5) return "unchanged";
  if (ratio >= 2.0) return fmt::format("{} times as large", display_number(ratio, 2));
  return fmt::format("{:.0f} % {}", std::abs(percent), percent < 0.0 ? "smaller" : "larger");
}

Stretch best_stretch(const Eigen::VectorXd& time, const Eigen::VectorXd& gain, double length) {
  const Index n = time.size();
  Stretch best{0, n};
  double sum = 0.0, most = -std::numeric_limits<double>::infinity();
  for (Index first = 0, last = 0; last < n;) {
    sum += std::isfinite(gain[last]) ? gain[last] : 0.0;
    ++last;
    while (time[last - 1] - time[first] > length) {
      sum -= std::isfinite(gain[first]) ? gain[first] : 0.0;
      ++first;
    }
    if (sum > most) {
      most = sum;
      best = {first, last};
    }
  }
  // The best stretch may have ended early, near the log's beginning; it is extended to the full length.
  while (best.last < n && time[best.last] - time[best.first] <= length) ++best.last;
  return best;
}

}  // namespace sparflow
