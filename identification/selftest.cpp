#include "identification/selftest.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <set>
#include <thread>

#include "identification/effect_intervals.h"
#include "identification/effect_power.h"
#include "identification/effect_proof.h"
#include "identification/null_gate.h"
#include "identification/selftest_size.h"
#include "models/error.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Residual so far above the sensors' own noise is no noise: something is missing already.
constexpr double kSuspiciousNoise = 3.0;

template <class F>
void parallel(std::size_t count, const F& work) {
  std::atomic<std::size_t> next = 0;
  std::vector<std::jthread> pool;
  for (unsigned t = 0; t < std::clamp(std::thread::hardware_concurrency(), 1U, 8U); ++t) {
    pool.emplace_back([&] {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    });
  }
}

std::vector<ShownValue> shown(const EffectInfo& info, const std::vector<double>& values) {
  std::vector<ShownValue> out;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const EffectParameter& p = info.parameters[k];
    out.push_back({p.name, p.unit, values[k] / p.si});
  }
  return out;
}

/// Learned laws stand between the effect and the logs: what they imitate is not named.
bool behind_learned_law(EffectStage stage) {
  return stage == EffectStage::kPressure || stage == EffectStage::kPump;
}

EffectFit noise_only(const EffectFit& fit, const VectorXd& theta) {
  EffectFit out;
  out.noise = fit.noise;
  out.theta = theta;
  return out;
}

/// Whether so few motions show it that leaving some out would not prove it: the rule of the held-out gain on the
/// expected gains of the folds, noise aside.
bool in_too_few_motions(const Evidence& evidence, const Signature& s, int folds) {
  VectorXd gains = VectorXd::Zero(folds);
  for (std::size_t c = 0; c < s.white.size(); ++c) {
    if (s.white[c].size() == 0) continue;
    const std::vector<NoiseBlock>& blocks = evidence.channels[c].blocks;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      gains[static_cast<Index>(b) % folds] +=
          s.white[c].segment(blocks[b].first, blocks[b].last - blocks[b].first).squaredNorm();
    }
  }
  const double n = folds,
               error = std::sqrt((gains.array() - gains.mean()).square().sum() * n / (n - 1.0));
  const auto positive = (gains.array() > 1e-6 * gains.sum()).count();
  return gains.sum() <= error && static_cast<double>(positive) < 0.79 * n;
}

class Study {
 public:
  Study(const CraneModel& model, const Evidence& evidence, const Evidence* alone,
        const EffectFit& fit, std::vector<SearchCandidate> candidates, double threshold,
        const SearchOptions& options)
      : machine_(model.machine),
        evidence_(evidence),
        alone_(alone),
        fit_(fit),
        options_(options),
        threshold_(threshold),
        power_(evidence, fit, options.seed),
        candidates_(std::move(candidates)),
        sizes_(candidates_.size()),
        projected_(candidates_.size()),
        result_(candidates_.size()) {
    parallel(candidates_.size(), [&](std::size_t i) {
      sizes_[i] = size_effect(candidates_[i]);
      for (const EffectDesign& d : candidates_[i].designs)
        projected_[i].push_back(power_.project(d));
    });
  }

  std::vector<InjectedEffect> run() {
    parallel(candidates_.size(), [&](std::size_t i) { see(i); });
    parallel(candidates_.size(), [&](std::size_t i) { confuse(i); });
    return result_;
  }
  const EffectSize& size(std::size_t i) const { return sizes_[i]; }
  const SearchCandidate& candidate(std::size_t i) const { return candidates_[i]; }

 private:
  Signature typical_signature(std::size_t i) const {
    return signature(projected_[i][sizes_[i].typical], sizes_[i].theta);
  }

  /// Chance that a gain of that mean passes the gate.
  double chance(std::size_t i, double gain) const {
    const SearchCandidate& c = candidates_[i];
    return chance_above(2.0 * (threshold_ + c.penalty), c.linear, 2.0 * gain);
  }

  /// Least number of times the typical size with that mean gain, and parameter values there.
  std::pair<double, std::vector<double>> times_for(std::size_t i, const Signature& typical,
                                                   double gain) const {
    const EffectSize& s = sizes_[i];
    const SearchCandidate& c = candidates_[i];
    if (s.rungs.empty()) {
      double lo = std::log(1e-4), hi = std::log(s.largest);
      if (power_.gain(typical, s.largest) < gain) return {kInfinity, {}};
      for (int k = 0; k < 22; ++k) {  // to 3e-6 of the range of logarithms
        const double middle = 0.5 * (lo + hi);
        (power_.gain(typical, std::exp(middle)) < gain ? lo : hi) = middle;
      }
      const double times = std::exp(hi);
      return {times,
              parameter_values(*c.effect.effect, times * s.theta, c.designs[s.typical].shape)};
    }
    // by rungs of its grid, from the weakest to the strongest, interpolated between two
    double before_gain = 0.0, before_value = 0.0, before_times = 0.0;
    for (std::size_t k = 0; k < s.rungs.size(); ++k) {
      const Rung& rung = s.rungs[k];
      const double g = power_.gain(signature(projected_[i][rung.design], s.theta));
      if (g < gain) {
        before_gain = g, before_value = rung.value, before_times = rung.times;
        continue;
      }
      std::vector<double> shape = c.designs[rung.design].shape;
      double times = rung.times;
      if (k > 0 && g > before_gain) {
        const double t =
            (std::sqrt(gain) - std::sqrt(before_gain)) / (std::sqrt(g) - std::sqrt(before_gain));
        shape[0] = before_value + t * (rung.value - before_value);
        times = before_times + t * (rung.times - before_times);
      }
      return {times, parameter_values(*c.effect.effect, s.theta, shape)};
    }
    return {kInfinity, {}};
  }

  double absorbed_alone(const SearchCandidate& c, const EffectSize& s) const {
    const EffectDesign d = make_design(*alone_, c.effect, c.designs[s.typical].shape);
    EffectFit fit;
    fit.theta = s.theta;
    for (const EvidenceChannel& channel : alone_->channels) {
      fit.noise.emplace_back();
      for (std::size_t k = 0; k < evidence_.channels.size(); ++k) {
        if (evidence_.channels[k].kind == channel.kind &&
            evidence_.channels[k].index == channel.index)
          fit.noise.back() = fit_.noise[k];
      }
    }
    return d.acts() ? effect_action(*alone_, {&d}, 0, fit).absorbed : 1.0;
  }

  void see(std::size_t i) {
    const SearchCandidate& c = candidates_[i];
    const EffectSize& s = sizes_[i];
    const EffectDesign& design = c.designs[s.typical];
    const EffectInfo& info = c.effect.effect->info();
    InjectedEffect& out = result_[i];
    out.effect = c.effect;
    out.id = info.id;
    const std::string key = effect_key(info, machine_, c.effect.at);
    out.at = key.size() > info.id.size() ? key.substr(info.id.size() + 1) : "";
    out.stage = effect_stage_name(info.stage);
    out.separated_by = info.separated_by;
    out.typical = shown(info, parameter_values(*c.effect.effect, s.theta, design.shape));
    const EffectAction action = effect_action(evidence_, {&design}, 0, noise_only(fit_, s.theta));
    out.size = action.size;
    out.absorbed = out.absorbed_alone = action.absorbed;
    if (alone_ != nullptr) out.absorbed_alone = absorbed_alone(c, s);
    const Signature typical = typical_signature(i);
    out.gain = power_.gain(typical);
    if (behind_learned_law(info.stage) && out.absorbed > options_.largest_absorbed) {
      out.reason = fmt::format("learned laws imitate {:.0f} % of it; {}", 100.0 * out.absorbed,
                               evidence_.has_reference() ? "the references pin too little"
                                                         : "give a log without it as --reference");
      return;
    }
    if (in_too_few_motions(evidence_, typical, options_.folds)) {
      out.reason = "too few motions show it: repeat what provokes it";
      return;
    }
    const double price = threshold_ + c.penalty;
    const auto [t80, v80] = times_for(i, typical, 0.5 * noncentrality_for(price, 0.8, c.linear));
    const auto [t95, v95] = times_for(i, typical, 0.5 * noncentrality_for(price, 0.95, c.linear));
    out.times80 = t80;
    out.times95 = t95;
    std::vector<double> values = v80;
    // the estimate of its size must also pass what is worth a name; its relative error is that of a known noise
    const double squares = typical.squares();
    const double deviation = squares > 0.0 ? 1.0 / std::sqrt(squares) : kInfinity;
    const auto large_enough = [&](double quantile) {
      return options_.smallest_effect / std::max(out.size, 1e-12) + quantile * deviation;
    };
    if (s.rungs.empty()) {
      if (large_enough(0.84) > out.times80) {
        out.times80 = large_enough(0.84);
        values = parameter_values(*c.effect.effect, out.times80 * s.theta, design.shape);
      }
      out.times95 = std::max(out.times95, large_enough(1.64));
      if (out.times80 > s.largest) out.times80 = kInfinity;
      if (out.times95 > s.largest) out.times95 = kInfinity;
    }
    out.power = chance(i, out.gain);
    if (std::isfinite(deviation)) {
      const double beyond =
          (1.0 - options_.smallest_effect / std::max(out.size, 1e-12)) / deviation;
      out.power *= 0.5 * std::erfc(-beyond / std::sqrt(2.0));
    }
    out.visibility = out.power >= 0.8             ? Visibility::kSeen
                     : std::isfinite(out.times80) ? Visibility::kOnlyLarge
                                                  : Visibility::kNever;
    if (std::isfinite(out.times80)) out.smallest = shown(info, values);
    if (out.visibility == Visibility::kOnlyLarge)
      out.reason = fmt::format("{:.2f} times the noise where it acts", out.size);
    if (out.visibility == Visibility::kNever)
      out.reason = "below the noise at any plausible size: stronger or more motions are needed";
  }

  /// Rivals, at the typical size or at the smallest that would be seen, whichever is larger.
  void confuse(std::size_t i) {
    InjectedEffect& out = result_[i];
    if (out.visibility == Visibility::kNever) return;
    Signature s = typical_signature(i);
    if (sizes_[i].rungs.empty() && out.times80 > 1.0)
      s = signature(projected_[i][sizes_[i].typical], out.times80 * sizes_[i].theta);
    const double squares = s.squares();
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      if (k == i) continue;
      const EffectInfo& rival = candidates_[k].effect.effect->info();
      // a rival that would be refused is none
      if (behind_learned_law(rival.stage) && result_[k].absorbed > options_.largest_absorbed)
        continue;
      Confusion worst{effect_key(rival, machine_, candidates_[k].effect.at), kInfinity, 0.0};
      Signature left;
      for (const ProjectedDesign& p : projected_[k]) {
        bool meets = false;
        for (std::size_t c = 0; c < p.white.size(); ++c)
          meets = meets || (p.white[c].cols() > 0 && s.white[c].size() > 0);
        if (!meets) break;
        Signature here = left_by(s, p);
        const double share = 1.0 - here.squares() / squares;
        if (share <= worst.share) continue;
        worst.share = share;
        left = std::move(here);
      }
      if (worst.share < 0.2)
        continue;  // four nats of a gain that passes any gate are more than that
      worst.nats = std::min(power_.gain(left), 0.5 * left.squares());
      if (worst.nats < options_.same_nats) out.confused_with.push_back(std::move(worst));
    }
    std::sort(out.confused_with.begin(), out.confused_with.end(),
              [](const Confusion& a, const Confusion& b) { return a.nats < b.nats; });
  }

  const Machine& machine_;
  const Evidence& evidence_;
  const Evidence* alone_;
  const EffectFit& fit_;
  const SearchOptions& options_;
  double threshold_;
  PowerStudy power_;
  std::vector<SearchCandidate> candidates_;
  std::vector<EffectSize> sizes_;
  std::vector<std::vector<ProjectedDesign>> projected_;
  std::vector<InjectedEffect> result_;
};

/// An effect without action in these logs: signals missing, or a motion that never provokes it.
InjectedEffect without_action(const Evidence& evidence, const Machine& machine,
                              const EffectAt& effect) {
  const EffectInfo& info = effect.effect->info();
  InjectedEffect out;
  out.effect = effect;
  out.id = info.id;
  const std::string key = effect_key(info, machine, effect.at);
  out.at = key.size() > info.id.size() ? key.substr(info.id.size() + 1) : "";
  out.stage = effect_stage_name(info.stage);
  out.separated_by = info.separated_by;
  const std::vector<EvidenceKind> kinds = effect.effect->shows_in();
  const bool placed = info.place == EffectPlace::kCylinder;
  const bool measured = std::any_of(
      evidence.channels.begin(), evidence.channels.end(), [&](const EvidenceChannel& c) {
        return std::find(kinds.begin(), kinds.end(), c.kind) != kinds.end() &&
               (!placed || c.kind == EvidenceKind::kPump || c.index == effect.at);
      });
  const bool oil = std::any_of(info.signals.begin(), info.signals.end(), [](const std::string& w) {
    return w.find("oil temperature") != std::string::npos;
  });
  const bool no_oil = std::all_of(evidence.series.begin(), evidence.series.end(),
                                  [](const MachineSeries& s) { return s.oil.size() == 0; });
  out.reason = oil && no_oil ? "not measured: it needs the oil temperature"
               : measured    ? "no motion of these logs provokes it"
                          : fmt::format("not measured: it needs {}", fmt::join(info.signals, ", "));
  return out;
}

/// Effects to inject: stage by stage in turn, clearly predicted ones only, seen before unseen, drawn at random.
std::vector<std::size_t> draw_checks(const std::vector<InjectedEffect>& effects, int count,
                                     unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<std::vector<std::size_t>> piles;
  for (const bool seen : {true, false}) {
    for (const char* stage : {"force", "flow", "pressure", "pump", "sensor"}) {
      piles.emplace_back();
      for (std::size_t i = 0; i < effects.size(); ++i) {
        const InjectedEffect& e = effects[i];
        const bool clear =
            seen ? e.power > 0.97 && e.times95 < 0.8 : e.power < 0.03 && !e.typical.empty();
        if (e.stage == stage && clear) piles.back().push_back(i);
      }
      std::shuffle(piles.back().begin(), piles.back().end(), random);
    }
  }
  std::vector<std::size_t> out;
  const auto take = [&](std::size_t pile) {
    if (static_cast<int>(out.size()) >= count || piles[pile].empty()) return false;
    out.push_back(piles[pile].back());
    piles[pile].pop_back();
    return true;
  };
  for (bool any = true; any;) {
    any = false;
    for (std::size_t p = 0; p < 5; ++p) any = take(p) || any;
    for (std::size_t p = 5; p < 10 && count > 3; ++p) {  // one that should stay unseen a round
      if (!take(p)) continue;
      any = true;
      break;
    }
  }
  return out;
}

std::vector<std::vector<std::string>> sets_of(const std::vector<InjectedEffect>& effects) {
  std::set<std::vector<std::string>> sets;
  for (const InjectedEffect& e : effects) {
    if (e.confused_with.empty()) continue;
    std::vector<std::string> keys = {e.key()};
    for (const Confusion& c : e.confused_with) keys.push_back(c.key);
    std::sort(keys.begin(), keys.end());
    sets.insert(std::move(keys));
  }
  std::vector<std::vector<std::string>> out;
  for (const auto& s : sets) {  // a set inside another says nothing new
    const bool inside = std::any_of(sets.begin(), sets.end(), [&](const auto& other) {
      return other.size() > s.size() &&
             std::includes(other.begin(), other.end(), s.begin(), s.end());
    });
    if (!inside) out.push_back(s);
  }
  return out;
}

}  // namespace

Selftest selftest(const CraneModel& model, const std::vector<Log>& logs,
                  const std::vector<Log>& references, const SelftestOptions& options,
                  const SearchProgress& progress) {
  if (logs.empty()) throw InputError({}, "logs", "no log to test: give at least one with --log");
  const auto start = std::chrono::steady_clock::now();
  const auto report = [&](double share, const std::string& what) {
    if (progress) progress(share, what);
  };
  Selftest out;
  report(0.02, "arranging the evidence");
  std::vector<MachineSignals> suspects, pinned;
  for (const Log& log : logs) {
    suspects.push_back(make_signals(model.machine, log, options.signals));
    out.samples += static_cast<double>(log.samples());
    out.duration += log.time.size() > 0 ? log.time[log.time.size() - 1] - log.time[0] : 0.0;
  }
  for (const Log& log : references)
    pinned.push_back(make_signals(model.machine, log, options.signals));
  out.logs = logs.size();
  out.references = references.size();
  out.false_alarm = options.search.false_alarm;
  const Evidence evidence = collect_evidence(model, suspects, pinned);
  const Evidence alone = references.empty() ? Evidence{} : collect_evidence(model, suspects);
  out.notes = evidence.notes;

  std::vector<EffectAt> wanted = options.candidates;
  if (wanted.empty()) {
    for (const EffectAt& c : candidates(model.machine)) {
      const bool known =
          std::any_of(model.effects.begin(), model.effects.end(),
                      [&](const AppliedEffect& e) { return e.effect == c.effect && e.at == c.at; });
      if (!known) wanted.push_back(c);
    }
  }
  FitControl control;
  const EffectFit fit = fit_effects(evidence, {}, nullptr, control);
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    const EvidenceChannel& channel = evidence.channels[c];
    const double ratio = fit.noise[c].deviation() / channel.noise_floor;
    if (!(ratio > kSuspiciousNoise)) continue;
    out.notes.push_back(fmt::format(
        "{}: what the model leaves is {:.0f} times the sensors' noise and counts as noise here; "
        "`diagnose` may find its cause, then more can be seen",
        channel.text, ratio));
  }
  report(0.1, "making the effects' signatures");
  std::vector<SearchCandidate> all = search_candidates(evidence, wanted);
  for (const EffectAt& w : wanted) {
    const bool acts = std::any_of(all.begin(), all.end(), [&](const SearchCandidate& c) {
      return c.effect.effect == w.effect && c.effect.at == w.at;
    });
    if (!acts) out.effects.push_back(without_action(evidence, model.machine, w));
  }
  report(0.3, "the gate on these motions");
  std::vector<GateCandidate> gated;
  gated.reserve(all.size());
  for (const SearchCandidate& c : all) gated.push_back({&c.designs, c.penalty});
  std::mt19937_64 random(options.search.seed);
  const NullGate gate =
      make_null_gate(evidence, gated, {}, fit, options.search.simulations, random);
  out.threshold = gate.threshold(options.search.false_alarm);
  report(0.5, "power and confusion");
  Study study(model, evidence, references.empty() ? nullptr : &alone, fit, std::move(all),
              out.threshold, options.search);
  const std::vector<InjectedEffect> seen = study.run();

  const std::vector<std::size_t> drawn = draw_checks(seen, options.check, options.search.seed);
  for (std::size_t k = 0; k < drawn.size(); ++k) {
    const std::size_t i = drawn[k];
    report(0.6 + 0.4 * static_cast<double>(k) / static_cast<double>(drawn.size()),
           "injecting " + seen[i].key());
    const SearchCandidate& c = study.candidate(i);
    InjectionCheck check =
        inject_and_search(evidence, fit, c.designs[study.size(i).typical], study.size(i).theta,
                          wanted, options.search, options.search.seed + static_cast<unsigned>(k));
    check.power = seen[i].power;
    check.predicted = seen[i].visibility == Visibility::kSeen;
    out.checks.push_back(std::move(check));
  }
  out.sets = sets_of(seen);
  out.effects.insert(out.effects.end(), seen.begin(), seen.end());
  const auto place = [&](const InjectedEffect& e) {
    return std::find_if(wanted.begin(), wanted.end(),
                        [&](const EffectAt& w) {
                          return w.effect == e.effect.effect && w.at == e.effect.at;
                        }) -
           wanted.begin();
  };
  std::sort(out.effects.begin(), out.effects.end(),
            [&](const auto& a, const auto& b) { return place(a) < place(b); });
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report(1.0, "done");
  return out;
}

}  // namespace sparflow
