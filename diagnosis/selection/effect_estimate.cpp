#include "diagnosis/selection/effect_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnosis/evidence/left_out_rows.h"
#include "diagnosis/regression/acceptance_statistics.h"
#include "diagnosis/selection/effect_intervals.h"
#include "diagnosis/selection/leader_updates.h"
#include "diagnosis/selection/search_candidates.h"
#include "identification/comparison/report_numbers.h"
#include "identification/signals/load_sensing_leader.h"
#include "identification/signals/series.h"
#include "models/math/error.h"
#include "models/math/golden_section.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
/// Linearisations: the error falls by the share of the nonlinearity each time, a tenth for angles of a few degrees.
constexpr int kChords = 3;
constexpr int kSweeps = 2;  // over all nonlinear parameters

/// Descriptions of the nonlinear parameters, in their order.
std::vector<const EffectParameter*> shape_parameters(const Effect& effect) {
  std::vector<const EffectParameter*> out;
  for (const EffectParameter& p : effect.info().parameters) {
    if (!p.linear) out.push_back(&p);
  }
  return out;
}

/// Kinds of channels in which these effects show.
std::vector<EvidenceKind> kinds_of(const std::vector<EffectAt>& effects) {
  std::vector<EvidenceKind> out;
  for (const EffectAt& e : effects) {
    for (const EvidenceKind k : e.effect->shows_in()) {
      if (std::find(out.begin(), out.end(), k) == out.end()) out.push_back(k);
    }
  }
  return out;
}

class Estimator {
 public:
  Estimator(const CraneModel& model, const std::vector<EffectAt>& wanted, EstimateLogs logs,
            const EstimateOptions& options)
      : base_(model),
        options_(options),
        known_(model.effects),
        suspects_(std::move(logs.suspects)),
        references_(std::move(logs.references)),
        sharp_(can_sharpen(suspects_) && (references_.empty() || can_sharpen(references_))),
        leave_out_(std::move(logs.leave_out)) {
    if (sharp_) sharpen_all();
    std::erase_if(base_.effects, [&](const AppliedEffect& a) {
      return !options_.differences &&
             std::any_of(wanted.begin(), wanted.end(),
                         [&](const EffectAt& e) { return a.effect == e.effect && a.at == e.at; });
    });
    in_references_ = logs.in_references.value_or(base_.effects);
    options_.evidence.kinds = kinds_of(wanted);
    evidence_ = collect(base_);
    active_.assign(evidence_.channels.size(), false);
    for (const EffectAt& e : wanted) add_design(model, e);
  }

  EffectEstimate run(const SearchProgress& progress) {
    const auto tell = [&](double share, const char* what) {
      if (progress) progress(share, what);
    };
    tell(0.0, "parameters of the effects");
    search_grids();
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (std::size_t d = 0; d < designs_.size(); ++d) refine(d);
      tell(0.3 + 0.3 * sweep, "parameters of the effects");
    }
    double log_likelihood = likelihood();
    std::vector<FoundEffect> found = with_intervals();
    for (int turn = 0; turn < kLeaderTurns; ++turn) {
      std::optional<Evidence> updated = evidence_.with_leaders_of(applied(found));
      if (!acts(Mechanism::kEstimateLeaders, updated.has_value())) break;
      evidence_ = std::move(*updated);
      designs_ = rebuilt_designs(evidence_, designs_);
      for (std::size_t d = 0; d < designs_.size(); ++d) refine(d);
      log_likelihood = likelihood();
      found = with_intervals();
    }
    const bool machine = std::any_of(designs_.begin(), designs_.end(), [](const EffectDesign& d) {
      return d.effect.effect->changes_machine();
    });
    for (int chord = 0; machine && chord < kChords; ++chord) {
      if (!correct_linearisation(found)) break;
      found = with_intervals();
    }
    for (int secant = 0; secant < kChords && relinearise(found); ++secant) found = with_intervals();
    EffectEstimate out;
    out.log_likelihood = log_likelihood;
    out.effects = applied(found);
    for (const FoundEffect& f : found) out.significant.push_back(!f.not_significant);
    add_notes(out);
    tell(1.0, "parameters of the effects");
    return out;
  }

 private:
  bool acts(Mechanism m, bool decides) const {
    return options_.evidence.mechanisms.act(m, decides);
  }
  /// Whether positions are measured so finely in every log that a much shorter window than the search's suffices.
  bool can_sharpen(const std::vector<MachineSignals>& logs) const {
    return std::all_of(logs.begin(), logs.end(), [&](const MachineSignals& s) {
      return sharp_window(s) < options_.much_sharper * s.window;
    });
  }
  static double sharp_window(const MachineSignals& s) {
    return sharpest_window(s.time, s.runs, s.q_measured, s.window);
  }
  void sharpen_all() {
    for (auto* logs : {&suspects_, &references_}) {
      for (MachineSignals& s : *logs) s = smoothed_anew(base_.machine, s, sharp_window(s));
    }
  }

  Evidence collect(const CraneModel& model) const {
    EvidenceOptions how = options_.evidence;
    how.whole_motions = how.whole_motions || sharp_;
    Evidence evidence = collect_evidence(model, suspects_, references_, &in_references_, how);
    // laws keep what those known before leave them, also while all are estimated: a valve's lag the openings that a dead band
    // leaves, a line's loss the pump's lag
    for (MachineSeries& s : evidence.series) {
      s = with_passed_flows(known_, with_openings(known_, std::move(s)));
      if (options_.evidence.mechanisms.enabled(Mechanism::kPumpFollows))
        s.pumps = pumps_with_lags_of(known_, s);
    }
    if (leave_out_.empty()) return evidence;
    for (EvidenceChannel& c : evidence.channels) c = without_rows(c, leave_out_);
    std::erase_if(evidence.channels, [](const EvidenceChannel& c) { return c.rows() == 0; });
    return evidence;
  }

  /// Adds what a search has found between the grid's values.
  void add_start(std::vector<EffectDesign>& grid, const std::vector<double>& shape) const {
    if (shape.size() != grid.front().shape.size() ||
        std::any_of(grid.begin(), grid.end(),
                    [&](const EffectDesign& d) { return d.shape == shape; }))
      return;
    const bool optional =
        std::any_of(grid.begin(), grid.end(), [](const EffectDesign& d) { return d.optional; });
    EffectDesign start = make_design(evidence_, grid.front().effect, shape, {}, optional);
    if (start.acts()) grid.push_back(std::move(start));
  }

  void add_design(const CraneModel& model, const EffectAt& e) {
    const auto known =
        std::find_if(model.effects.begin(), model.effects.end(),
                     [&](const AppliedEffect& a) { return a.effect == e.effect && a.at == e.at; });
    std::vector<EffectDesign> acting;
    if (known != model.effects.end() && !options_.differences) {
      acting.push_back(make_design(evidence_, e, shape_of(*known)));
      if (!acting.back().acts()) acting.clear();
    } else {
      for (SearchCandidate& c : search_candidates(evidence_, {e})) acting = std::move(c.designs);
      if (!acting.empty() && designs_.size() < options_.starts.size())
        add_start(acting, options_.starts[designs_.size()]);
    }
    if (acting.empty() && !leave_out_.empty()) return;  // those left out show it alone
    if (acting.empty()) {
      throw InputError(
          {}, effect_key(e.effect->info(), base_.machine, e.at),
          fmt::format("these logs do not show it; it needs {}, and motions in which it acts",
                      fmt::join(e.effect->info().signals, ", ")));
    }
    for (const EffectDesign& d : acting) {
      for (std::size_t c = 0; c < active_.size(); ++c) active_[c] = active_[c] || d.touches(c);
    }
    designs_.push_back(acting.front());
    grids_.push_back(std::move(acting));
  }

  std::vector<const EffectDesign*> pointers() const {
    std::vector<const EffectDesign*> out;
    for (const EffectDesign& d : designs_) out.push_back(&d);
    return out;
  }
  double likelihood() const {
    FitControl control;
    control.active = active_;  // the effects do not act in the others
    return fit_effects(evidence_, pointers(), nullptr, control).total();
  }
  /// The same intervals as in a diagnosis, so that its report and the model have the same values.
  std::vector<FoundEffect> with_intervals() const {
    std::vector<FoundEffect> found(designs_.size());
    for (std::size_t d = 0; d < designs_.size(); ++d) found[d].design = designs_[d];
    estimate_intervals(evidence_, found);
    return found;
  }

  void search_grids() {
    for (std::size_t d = 0; d < designs_.size(); ++d) {
      if (grids_[d].size() < 2) continue;
      double best = -std::numeric_limits<double>::infinity();
      std::size_t at = 0;
      for (std::size_t i = 0; i < grids_[d].size(); ++i) {
        designs_[d] = grids_[d][i];
        const double l = likelihood();
        if (l > best) best = l, at = i;
      }
      designs_[d] = grids_[d][at];
    }
  }

  double likelihood_at(std::size_t d, std::size_t s, double value) {
    std::vector<double> shape = designs_[d].shape;
    shape[s] = value;
    EffectDesign design = make_design(evidence_, designs_[d].effect, std::move(shape));
    if (!design.acts()) return -std::numeric_limits<double>::infinity();
    std::swap(designs_[d], design);
    const double l = likelihood();
    std::swap(designs_[d], design);
    return l;
  }

  /// Interval for nonlinear parameter `s` of design `d`, between the neighbours of its value on the effect's grid.
  std::pair<double, double> bracket(std::size_t d, std::size_t s) const {
    const EffectAt& e = designs_[d].effect;
    const EffectParameter& p = *shape_parameters(*e.effect)[s];
    const double x = designs_[d].shape[s];
    double lo = p.lower, hi = p.upper;
    for (const double v : e.effect->grid(grid_log(evidence_), e.at, static_cast<int>(s))) {
      if (v < x - 1e-9 * std::abs(x)) lo = std::max(lo, v);
      if (v > x + 1e-9 * std::abs(x)) hi = std::min(hi, v);
    }
    const double step = options_.largest_step;
    return {std::max(lo, x > 0.0 ? x / step : lo), std::min(hi, x > 0.0 ? step * x : hi)};
  }

  void refine(std::size_t d) {
    const std::vector<bool> choices = shape_choices(*designs_[d].effect.effect, designs_[d].shape);
    for (std::size_t s = 0; s < designs_[d].shape.size(); ++s) {
      if (choices[s]) continue;  // the grid contains all variants
      const auto [a, b] = bracket(d, s);
      if (!(b > a)) continue;
      const double start = designs_[d].shape[s], at_start = likelihood();
      const GoldenSection found = golden_section(
          a, b, kMostShapeSections, [&](double x) { return -likelihood_at(d, s, x); },
          kShapeWidth * std::max(std::abs(b), 1e-12));
      std::vector<double> shape = designs_[d].shape;
      shape[s] = -found.value > at_start ? found.x : start;
      designs_[d] = make_design(evidence_, designs_[d].effect, std::move(shape));
    }
  }

  /// Secants at the values found, of effects whose signature is one. @return whether there is such an effect
  bool relinearise(const std::vector<FoundEffect>& found) {
    bool any = false;
    for (std::size_t d = 0; d < designs_.size(); ++d) {
      const Effect& effect = *designs_[d].effect.effect;
      if (!effect.depends_on_size()) continue;
      std::vector<double> about;
      const std::vector<EffectParameter>& parameters = effect.info().parameters;
      for (std::size_t p = 0; p < parameters.size(); ++p)
        if (parameters[p].linear) about.push_back(found[d].values[p]);
      designs_[d] = make_design(evidence_, designs_[d].effect, designs_[d].shape, about);
      any = true;
    }
    return any;
  }

  /// @param machine whether to include effects that change the machine
  static std::vector<AppliedEffect> applied(const std::vector<FoundEffect>& found,
                                            bool machine = true) {
    std::vector<AppliedEffect> out;
    for (const FoundEffect& f : found) {
      const EffectAt& e = f.design.effect;
      if (machine || !e.effect->changes_machine())
        out.push_back({e.effect, e.at, f.values, f.lower95, f.upper95, f.covariance});
    }
    return out;
  }

  /// Sets y = measured - exact law + its linearisation, for effects that change the machine.
  /// @return false when the rows of the changed machine differ
  bool correct_linearisation(const std::vector<FoundEffect>& found) {
    CraneModel exact = base_;
    for (const FoundEffect& f : found) {
      const EffectAt& e = f.design.effect;
      if (e.effect->changes_machine())
        exact.effects.push_back({e.effect, e.at, f.values, f.lower95, f.upper95});
    }
    Evidence left = collect(exact);
    std::optional<Evidence> updated = left.with_leaders_of(applied(found, false));
    if (acts(Mechanism::kEstimateLeaders, updated.has_value())) left = std::move(*updated);
    if (left.channels.size() != evidence_.channels.size()) return false;
    for (std::size_t c = 0; c < left.channels.size(); ++c) {
      EvidenceChannel& channel = left.channels[c];
      // rows differ when the changed machine cannot take a pose; the linearised fit is then kept
      if (channel.sample != evidence_.channels[c].sample) return false;
      for (std::size_t d = 0; d < designs_.size(); ++d) {
        if (!designs_[d].effect.effect->changes_machine() || !designs_[d].touches(c)) continue;
        VectorXd theta(designs_[d].linear);
        Index k = 0;
        const auto& parameters = designs_[d].effect.effect->info().parameters;
        for (std::size_t p = 0; p < parameters.size(); ++p) {
          if (parameters[p].linear) theta[k++] = found[d].values[p];
        }
        channel.y += designs_[d].columns[c] * theta;
      }
    }
    for (std::size_t c = 0; c < left.channels.size(); ++c) {
      evidence_.channels[c].y = std::move(left.channels[c].y);
    }
    return true;
  }

  void add_notes(EffectEstimate& out) const {
    for (const AppliedEffect& e : out.effects) {
      for (std::size_t p = 0; p < e.values.size(); ++p) {
        const EffectParameter& parameter = e.effect->info().parameters[p];
        // the bound on which a parameter lies that the logs do not determine says nothing
        if (parameter.choice || is_absent(parameter, e.values[p]) || !value_is_determined(e, p))
          continue;
        if (!lies_on_bound(parameter, e.values[p])) continue;
        out.notes.push_back(fmt::format(
            "{} of {} lies on the bound of its plausible range, {} {}: another effect may act, "
            "or it does not act at all",
            parameter.name, e.key(base_.machine), plain_number(e.values[p] / parameter.si, 4),
            parameter.unit));
      }
    }
  }

  CraneModel base_;
  EstimateOptions options_;
  std::vector<AppliedEffect> known_;  ///< all effects of the model
  std::vector<MachineSignals> suspects_, references_;
  bool sharp_ = false;  // shorter windows than the search's, with rows up to the ends of motions
  std::vector<Mask> leave_out_;
  std::vector<AppliedEffect> in_references_;
  Evidence evidence_;
  std::vector<bool> active_;  // by channel: touched by an effect
  std::vector<EffectDesign> designs_;
  std::vector<std::vector<EffectDesign>> grids_;
};

}  // namespace

std::vector<double> shape_of(const AppliedEffect& e) {
  std::vector<double> shape;
  const auto& parameters = e.effect->info().parameters;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    if (!parameters[p].linear) shape.push_back(e.values[p]);
  }
  return shape;
}

EffectEstimate estimate_effects(const CraneModel& model, const std::vector<EffectAt>& wanted,
                                EstimateLogs logs, const SearchProgress& progress,
                                const EstimateOptions& options) {
  if (wanted.empty()) return {};
  SPARFLOW_CHECK(!logs.suspects.empty(), "effects need a log to be estimated from");
  return Estimator(model, wanted, std::move(logs), options).run(progress);
}

std::string why_no_finding(const EffectEstimate& all, const EffectDesign& design, std::size_t i) {
  if (!all.significant[i])
    return "the 95 % region of its values, estimated together, contains zero";
  const std::vector<double>& values = all.effects[i].values;
  if (rests_on_bound(design, Eigen::Map<const Eigen::VectorXd>(values.data(), design.linear)))
    return "estimated together with the others, a parameter lies on the bound of its plausible "
           "range";
  return {};
}

}  // namespace sparflow
