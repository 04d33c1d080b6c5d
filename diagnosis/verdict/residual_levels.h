#pragma once
/// Residuals of the suspect logs beside those of the references: what both leave unexplained alike is no change. Used by diagnose.cpp and
/// its parts only.
#include <optional>
#include <vector>

#include "diagnosis/residual/residual_model.h"
#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// Probabilities by chance that the residual of a channel in the suspect logs exceeds that in the references so far.
struct Excess {
  double level = 1.0;  ///< in the mean over the blocks
  double largest =
      1.0;  ///< in the largest block, by Student's prediction of one further block or Laplace's tail
};
inline constexpr double kWaysToExceed = 2.0;  ///< level and a block, for Bonferroni's bound

/// Nothing where there are no references, or too few motions of one kind.
std::optional<Excess> excess_over_references(const Diagnosis& d, std::size_t channel);

/// The same rows with references in the place of suspect logs, and these in theirs.
Evidence references_first(const Evidence& evidence);

/// A channel's residual relative to the deviation with which its noise settles, which is one in steady motion (NoiseModel::scale_of).
/// What a model lacks of starts and stops, an effect of steady motion need not explain. [rows, SI]
Eigen::VectorXd settled(const Diagnosis& d, std::size_t channel, const Eigen::VectorXd& residual);

/// RMS of a channel's residual, absent: its final one, in the reference logs [SI]; NaN where they do not have the channel.
double reference_rms(const Diagnosis& d, std::size_t channel, const Eigen::VectorXd& residual);
double reference_rms(const Diagnosis& d, std::size_t channel);

/// The same at the loads and speeds of the suspect logs, by the slopes of the levels of single motions over load and speed
/// (block_levels.h).
double expected_rms(const Diagnosis& d, std::size_t channel, const Eigen::VectorXd& residual);
double expected_rms(const Diagnosis& d, std::size_t channel);

/// Probability, by Bonferroni's bound over the channels, that a channel's final residual is so much larger in the suspect logs
/// than in the references by chance, on the logarithms of the blocks' mean squares at equal work (block_levels.h): Welch's (1947) test of their means, and
/// Student's prediction for the largest one, because a deviation in one stretch of motion hardly moves the mean. Nothing
/// where there are no references, or too few motions of one kind.
std::optional<double> chance_beyond_references(const Diagnosis& d, std::size_t channel);
/// Whether that is significant; true where there is nothing to compare with.
bool exceeds_references(const Diagnosis& d, std::size_t channel);
/// The channel in which it is most significant, among those whose residual is a multiple of that in the references; nothing where it
/// is in none, or without references.
std::optional<std::size_t> channel_beyond_references(const Diagnosis& d);

/// Structure in the suspect logs' final residual beside that of the references.
enum class BesideReferences {
  kMore,  ///< larger than theirs, or without references
  kOpposite,  ///< of the same size, but of opposite sign (agreement_with_references): both lack another law
  kShared  ///< theirs, so that it is no change
};
/// For each structure: shared is one of which the references have as large a one in the same channel by the same residual models, or
/// leave about as much beyond the sensors' noise there, and the residual of the suspect logs is neither significantly larger
/// (exceeds_references) nor opposite. As large is what is not significantly more than twice theirs at equal work. No signal of the logs
/// explains an oscillation, whose strength other motions alone change: that it is as large suffices.
std::vector<BesideReferences> beside_references(const Diagnosis& d,
                                                const std::vector<ResidualStructure>& left,
                                                const DiagnoseOptions& options);

}  // namespace sparflow
