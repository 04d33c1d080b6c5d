#pragma once
/// A found effect as a diagnosis reports it. Used by diagnose.cpp and its parts only.
#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// RMS of a residual over the rows of suspect logs. [SI]
double suspect_rms(const Evidence& evidence, std::size_t channel, const Eigen::VectorXd& residual);

/// The same, weighed by Diagnosis::block_weights. [SI] NaN where all blocks have one variance.
double weighed_suspect_rms(const Diagnosis& d, std::size_t channel,
                           const Eigen::VectorXd& residual);

/// Fit of all found effects except one, with the load-sensing leaders that follow from the others.
/// @param index of the found effect to leave out; the number of found effects leaves out none
EffectFit fit_without(const Diagnosis& d, std::size_t index);

/// Largest ratio, over the channels in which a found effect acts, of the error without it to that with it, as the search weighed
/// them. [-]
double largest_reduction(const Diagnosis& d, std::size_t index);

/// Describes a found effect in words and numbers, with the errors without and with it.
DiagnosedEffect describe_effect(const Diagnosis& d, std::size_t index,
                                const SearchOptions& options);

/// A parameter "share" says how much of its law an effect shows, one for the whole law.
/// @return a sentence where the 95 % interval of that share excludes one, so that another law may be the cause; else ""
std::string partial_law(const DiagnosedEffect& e);

/// @return a sentence where the references leave much less than the effect leaves in a channel, so that it is not all; else ""
std::string left_beyond_references(const Diagnosis& d, const ChannelGain& g);

}  // namespace sparflow
