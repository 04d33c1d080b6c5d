#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/report/trust/trust_page.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using nlohmann::ordered_json;

double median_of(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return kNaN;
  const std::size_t middle = values.size() / 2;
  std::sort(values.begin(), values.end());
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

ordered_json number(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

std::string cell(double value, double scale, const char* form) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(form), scale * value) : "-";
}

ordered_json motion_json(const TrackedMotion& m) {
  ordered_json j;
  j["done"] = m.done();
  if (!m.done()) j["reason"] = m.failure;
  j["predicted_J"] = number(m.predicted);
  j["true_J"] = number(m.measured);
  j["relative_error"] = number(m.error());
  j["tip_error_end_m"] = number(m.tip_error);
  return j;
}

/// Energy error of the first pump, as "-2.1 %"; "not compared" without one.
std::string energy_error(const CompareResult& r) {
  return r.energy.empty() ? "not compared"
                          : fmt::format("{:+.2f} %", 100.0 * r.energy.front().relative_error);
}

}  // namespace

TrustSums sums_of(const std::vector<TrustedMove>& moves) {
  TrustSums s;
  std::vector<double> before, after, before_size, after_size, saving;
  for (auto* v : {&before, &after, &before_size, &after_size, &saving}) v->reserve(moves.size());
  for (const TrustedMove& m : moves) {
    if (!m.before.done() || !m.after.done()) continue;
    ++s.moves;
    before.push_back(m.before.error());
    after.push_back(m.after.error());
    before_size.push_back(std::abs(m.before.error()));
    after_size.push_back(std::abs(m.after.error()));
    if (m.sequential.done()) saving.push_back(m.saving());
  }
  s.error_before = median_of(before_size);
  s.error_after = median_of(after_size);
  s.bias_before = median_of(before);
  s.bias_after = median_of(after);
  s.saving = median_of(saving);
  return s;
}

TrustSums sums_of(const TrustLoop& loop) { return sums_of(loop.moves); }

std::string trust_headline(const TrustLoop& loop) {
  const TrustSums s = sums_of(loop);
  if (s.moves == 0) return "No move was tracked to its end";
  return fmt::format(
      "Predicted energy is within {:.1f} % of the true energy on the plant before improve and "
      "within "
      "{:.1f} % after it (median of {} moves)",
      100.0 * s.error_before, 100.0 * s.error_after, s.moves);
}

std::string trust_story(const TrustLoop& loop) {
  std::string added;
  for (const ExtendStep& step : loop.improved.steps)
    added +=
        (added.empty() ? "" : "; ") + (step.added.empty() ? "without " + step.removed : step.title);
  return fmt::format("{} Energy of the held-out log {} before, {} after improve{}.",
                     added.empty() ? "Nothing that the logs show is missing."
                                   : fmt::format("Missing, and added: {}.", added),
                     energy_error(loop.test_before), energy_error(loop.test_after),
                     loop.improved.steps.empty() ? ""
                                                 : fmt::format("; errors of all quantities {}",
                                                               loop.improved.change().sentence()));
}

std::string trust_table(const TrustLoop& loop) {
  std::string text = fmt::format("{:<10}{:>6}{:>6}   {:>28}   {:>28}   {:>24}\n", "", "", "",
                                 "before improve", "after improve", "true energy of others");
  text += fmt::format("{:<10}{:>6}{:>6}   {:>10}{:>9}{:>9}   {:>10}{:>9}{:>9}   {:>12}{:>12}\n",
                      "move", "kg", "s", "predicted", "true kJ", "error", "predicted", "true kJ",
                      "error", "sequential", "joint PI");
  for (const TrustedMove& m : loop.moves) {
    text += fmt::format("{:<10}{:>6.0f}{:>6.1f}", m.name, m.payload, m.duration);
    for (const TrackedMotion* t : {&m.before, &m.after})
      text += fmt::format("   {:>10}{:>9}{:>9}", cell(t->predicted, 1e-3, "{:.1f}"),
                          cell(t->measured, 1e-3, "{:.1f}"), cell(t->error(), 1e2, "{:+.1f} %"));
    text += fmt::format("   {:>12}{:>12}\n",
                        m.sequential.done() ? cell(m.sequential.measured, 1e-3, "{:.1f}") : "-",
                        m.joint_pi.done() ? cell(m.joint_pi.measured, 1e-3, "{:.1f}") : "-");
    for (const TrackedMotion* t : {&m.before, &m.after, &m.sequential, &m.joint_pi})
      if (!t->done()) text += fmt::format("{:<10}{}\n", "", t->failure);
  }
  const TrustSums s = sums_of(loop);
  if (s.moves > 0)
    text +=
        fmt::format("{}.{}\n", trust_headline(loop),
                    std::isfinite(s.saving)
                        ? fmt::format(" Against one lever after another the optimum saves {:.0f} % "
                                      "of true energy (median).",
                                      100.0 * s.saving)
                        : "");
  return text;
}

std::string trust_json(const TrustLoop& loop) {
  ordered_json j;
  j["headline"] = trust_headline(loop);
  j["machine"] = loop.machine;
  j["seed"] = loop.seed;
  j["effects"] = loop.effects;
  j["train_seconds"] = loop.train_seconds;
  j["test_seconds"] = loop.test_seconds;
  ordered_json steps = ordered_json::array();
  for (const ExtendStep& s : loop.improved.steps)
    steps.push_back(s.added.empty() ? "-" + s.removed : s.added);
  j["steps"] = steps;
  j["stopped_because"] = loop.improved.stopped_because;
  j["test_before"] = ordered_json::parse(compare_json(loop.test_before))["stages"];
  j["test_after"] = ordered_json::parse(compare_json(loop.test_after))["stages"];
  j["moves"] = ordered_json::array();
  for (const TrustedMove& m : loop.moves) {
    ordered_json row;
    row["name"] = m.name;
    row["payload_kg"] = m.payload;
    row["duration_s"] = m.duration;
    row["before"] = motion_json(m.before);
    row["after"] = motion_json(m.after);
    row["sequential_operator"] = motion_json(m.sequential);
    row["joint_pi"] = motion_json(m.joint_pi);
    j["moves"].push_back(row);
  }
  const TrustSums s = sums_of(loop);
  j["median"] = {{"moves", s.moves},
                 {"error_before", number(s.error_before)},
                 {"error_after", number(s.error_after)},
                 {"bias_before", number(s.bias_before)},
                 {"bias_after", number(s.bias_after)},
                 {"saving", number(s.saving)}};
  j["seconds"] = loop.seconds;
  j["interrupted"] = loop.interrupted;
  return j.dump(2) + "\n";
}

}  // namespace sparflow
