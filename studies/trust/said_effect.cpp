#include "studies/trust/said_effect.h"

#include <fmt/format.h>

#include <algorithm>

#include "studies/share.h"

namespace sparflow::bench {

std::vector<SaidEffect> said_effects(const Diagnosis& d,
                                     const std::function<bool(const std::string&)>& is_true) {
  std::vector<SaidEffect> out;
  if (d.verdict != Verdict::kMissing) return out;
  for (const DiagnosedEffect& e : d.effects) {
    if (!d.named(e)) continue;
    SaidEffect said{e.key(), e.probability, e.set_probability, is_true(e.key()), false};
    said.set_right =
        said.right || std::any_of(e.rivals.begin(), e.rivals.end(),
                                  [&](const auto& rival) { return is_true(rival.first); });
    out.push_back(std::move(said));
  }
  return out;
}

nlohmann::json said_json(const std::vector<SaidEffect>& said) {
  nlohmann::json out = nlohmann::json::array();
  for (const SaidEffect& s : said) {
    out.push_back({{"effect", s.key},
                   {"probability", s.probability},
                   {"set_probability", s.set_probability},
                   {"right", s.right},
                   {"set_right", s.set_right}});
  }
  return out;
}

std::string reliability_text(const std::vector<SaidEffect>& said) {
  constexpr double kEdges[] = {0.0, 0.7, 0.9, 0.99, 1.0 + 1e-9};
  std::string out =
      "effects named, by the probability that is said    count  mean said  right (95 %)\n";
  for (const bool set : {false, true}) {
    for (std::size_t i = 0; i + 1 < std::size(kEdges); ++i) {
      int count = 0, right = 0;
      double sum = 0.0;
      for (const SaidEffect& s : said) {
        const double p = set ? s.set_probability : s.probability;
        if (p < kEdges[i] || p >= kEdges[i + 1]) continue;
        ++count;
        sum += p;
        right += (set ? s.set_right : s.right) ? 1 : 0;
      }
      if (count == 0) continue;
      const auto [lower, upper] = share_limits(right, count);
      out += fmt::format(
          "  {:30} {:3.0f} .. {:3.0f} %     {:6}   {:6.1f} %  {:5.1f} % ({:.0f} .. {:.0f})\n",
          set ? "this one or a rival of it" : "this one", 100.0 * kEdges[i],
          100.0 * std::min(1.0, kEdges[i + 1]), count, 100.0 * sum / count, 100.0 * right / count,
          100.0 * lower, 100.0 * upper);
    }
  }
  return out;
}

}  // namespace sparflow::bench
