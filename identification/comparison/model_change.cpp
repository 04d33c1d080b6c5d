#include "identification/comparison/model_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/comparison/error_change.h"

namespace sparflow {
namespace {

/// "3.19 -> 12.1 bar" of two amounts, "3.19 bar RMS" and "12.1 bar RMS"; both units where they differ.
std::string from_to(std::string before, std::string after) {
  for (std::string* text : {&before, &after}) {
    if (text->ends_with(" RMS")) text->resize(text->size() - 4);
  }
  const std::size_t space = before.find(' ');
  if (before.substr(space) == after.substr(after.find(' '))) before.resize(space);
  return before + " -> " + after;
}

ChangeKind kind_of(const RankedError& before, const RankedError& after,
                   const ModelChangeOptions& options) {
  const double was = std::abs(before.error), is = std::abs(after.error);
  const double grew = after.unexplained - before.unexplained;
  if (is > options.moves * was && grew > options.share_moves) return ChangeKind::kWorse;
  if (was > options.moves * is && -grew > options.share_moves) return ChangeKind::kBetter;
  return ChangeKind::kSame;
}

std::string named(const std::vector<const QuantityChange*>& changes, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < std::min(most, changes.size()); ++i)
    text += (i > 0 ? ", " : "") + changes[i]->text;
  if (changes.size() > most) text += fmt::format(" and {} more", changes.size() - most);
  return text;
}

}  // namespace

const char* change_word(ChangeKind kind) {
  return kind == ChangeKind::kBetter  ? "better"
         : kind == ChangeKind::kWorse ? "worse"
                                      : "unchanged";
}

std::vector<const QuantityChange*> ModelChange::of(ChangeKind kind) const {
  std::vector<const QuantityChange*> out;
  for (const QuantityChange& q : quantities) {
    if (q.kind == kind) out.push_back(&q);
  }
  return out;
}

Grade ModelChange::grade() const {
  const bool worse = !of(ChangeKind::kWorse).empty(), better = !of(ChangeKind::kBetter).empty();
  if (worse && (overall > 1.0 || !better)) return Grade::kPoor;
  if (worse || !better || !energy_compared) return Grade::kFair;
  for (const std::vector<std::string>& family :
       {std::vector<std::string>{"force"}, {"pressure", "pump"}, {"energy"}}) {
    bool gained = false, all_good = true;
    for (const QuantityChange& q : quantities) {
      if (std::find(family.begin(), family.end(), q.after.stage) == family.end()) continue;
      gained = gained || q.kind == ChangeKind::kBetter;
      all_good = all_good && q.after.grade == Grade::kGood;
    }
    if (!gained && !all_good) return Grade::kFair;
  }
  return Grade::kGood;
}

std::string ModelChange::sentence() const {
  const double percent = std::round(1e3 * (overall - 1.0)) / 10.0;
  std::string text =
      percent == 0.0 ? "unchanged overall" : fmt::format("{:+.1f} % overall", percent);
  const std::vector<const QuantityChange*> worse = of(ChangeKind::kWorse);
  text += worse.empty() ? fmt::format("; nothing worse by {:.0f} % of its scale",
                                      100.0 * ModelChangeOptions().share_moves)
                        : "; worse: " + named(worse, most_named);
  if (!energy_compared) text += "; the energy was not compared";
  return text;
}

ModelChange model_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const ModelChangeOptions& options) {
  ModelChange out;
  out.most_named = options.most_named;
  const ErrorRanking was = rank_errors(machine, before), is = rank_errors(machine, after);
  for (const RankedError& b : was.errors) {
    const RankedError* a = is.find(b.stage, b.at, b.regime);
    if (a == nullptr) continue;
    out.energy_compared = out.energy_compared || b.stage == "energy";
    out.quantities.push_back(
        {b, *a, kind_of(b, *a, options), b.words + " " + from_to(b.amount, a->amount)});
  }
  if (machine.pumps.empty()) out.energy_compared = true;  // there is none to compare
  std::stable_sort(out.quantities.begin(), out.quantities.end(), [](const auto& x, const auto& y) {
    return x.after.unexplained - x.before.unexplained > y.after.unexplained - y.before.unexplained;
  });
  out.overall = error_change(machine, before, after, "").overall;
  return out;
}

}  // namespace sparflow
