#include "diagnosis/verdict/size_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "diagnosis/regression/acceptance_statistics.h"
#include "diagnosis/regression/size_by_logs.h"
#include "diagnosis/selection/search_state.h"
#include "diagnosis/verdict/designs_by_group.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "models/math/linear_algebra.h"
#include "models/math/student.h"

namespace sparflow {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// A chi-square value of `freedom` degrees as a normal deviate, zero where it is below its median (Wilson and Hilferty 1931,
/// Proc. Natl. Acad. Sci. 17, 684).
double deviate_of_chi_square(double value, double freedom) {
  const double share = 2.0 / (9.0 * freedom);
  return std::max(0.0, (std::cbrt(value / freedom) - (1.0 - share)) / std::sqrt(share));
}

/// Square of a vector over its covariance, whose entries differ by many orders of magnitude. [-]
double squared_over(const VectorXd& x, const MatrixXd& covariance) {
  const VectorXd scale = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = scale.asDiagonal() * covariance * scale.asDiagonal();
  const VectorXd z = scale.cwiseProduct(x);
  return z.dot(least_squares_of_least_norm(scaled, z));
}

}  // namespace

bool agree(const AppliedEffect& e, const Diagnosis& d, const FoundEffect& f) {
  const std::vector<EffectParameter>& parameters = e.effect->info().parameters;
  const auto count = static_cast<Index>(parameters.size());
  if (e.covariance.rows() != count || f.covariance.rows() != count) return false;
  std::vector<Index> compared;
  VectorXd difference(count);
  for (Index k = 0; k < count; ++k) {
    const auto p = static_cast<std::size_t>(k);
    difference[k] = f.values[p] - e.values[p];
    // Each log prefers a variant of the law as well; what one of them does not have cannot differ.
    if (!parameters[p].choice && !is_absent(parameters[p], f.values[p]) &&
        !is_absent(parameters[p], e.values[p]))
      compared.push_back(k);
  }
  if (compared.empty()) return true;
  const MatrixXd covariance = e.covariance(compared, compared) + f.covariance(compared, compared);
  const double deviate = deviate_of_chi_square(squared_over(difference(compared), covariance),
                                               static_cast<double>(compared.size()));
  const double chance = 0.5 * std::erfc(deviate / std::numbers::sqrt2);
  if (tracing())
    fmt::print(stderr, "  {}: values of both logs differ by {:.3g} standard deviations\n",
               effect_key(e.effect->info(), *d.evidence.series[0].machine, e.at), deviate);
  return chance * static_cast<double>(d.search.found.size()) >= d.thresholds.difference_false_alarm;
}

namespace {

/// Whether the references have the same effect with the same values, as far as both can tell. Only of effects that another value
/// replaces; of others the found values are the difference itself. Each log prefers a nonlinear parameter of its own (the length of a
/// rope by the phase of every swing), and the size of the one law in the other log then says that they differ.
bool agrees_with_references(const Diagnosis& d, const FoundEffect& f) {
  if (!is_replaced_when_changed(*f.design.effect.effect)) return false;
  const std::vector<AppliedEffect>& all = d.evidence.options.shared;
  return std::any_of(all.begin(), all.end(), [&](const AppliedEffect& e) {
    return same_place(e, f.design.effect) && agree(e, d, f);
  });
}

/// Whether the last `linear` parameters of a fit are not zero: Wald's test with the covariance that is robust against dependence
/// inside stretches of motion.
template <class Significant>
bool parameters_act(const EffectFit& fit, Index linear, const Significant& significant) {
  const Index first = fit.theta.size() - linear;
  std::vector<Index> moving;  // a parameter without columns has no variance
  for (Index k = first; k < fit.theta.size(); ++k)
    if (fit.covariance(k, k) > 0.0) moving.push_back(k);
  if (moving.empty()) return true;
  return significant(
      deviate_of_chi_square(squared_over(fit.theta(moving), fit.covariance(moving, moving)),
                            static_cast<double>(moving.size())));
}

void trace_sizes(const Diagnosis& d, const EffectAt& effect, const SizeByLogs& sizes, bool shared) {
  if (!tracing()) return;
  const auto in = [](const SizeInLogs& s) {
    return fmt::format("{:.3g} +- {:.2g} in {} blocks", s.size, s.standard_error, s.blocks);
  };
  fmt::print(stderr, "  {}{}: size {}, in the references {}, variation {:.2g}, difference {:.3g}\n",
             shared ? "change of " : "",
             effect_key(effect.effect->info(), *d.evidence.series[0].machine, effect.at),
             in(sizes.suspects), in(sizes.references), sizes.variation, sizes.difference());
}

/// What an effect with these linear parameters does in the suspect logs, over the residuals that are left. [-]
double action(const Diagnosis& d, const EffectDesign& suspect, const VectorXd& parameters) {
  double squares = 0.0;
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    if (!suspect.touches(c)) continue;
    const double left = suspect_rms(d.evidence, c, d.search.final.residual[c]);
    squares += std::pow(suspect_rms(d.evidence, c, suspect.columns[c] * parameters) / left, 2);
  }
  return std::sqrt(squares);
}

/// Action of the part of an effect that both groups of logs have over that of their difference. [-]
double common_over_change(const Diagnosis& d, const EffectDesign& suspect, const VectorXd& here,
                          const VectorXd& there) {
  const VectorXd common = (here.array() * there.array() > 0.0)
                              .select(here.cwiseAbs().cwiseMin(there.cwiseAbs()), 0.0)
                              .cwiseProduct(here.cwiseSign());
  return action(d, suspect, common) / action(d, suspect, here - there);
}

/// Linear parameters of an effect in both groups of logs. [SI]
struct InBothGroups {
  const VectorXd &suspects, &references;
};
/// Sizes of an effect in the direction of the suspect logs' parameters, and beyond those of the references.
struct SizesCompared {
  const SizeByLogs &from_nothing, &from_references;
};

/// Difference of both groups in standard errors of sampling and form error: the deviation of a law from the machine is another
/// one in other motions, in proportion to the part of the effect that both groups have.
double difference_beside_form_error(const Diagnosis& d, const EffectDesign& suspect,
                                    const InBothGroups& parameters, const SizesCompared& sizes,
                                    const RegressionOptions& options) {
  const SizeByLogs& from_nothing = sizes.from_nothing;
  const bool single = suspect.linear == 1;
  // the direction in which they differ most is chosen by the data, so that its square has as many degrees of freedom
  const double sampling =
      single ? std::abs(from_nothing.difference())
             : std::max(std::abs(from_nothing.difference()),
                        deviate_of_chi_square(std::pow(sizes.from_references.difference(), 2),
                                              suspect.linear));
  // of one parameter the sizes that are compared say which part both groups have
  const VectorXd here = single ? VectorXd(from_nothing.suspects.size * parameters.suspects)
                               : parameters.suspects,
                 there = single ? VectorXd(from_nothing.references.size * parameters.suspects)
                                : parameters.references;
  const double form =
      form_share(*suspect.effect.effect, options) * common_over_change(d, suspect, here, there);
  const double difference = sampling / std::hypot(1.0, sampling * form);
  if (tracing())
    fmt::print(stderr, "    by sampling {:.3g}, with a form error of {:.2g} of it {:.3g}\n",
               sampling, form, difference);
  return difference;
}

/// Number of the suspect logs' stretches of motion in which an effect acts, in the channel where it acts in most.
int stretches_of(const Evidence& evidence, const EffectDesign& suspect) {
  int most = 0;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    if (!suspect.touches(c)) continue;
    const EvidenceChannel& channel = evidence.channels[c];
    int here = 0;
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      const NoiseBlock& rows = channel.blocks[b];
      here += static_cast<std::size_t>(channel.log[b]) < evidence.suspects &&
                      !suspect.columns[c].middleRows(rows.first, rows.last - rows.first).isZero(0.0)
                  ? 1
                  : 0;
    }
    most = std::max(most, here);
  }
  return most;
}

}  // namespace

SizeVerdict by_size(const Diagnosis& d, std::size_t found, const SearchOptions& options) {
  // a law with as many parameters as stretches of motion follows them whatever the cause is
  if (stretches_of(d.evidence, d.search.found[found].design) <= d.search.found[found].design.linear)
    return {InReferences::kVaries, Proof::kClearExcess};
  const bool shared = is_shared(d.evidence, d.search.found[found]);
  if (!shared && agrees_with_references(d, d.search.found[found])) return {};
  const EffectDesign& suspect = d.search.found[found].design;
  EffectDesign reference = design_in(d.evidence, suspect, ActingLogs::kReferences);
  if (shared)
    for (MatrixXd& m : reference.columns) m.resize(0, 0);
  const OtherEffects beside(d, found);
  const std::vector<const EffectDesign*>& others = beside.designs;
  const Evidence evidence = shared ? d.evidence : with_law_fixed(d.evidence, suspect.effect);
  const auto fit = [&](std::initializer_list<const EffectDesign*> more) {
    return fit_beside(evidence, others, more, d.search.final);
  };
  const bool both = reference.acts();
  const EffectFit apart = both ? fit({&suspect, &reference}) : fit({&suspect});
  const Index first = apart.theta.size() - (both ? 2 : 1) * suspect.linear;
  const VectorXd in_suspects = apart.theta.segment(first, suspect.linear);
  const SizeByLogs sizes = size_by_logs(
      evidence, {suspect, reference, VectorXd::Zero(suspect.linear), in_suspects, others}, apart);
  // two-sided, Bonferroni's bound over the effects found; the sizes' scatter is estimated from as many stretches of motion as there
  // are, so that Student's distribution replaces the normal one (Hartung and Knapp 2001, Statist. Med. 20, 3875)
  const double freedom = sizes.freedom;
  const auto chance = [&](double z) {
    return (freedom > 0.0 ? 2.0 * student_tail(std::abs(z), freedom)
                          : std::erfc(std::abs(z) / std::numbers::sqrt2)) *
           static_cast<double>(d.search.found.size());
  };
  const auto significant = [&](double z) {
    return chance(z) < d.thresholds.difference_false_alarm;
  };
  const auto certain = [&](double z) {
    if (tracing()) fmt::print(stderr, "    chance of a difference this large {:.2g}\n", chance(z));
    return chance(z) < d.thresholds.difference_alone_false_alarm;
  };
  trace_sizes(d, suspect.effect, sizes, shared);
  const bool taken_over = d.search.found[found].absorbed > d.thresholds.absorbed_by_learned_laws;
  if (shared)
    return {significant(sizes.mean()) ? InReferences::kOther : InReferences::kVaries,
            taken_over              ? Proof::kClearExcess
            : certain(sizes.mean()) ? Proof::kNone
                                    : Proof::kExcess};
  const SizeInLogs &here = sizes.suspects, &there = sizes.references;
  // They take it over from all motions together, so that it may have no size in one group.
  const bool no_size =
      std::min(here.blocks, there.blocks) == 0 || !significant(here.size / here.standard_error);
  if (both && no_size && taken_over) {
    const EffectDesign everywhere = in_all_logs(suspect, reference);
    const EffectFit difference = fit({&everywhere, &suspect});
    return {parameters_act(difference, suspect.linear, significant) ? InReferences::kNot
                                                                    : InReferences::kAlike,
            Proof::kClearExcess};
  }
  // The law that both have had been estimated as its own opposite, which this one undid.
  if (in_suspects.isZero(0.0)) return {InReferences::kVaries, Proof::kClearExcess};
  // of a single stretch of motion it is not known how far the size varies between motions
  if (here.blocks > 0 && (sizes.freedom == 0.0 || !significant(here.size / here.standard_error)))
    return {InReferences::kVaries, Proof::kClearExcess};
  if (!both || there.blocks == 0)
    return {InReferences::kNot, here.blocks == 0                           ? Proof::kClearExcess
                                : certain(here.size / here.standard_error) ? Proof::kNone
                                                                           : Proof::kExcess};
  // The references cannot tell whether they have it, so that a residual that exceeds theirs says only that these motions show it.
  if (!significant(here.size / there.standard_error)) {
    if (here.blocks == 0) return {InReferences::kNot, Proof::kClearExcess};
    if (!significant(sizes.difference())) return {InReferences::kVaries, Proof::kClearExcess};
    return {InReferences::kNot, certain(sizes.difference()) ? Proof::kNone : Proof::kExcess};
  }
  // of several parameters only one may have changed
  const VectorXd in_reference = apart.theta.tail(suspect.linear);
  const SizeByLogs change = size_by_logs(
      evidence, {suspect, reference, in_reference, in_suspects - in_reference, others}, apart);
  const double difference = difference_beside_form_error(d, suspect, {in_suspects, in_reference},
                                                         {sizes, change}, options.regression);
  if (!significant(difference)) return {};
  return {
      significant(there.size / there.standard_error) ? InReferences::kOther : InReferences::kNot,
      certain(difference) ? Proof::kNone : Proof::kExcess};
}

}  // namespace sparflow
