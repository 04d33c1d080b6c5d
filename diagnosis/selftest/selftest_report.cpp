#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "diagnosis/selftest/selftest.h"
#include "identification/comparison/report_numbers.h"

namespace sparflow {
namespace {

using nlohmann::json;

/// JSON has no NaN and no infinity.
json values_json(const std::vector<ShownValue>& values) {
  json out = json::array();
  for (const ShownValue& v : values)
    out.push_back({{"name", v.name}, {"value", json_number(v.value)}, {"unit", v.unit}});
  return out;
}

std::string row(const InjectedEffect& e) {
  std::string from = "never", line;
  if (std::isfinite(e.times80)) from = fmt::format("{:.2g} x", e.times80);
  std::string confused;
  for (std::size_t k = 0; k < std::min<std::size_t>(2, e.confused_with.size()); ++k)
    confused += (k > 0 ? ", " : "") + e.confused_with[k].key;
  if (e.confused_with.size() > 2) confused += fmt::format(" +{}", e.confused_with.size() - 2);
  line = fmt::format("  {:28s} {:>6.0f} % {:>8s} {:>6.0f} %  {}", e.key(), 100.0 * e.power, from,
                     100.0 * e.absorbed, confused);
  while (line.ends_with(' ')) line.pop_back();
  return line + "\n";
}

}  // namespace

const char* visibility_name(Visibility visibility) {
  switch (visibility) {
    case Visibility::kSeen:
      return "seen";
    case Visibility::kOnlyLarge:
      return "only_large";
    case Visibility::kNever:
      return "never";
  }
  return "";
}

int Selftest::count(Visibility visibility) const {
  return static_cast<int>(std::count_if(effects.begin(), effects.end(),
                                        [&](const auto& e) { return e.visibility == visibility; }));
}

std::string Selftest::headline() const {
  const auto alone = std::count_if(effects.begin(), effects.end(), [](const auto& e) {
    return e.visibility == Visibility::kSeen && e.confused_with.empty();
  });
  const int seen = count(Visibility::kSeen);
  return fmt::format(
      "Of {} candidate effects {} would be named at their typical size, {} of them without a "
      "rival; {} only if larger, {} not at all.{}",
      effects.size(), seen, alone, count(Visibility::kOnlyLarge), count(Visibility::kNever),
      residual_over_noise > 0.0
          ? fmt::format(
                " That is beside what the model leaves unexplained now, up to {:.0f} times the "
                "sensors' noise: run `diagnose` first.",
                residual_over_noise)
          : "");
}

std::string Selftest::table() const {
  std::string out = headline() + "\n\n";
  out += fmt::format("  {:28s} {:>8s} {:>8s} {:>8s}  {}\n", "effect", "power", "from", "absorbed",
                     "indistinguishable from");
  std::map<std::string, std::vector<std::string>> never;  // by reason
  for (const InjectedEffect& e : effects) {
    if (e.visibility != Visibility::kNever) {
      out += row(e);
    } else {
      never[e.reason].push_back(e.key());
    }
  }
  out +=
      "  power: probability to be named at its typical size. from: size with 80 % power, in "
      "typical sizes.\n";
  if (!never.empty()) out += "\n  Not from these logs:\n";
  for (const auto& [reason, keys] : never)
    out += fmt::format("    {}\n      {}\n", reason, fmt::join(keys, ", "));
  if (!sets.empty()) out += "\n  Indistinguishable on these motions:\n";
  for (std::size_t k = 0; k < std::min(kSetsWithMotion, sets.size()); ++k) {
    out += fmt::format("    {}\n", fmt::join(sets[k], "  or  "));
    if (k < experiments.size()) out += fmt::format("      {}\n", experiments[k].sentence());
  }
  if (sets.size() > kSetsWithMotion)
    out += fmt::format("    and {} more sets\n", sets.size() - kSetsWithMotion);
  if (!checks.empty()) {
    const auto right = std::count_if(checks.begin(), checks.end(),
                                     [](const InjectionCheck& c) { return c.as_predicted(); });
    out += fmt::format("\n  checked by injection: {} of {} as predicted\n", right, checks.size());
    for (const InjectionCheck& c : checks) {
      if (c.as_predicted()) continue;
      out += fmt::format("    {}: power {:.0f} %, but {} was named\n", c.key, 100.0 * c.power,
                         c.answer.empty() ? "nothing" : c.answer);
    }
  }
  for (const std::string& note : notes) out += fmt::format("  note: {}\n", note);
  return out;
}

std::string Selftest::json() const {
  nlohmann::json j = {{"headline", headline()},
                      {"samples", samples},
                      {"duration_s", duration},
                      {"logs", logs},
                      {"references", references},
                      {"gate", {{"false_alarm", false_alarm}, {"threshold", threshold}}},
                      {"seen", count(Visibility::kSeen)},
                      {"residual_over_noise", residual_over_noise},
                      {"only_large", count(Visibility::kOnlyLarge)},
                      {"never", count(Visibility::kNever)}};
  j["effects"] = nlohmann::json::array();
  for (const InjectedEffect& e : effects) {
    nlohmann::json one = {
        {"id", e.id},
        {"at", e.at},
        {"stage", e.stage},
        {"visibility", visibility_name(e.visibility)},
        {"reason", e.reason},
        {"typical", values_json(e.typical)},
        {"power", e.power},
        {"log_likelihood_gain", json_number(e.gain)},
        {"times_typical",
         {{"power80", json_number(e.times80)}, {"power95", json_number(e.times95)}}},
        {"smallest", values_json(e.smallest)},
        {"size_by_noise", json_number(e.size)},
        {"absorbed", json_number(e.absorbed)},
        {"absorbed_without_reference", json_number(e.absorbed_alone)},
        {"separated_by", e.separated_by}};
    one["confused_with"] = nlohmann::json::array();
    for (const Confusion& c : e.confused_with)
      one["confused_with"].push_back(
          {{"effect", c.key}, {"nats", json_number(c.nats)}, {"imitated", json_number(c.share)}});
    j["effects"].push_back(std::move(one));
  }
  j["indistinguishable"] = sets;
  j["experiments"] = nlohmann::json::array();
  for (const Experiment& e : experiments) {
    j["experiments"].push_back({{"reason", e.reason},
                                {"motion", e.motion},
                                {"nats_per_minute", json_number(e.nats_per_minute)},
                                {"nats_per_minute_here", json_number(e.nats_here)}});
  }
  j["checks"] = nlohmann::json::array();
  for (const InjectionCheck& c : checks) {
    j["checks"].push_back({{"effect", c.key},
                           {"stage", c.stage},
                           {"power", c.power},
                           {"predicted_named", c.predicted},
                           {"named", c.named},
                           {"answer", c.answer},
                           {"as_predicted", c.as_predicted()}});
  }
  j["notes"] = notes;
  j["seconds"] = seconds;
  return j.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace sparflow
