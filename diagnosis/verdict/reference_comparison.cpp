#include "diagnosis/verdict/reference_comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/selection/search_state.h"
#include "diagnosis/verdict/common_law.h"
#include "diagnosis/verdict/designs_by_group.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "diagnosis/verdict/law_comparison.h"
#include "diagnosis/verdict/reference_faults.h"
#include "diagnosis/verdict/residual_levels.h"
#include "diagnosis/verdict/size_comparison.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

AppliedEffect applied_of(const FoundEffect& f) {
  return {f.design.effect.effect, f.design.effect.at, f.values, f.lower95, f.upper95, f.covariance};
}

/// Its channels in another evidence; what that does not have is left out.
void move_channels(DiagnosedEffect& e, const Evidence& from, const Evidence& to) {
  std::erase_if(e.channels, [&](ChannelGain& g) {
    const EvidenceChannel& old = from.channels[g.channel];
    const EvidenceChannel* now = to.find(old.kind, old.index);
    if (now == nullptr) return true;
    g.channel = static_cast<std::size_t>(now - to.channels.data());
    return false;
  });
}

/// Share of the squared residual of a channel in the suspect logs beyond that in the references that goes when a residual
/// becomes that of the final fit.
double explained_excess(const Diagnosis& d, const Diagnosis& without, std::size_t channel) {
  const auto square = [&](const Diagnosis& of) {
    return std::pow(suspect_rms(of.evidence, channel, of.search.final.residual[channel]), 2);
  };
  const double excess = square(without) - std::pow(expected_rms(d, channel), 2);
  return excess > 0.0 ? (square(without) - square(d)) / excess : 1.0;
}

/// Whether the residual of one of its channels in the suspect logs exceeds that in the references once the action of a found
/// effect is left in it, and mostly for that reason, by the learned laws of the final fit: estimated anew, they would share the
/// difference out among all logs.
bool needed(const Diagnosis& d, std::size_t found, Proof proof) {
  Index first = 0;
  for (std::size_t i = 0; i < found; ++i) first += d.search.found[i].design.linear;
  const EffectDesign& design = d.search.found[found].design;
  Diagnosis without = d;
  double least = 1.0, tests = 0.0;
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    if (!design.touches(c)) continue;
    without.search.final.residual[c] +=
        design.columns[c] * d.search.final.theta.segment(first, design.linear);
    const std::optional<Excess> excess = excess_over_references(without, c);
    if (!excess) return true;
    tests += kWaysToExceed;
    const double explained = explained_excess(d, without, c);
    if (tracing())
      fmt::print(stderr,
                 "    in {} by chance: level {:.2g}, largest block {:.2g}; explained {:.2g}\n",
                 d.evidence.channels[c].text, excess->level, excess->largest, explained);
    if (explained < d.thresholds.least_excess_explained) continue;
    least = std::min({least, excess->level, excess->largest});
  }
  // an effect whose size differs has been selected already, so that its own channels alone count
  return proof == Proof::kExcess
             ? tests * least < d.thresholds.excess_false_alarm
             : kWaysToExceed * static_cast<double>(d.evidence.channels.size()) * least <
                   d.thresholds.structure_false_alarm;
}

/// Whether an effect found as a difference acts in a channel, or something there stays unexplained.
/// @param text of the channel
bool differs_in(const Diagnosis& d, const std::string& text) {
  const auto is = [&](std::size_t channel) {
    return channel < d.evidence.channels.size() && d.evidence.channels[channel].text == text;
  };
  if (d.unexplained && is(d.unexplained->channel)) return true;
  return std::any_of(d.effects.begin(), d.effects.end(), [&](const DiagnosedEffect& e) {
    return std::any_of(e.channels.begin(), e.channels.end(),
                       [&](const ChannelGain& g) { return is(g.channel); });
  });
}

}  // namespace

void trace_channels(const Diagnosis& d, std::size_t found) {
  Index first = 0;
  for (std::size_t i = 0; i < found; ++i) first += d.search.found[i].design.linear;
  const EffectDesign& design = d.search.found[found].design;
  const std::string key =
      effect_key(design.effect.effect->info(), *d.evidence.series[0].machine, design.effect.at);
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    if (!design.touches(c)) continue;
    const VectorXd& with = d.search.final.residual[c];
    const VectorXd without =
        with + design.columns[c] * d.search.final.theta.segment(first, design.linear);
    const FieldUnit& unit = d.evidence.channels[c].unit;
    fmt::print(stderr, "  {} in {}: residual {:.3g} -> {:.3g} {}, in the references {:.3g}\n", key,
               d.evidence.channels[c].text, suspect_rms(d.evidence, c, without) / unit.si,
               suspect_rms(d.evidence, c, with) / unit.si, unit.name,
               reference_rms(d, c) / unit.si);
  }
}

namespace {

bool joins_both(InReferences there) {
  return there == InReferences::kAlike || there == InReferences::kVaries;
}

/// Whether a difference, which has passed the test of its size already, improves the prediction of motions left out. A law that is not exact
/// has another size in other motions, by a few of them.
bool predicts_left_out(const Diagnosis& d, const FoundEffect& f) {
  if (tracing())
    fmt::print(stderr, "    gain on motions left out {:.4g} +- {:.2g} nats, by chance {:.2g}\n",
               f.held_out, f.held_out_error, f.held_out_chance);
  return f.held_out_chance < d.thresholds.excess_false_alarm;
}

/// Judges a significant difference by the motions left out and by the residuals of both groups of logs.
InReferences by_residual(const Diagnosis& d, std::size_t found, const SizeVerdict& compared) {
  if (joins_both(compared.in_references)) return compared.in_references;
  // Only what the references show as well is named as lacking in both.
  const InReferences no_change =
      is_shared(d.evidence, d.search.found[found]) || compared.in_references == InReferences::kNot
          ? InReferences::kVaries
          : InReferences::kAlike;
  // what the residuals of all channels must prove is not proven by its size
  if (compared.proof != Proof::kClearExcess && !predicts_left_out(d, d.search.found[found]))
    return no_change;
  if (compared.proof == Proof::kNone) return compared.in_references;
  // Laws that are not exact have another size in other motions, and standard errors do not know how other. A difference that is
  // significant and no more is a change only where the suspect logs exceed the references without it.
  const bool change = needed(d, found, compared.proof);
  if (tracing())
    fmt::print(stderr, "  {} {} a change: without it the residual {} that of the references\n",
               effect_key(d.search.found[found].design.effect.effect->info(),
                          *d.evidence.series[0].machine, d.search.found[found].design.effect.at),
               change ? "is" : "is not", change ? "exceeds" : "does not exceed");
  return change ? compared.in_references : no_change;
}

/// The one law that explains both groups of logs, if there is one: its sizes do not differ.
std::optional<FoundEffect> explains_both(const Diagnosis& d, std::size_t found,
                                         const SearchOptions& options) {
  std::optional<FoundEffect> law = common_law(d, found, options);
  if (!law) return {};
  Diagnosis with = d;
  with.search.found[found] = *law;
  if (joins_both(by_size(with, found, options).in_references) ||
      as_good_as_own_laws(d, found, *law))
    return law;
  return {};
}

/// Compares sizes, and asks of a difference whether one law explains both groups of logs.
ComparedWithReferences compare(const Diagnosis& d, std::size_t found, const SearchOptions& options,
                               SizeVerdict& size) {
  if (tracing()) trace_channels(d, found);
  size = by_size(d, found, options);
  ComparedWithReferences compared{size.in_references, {}};
  if (joins_both(size.in_references)) return compared;
  compared.law = explains_both(d, found, options);
  if (compared.law) size.in_references = compared.there = InReferences::kAlike;
  return compared;
}

}  // namespace

InReferences in_references(const Diagnosis& d, std::size_t found, const SearchOptions& options) {
  SizeVerdict size;
  compare(d, found, options, size);
  return by_residual(d, found, size);
}

std::vector<ComparedWithReferences> all_in_references(const Diagnosis& d,
                                                      const SearchOptions& options, bool last) {
  std::vector<ComparedWithReferences> there;
  std::vector<SizeVerdict> by(d.search.found.size());
  for (std::size_t i = 0; i < by.size(); ++i) there.push_back(compare(d, i, options, by[i]));
  const bool joined = std::any_of(by.begin(), by.end(),
                                  [](const SizeVerdict& v) { return joins_both(v.in_references); });
  if (joined && !last) return there;
  for (std::size_t i = 0; i < by.size(); ++i) there[i].there = by_residual(d, i, by[i]);
  return there;
}

bool found_in_references(const CraneModel& model, const DiagnosisSignals& signals,
                         DiagnoseOptions alone, const Diagnosis& d, std::size_t found) {
  const FoundEffect& f = d.search.found[found];
  const std::vector<AppliedEffect>& shared = d.evidence.options.shared;
  const bool known = std::any_of(shared.begin(), shared.end(), [&](const AppliedEffect& e) {
    return same_place(e, f.design.effect);
  });
  if (known || f.design.shape.empty()) return false;
  alone.candidates = {f.design.effect};
  alone.evidence.shared.clear();
  const Diagnosis there = diagnose_sound(model, {signals.references}, alone, {});
  const bool alike = std::any_of(
      there.search.found.begin(), there.search.found.end(), [&](const FoundEffect& own) {
        return own.design.effect == f.design.effect && agree(applied_of(own), d, f);
      });
  if (tracing()) {
    fmt::print(stderr, "  {} estimated from the references alone:",
               effect_key(f.design.effect.effect->info(), model.machine, f.design.effect.at));
    for (const FoundEffect& own : there.search.found)
      fmt::print(stderr, " {:.4g}, 95 % from {:.4g} to {:.4g}", fmt::join(own.values, " "),
                 fmt::join(own.lower95, " "), fmt::join(own.upper95, " "));
    fmt::print(stderr, " {}\n", alike ? "(alike)" : "(not alike)");
  }
  return alike;
}

namespace {

/// Searches for differences, in which what both groups of logs turn out to have joins what acts in both.
class DifferenceSearch {
 public:
  DifferenceSearch(const CraneModel& model, const DiagnosisSignals& signals,
                   const DiagnoseOptions& options, const SearchProgress& progress)
      : signals_(signals), now_(options), with_(model) {
    now_.evidence.settles = true;
    // What a model lacks is more than what changes. Physics left out here would be noise beside every difference.
    alone_ = now_;
    alone_.search.max_effects =
        std::max(now_.search.max_effects,
                 now_.verdict.effects_lacking_by_cylinder * model.machine.cylinder_count());
    const Diagnosis before =
        diagnose_sound(model, {signals.references}, alone_, part(progress, 0.0, 0.4));
    now_.evidence.shared = effects_in_references(model, signals.references);
    for (const FoundEffect& f : before.search.found) add(applied_of(f));
    for (const DiagnosedEffect& e : before.effects) lacking_.emplace_back(e, before.evidence);
    if (now_.candidates.empty()) now_.candidates = candidates(model.machine);
  }

  /// Searches until nothing joins any more. @param progress for shares of the whole from 0.4 to 1
  Diagnosis search(const SearchProgress& progress) {
    Diagnosis d;
    for (int turn = 0; turn < now_.verdict.shared_turns; ++turn) {
      d = diagnose_sound(with_, signals_, now_, part(progress, 0.4, 1.0));
      if (!join(d, turn + 1 == now_.verdict.shared_turns)) break;
    }
    for (DiagnosedEffect& e : d.effects)
      e.change = std::any_of(with_.effects.begin(), with_.effects.end(),
                             [&](const auto& known) { return same_place(known, e.effect); });
    for (auto [effect, evidence] : lacking_) {
      move_channels(effect, evidence, d.evidence);
      d.lacking.push_back(std::move(effect));
    }
    return d;
  }

  /// Gives the stretches of motion variances of their own. @return whether they may have them
  bool weigh_stretches() {
    if (!now_.evidence.mechanisms.act(Mechanism::kBlocks)) return false;
    now_.evidence.noise.block_freedom = now_.verdict.block_freedom;
    return true;
  }

  const DiagnoseOptions& options() const { return now_; }

 private:
  static SearchProgress part(const SearchProgress& progress, double from, double to) {
    if (!progress) return {};
    return [=, &progress](double share, const std::string& what) {
      progress(from + share * (to - from), what);
    };
  }

  void add(const AppliedEffect& e) {
    with_.effects.push_back(e);
    now_.evidence.shared.push_back(e);
  }

  /// Adds what both groups have to what acts in both. @param last whether no further search follows  @return whether there was any
  bool join(const Diagnosis& d, bool last) {
    bool again = false;
    std::vector<ComparedWithReferences> all = all_in_references(d, now_.search, last);
    const auto joins = [](const ComparedWithReferences& c) { return joins_both(c.there); };
    if (!last && std::none_of(all.begin(), all.end(), joins))
      for (std::size_t i = 0; i < all.size(); ++i)
        if (found_in_references(with_, signals_, alone_, d, i)) all[i].there = InReferences::kAlike;
    for (std::size_t i = 0; i < d.search.found.size(); ++i) {
      const FoundEffect& f = d.search.found[i];
      if (!joins(all[i])) continue;
      again = true;
      if (is_shared(d.evidence, f) && !all[i].law) {
        std::erase(now_.candidates, f.design.effect);
        continue;
      }
      // Another value of what the references have joins it once and is no candidate afterwards. Neither is what the references do not
      // show and the suspect logs do not prove: beside its own law of all logs it would be found once more, by the same residual.
      const bool had_before =
          std::any_of(now_.evidence.shared.begin(), now_.evidence.shared.end(),
                      [&](const AppliedEffect& e) { return same_place(e, f.design.effect); });
      add(applied_of(all[i].law ? *all[i].law : f));
      if (had_before || all[i].there == InReferences::kVaries)
        std::erase(now_.candidates, f.design.effect);
      if (all[i].there == InReferences::kAlike) list_as_lacking(d, f.design.effect);
    }
    return again;
  }

  void list_as_lacking(const Diagnosis& d, const EffectAt& effect) {
    const auto described =
        std::find_if(d.effects.begin(), d.effects.end(),
                     [&](const DiagnosedEffect& e) { return e.effect == effect; });
    const bool listed = std::any_of(lacking_.begin(), lacking_.end(), [&](const auto& known) {
      return known.first.effect == effect;
    });
    if (described != d.effects.end() && !listed) lacking_.emplace_back(*described, d.evidence);
  }

  const DiagnosisSignals& signals_;
  DiagnoseOptions now_, alone_;
  CraneModel with_;  // and what both groups have
  std::vector<std::pair<DiagnosedEffect, Evidence>> lacking_;
};

}  // namespace

Diagnosis diagnose_against_references(const CraneModel& model, const DiagnosisSignals& signals,
                                      const DiagnoseOptions& options,
                                      const SearchProgress& progress) {
  DifferenceSearch differences(model, signals, options, progress);
  Diagnosis d = differences.search(progress);
  std::vector<ReferenceFault> faults = reference_faults(model, signals, differences.options());
  // A few motions of large residuals may hide what all others show. What acts in few motions itself would be taken for their
  // variance, so that one variance for all comes first.
  if (d.verdict != Verdict::kMissing && differences.weigh_stretches()) {
    Diagnosis weighed = differences.search(progress);
    if (weighed.verdict == Verdict::kMissing) {
      d = std::move(weighed);
      d.stretches_weighed = true;
      d.notes.push_back(d.weighing_text());
    }
  }
  // Other motions alone can make a residual larger, so that it takes a difference found in the channel to say whose it is.
  std::erase_if(faults, [&](const ReferenceFault& f) { return !differs_in(d, f.text); });
  d.reference_faults = std::move(faults);
  return d;
}

}  // namespace sparflow
