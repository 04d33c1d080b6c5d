#include "diagnosis/verdict/residual_levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "diagnosis/residual/residual_oscillation.h"
#include "diagnosis/selection/search_state.h"
#include "diagnosis/verdict/block_levels.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "models/math/nan.h"
#include "models/math/student.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

LevelComparison levels_of(const Diagnosis& d, std::size_t channel) {
  return compare_levels(d.evidence, channel, settled(d, channel, d.search.final.residual[channel]));
}

/// Probability that the mean level of suspect logs exceeds that of the references so far when both are alike.
double chance_of_level(const LevelComparison& levels) {
  return student_tail(levels.difference / std::sqrt(levels.variance), levels.freedom);
}

/// Probability that the largest block of the suspect logs lies so far above those of the references when all are alike:
/// Student's prediction of one further value, by Bonferroni's bound over the suspect blocks. A deviation in one stretch
/// of motion hardly moves the mean level. Levels are no normal deviates. Far out the tail is Laplace's, exponential in the logarithm:
/// in 115 channels of logs without a change Student's has said "below 0.001" of five. And where the references have nearly as large a one,
/// it is no difference.
/// @param excess ratio of the RMS
double chance_of_largest(const LevelComparison& levels, double excess) {
  if (levels.largest < levels.largest_in_references + 2.0 * std::log(excess)) return 1.0;
  const double z = levels.largest / levels.largest_deviation;
  const double laplace = 0.5 * std::exp(-std::numbers::sqrt2 * z);
  return levels.suspects * std::max(student_tail(z, levels.references - 1.0), laplace);
}

/// Whether something is significantly more than a multiple of what the references have, at equal work: other motions alone change a
/// strength as they change the levels of the residual, and the slopes by which equal work is compared are estimates themselves.
/// @param here, there RMS @param ratio the multiple @param chance level of the test
bool is_multiple(const LevelComparison& levels, double here, double there, double ratio,
                 double chance) {
  if (!(here > 0.0)) return false;
  if (!(there > 0.0)) return true;
  const double beyond = 2.0 * std::log(here / (ratio * there)) - levels.explained;
  if (!(levels.variance > 0.0)) return beyond > 0.0;
  return student_tail(beyond / std::sqrt(levels.variance), levels.freedom) < chance;
}

/// References and suspect logs may lack opposite laws: the law that is learned from both lies between two different ones, and
/// equal sizes of what is left are no sign of a common cause.
/// @return probability by chance of what is seen, small where they are opposite
double chance_of_opposite_law(const Diagnosis& d, const ResidualStructure& left,
                              const DiagnoseOptions& options) {
  if (left.event || left.oscillation) return 1.0;  // no law of measured signals
  const std::vector<double> agreement =
      agreement_with_references(d.evidence, d.search.final, left, options.residual);
  if (agreement.size() < 2) return 1.0;
  const auto n = static_cast<double>(agreement.size());
  const Eigen::Map<const VectorXd> v(agreement.data(), static_cast<Index>(agreement.size()));
  const double error = std::sqrt((v.array() - v.mean()).square().sum() / (n - 1.0) / n);
  const double chance = error > 0.0 ? student_tail(-v.mean() / error, n - 1.0) : 1.0;
  if (tracing())
    fmt::print(stderr,
               "  {}: suspect logs against references {:.3g} +- {:.2g} by block, opposite by "
               "chance {:.2g}\n",
               d.evidence.channels[left.channel].text, v.mean(), error, chance);
  return chance;
}

/// Bonferroni's bound over all channels and both ways in which a residual may exceed that of the references.
double among_channels(const Diagnosis& d, double chance) {
  return std::min(1.0, kWaysToExceed * static_cast<double>(d.evidence.channels.size()) * chance);
}

}  // namespace

std::optional<Excess> excess_over_references(const Diagnosis& d, std::size_t channel) {
  if (!d.evidence.has_reference()) return std::nullopt;
  const LevelComparison levels = levels_of(d, channel);
  if (std::min(levels.suspects, levels.references) < 2) return std::nullopt;
  const double ratio = d.thresholds.least_excess_ratio;
  const Excess excess{chance_of_level(levels), chance_of_largest(levels, ratio)};
  if (tracing())
    fmt::print(
        stderr,
        "  {}: residual {:.3g}, in the references {:.3g} ({:.3g} at equal work) {}, by chance "
        "{:.2g}, in one block {:.2g}, {} and {} blocks\n",
        d.evidence.channels[channel].text,
        suspect_rms(d.evidence, channel, d.search.final.residual[channel]) /
            d.evidence.channels[channel].unit.si,
        reference_rms(d, channel) / d.evidence.channels[channel].unit.si,
        expected_rms(d, channel) / d.evidence.channels[channel].unit.si,
        d.evidence.channels[channel].unit.name, excess.level, excess.largest, levels.suspects,
        levels.references);
  return excess;
}

Evidence references_first(const Evidence& evidence) {
  Evidence out = evidence;
  std::rotate(out.series.begin(),
              out.series.begin() + static_cast<std::ptrdiff_t>(evidence.suspects),
              out.series.end());
  const auto suspects = static_cast<int>(evidence.suspects);
  const auto references = static_cast<int>(evidence.series.size()) - suspects;
  out.suspects = static_cast<std::size_t>(references);
  for (EvidenceChannel& c : out.channels) {
    for (int& log : c.log) log = log < suspects ? log + references : log - suspects;
    if (!c.raw.empty()) std::rotate(c.raw.begin(), c.raw.begin() + suspects, c.raw.end());
  }
  return out;
}

VectorXd settled(const Diagnosis& d, std::size_t channel, const VectorXd& residual) {
  const VectorXd scale =
      d.search.final.noise[channel].scale_of(d.evidence.channels[channel].noise_rows());
  return scale.size() > 0 ? VectorXd(residual.cwiseQuotient(scale)) : residual;
}

double reference_rms(const Diagnosis& d, std::size_t channel, const VectorXd& residual) {
  const EvidenceChannel& c = d.evidence.channels[channel];
  double squares = 0.0, n = 0.0;
  for (std::size_t b = 0; b < c.blocks.size(); ++b) {
    if (static_cast<std::size_t>(c.log[b]) < d.evidence.suspects) continue;
    const Index length = c.blocks[b].last - c.blocks[b].first;
    squares += residual.segment(c.blocks[b].first, length).squaredNorm();
    n += static_cast<double>(length);
  }
  return n > 0.0 ? std::sqrt(squares / n) : kNaN;
}

double reference_rms(const Diagnosis& d, std::size_t channel) {
  return reference_rms(d, channel, d.search.final.residual[channel]);
}

double expected_rms(const Diagnosis& d, std::size_t channel, const VectorXd& residual) {
  return reference_rms(d, channel, residual) * std::exp(0.5 * levels_of(d, channel).explained);
}

double expected_rms(const Diagnosis& d, std::size_t channel) {
  return expected_rms(d, channel, d.search.final.residual[channel]);
}

std::optional<double> chance_beyond_references(const Diagnosis& d, std::size_t channel) {
  const std::optional<Excess> excess = excess_over_references(d, channel);
  if (!excess) return std::nullopt;
  return among_channels(d, std::min(excess->level, excess->largest));
}

bool exceeds_references(const Diagnosis& d, std::size_t channel) {
  const std::optional<double> chance = chance_beyond_references(d, channel);
  return !chance || *chance < d.thresholds.structure_false_alarm;
}

std::optional<std::size_t> channel_beyond_references(const Diagnosis& d) {
  std::optional<std::size_t> found;
  double least = d.thresholds.structure_false_alarm;
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    if (!(suspect_rms(d.evidence, c, d.search.final.residual[c]) >
          d.thresholds.least_excess_ratio * expected_rms(d, c)))
      continue;
    const std::optional<double> chance = chance_beyond_references(d, c);
    if (chance && *chance < least) {
      least = *chance;
      found = c;
    }
  }
  return found;
}

std::vector<BesideReferences> beside_references(const Diagnosis& d,
                                                const std::vector<ResidualStructure>& left,
                                                const DiagnoseOptions& options) {
  std::vector<BesideReferences> out(left.size(), BesideReferences::kMore);
  if (left.empty() || !d.evidence.has_reference()) return out;
  const Evidence swapped = references_first(d.evidence);
  const std::vector<ResidualStructure> there =
      find_residual_structure(swapped, d.search.final, options.residual);
  for (std::size_t i = 0; i < left.size(); ++i) {
    const std::size_t channel = left[i].channel;
    const LevelComparison levels = levels_of(d, channel);
    const auto more_than = [&](double there_rms, double here_rms) {
      return is_multiple(levels, here_rms, there_rms, d.thresholds.least_excess_ratio,
                         d.thresholds.structure_false_alarm);
    };
    const bool found = std::any_of(there.begin(), there.end(), [&](const ResidualStructure& r) {
      return r.channel == channel && !more_than(r.rms, left[i].rms);
    });
    const double floor = d.evidence.channels[channel].noise_floor;
    const auto beyond_noise = [&](double rms) {
      return std::max(0.0, rms * rms - (std::isfinite(floor) ? floor * floor : 0.0));
    };
    // an oscillation is measured before the filter, so after it the residual limits it
    const double here =
        std::min(left[i].rms * left[i].rms,
                 beyond_noise(suspect_rms(d.evidence, channel, d.search.final.residual[channel])));
    const bool room =
        !more_than(std::sqrt(beyond_noise(reference_rms(d, channel))), std::sqrt(here));
    // one that is weaker than what counts as an oscillation is one all the same
    const bool oscillates =
        left[i].oscillation &&
        !more_than(strongest_oscillation(swapped, swapped.channels[channel], options.residual).rms,
                   left[i].rms);
    const double tests = static_cast<double>(left.size());
    if (tests * chance_of_opposite_law(d, left[i], options) < d.thresholds.structure_false_alarm)
      out[i] = BesideReferences::kOpposite;
    else if ((found || room || oscillates) &&
             (left[i].oscillation || !exceeds_references(d, channel)))
      out[i] = BesideReferences::kShared;
  }
  return out;
}

}  // namespace sparflow
