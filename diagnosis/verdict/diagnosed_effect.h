#pragma once
/// A found effect as diagnosis reports it. Used by diagnose.cpp and its parts only.
#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// Of a residual in the rows of suspect logs. [SI]
double suspect_rms(const Evidence& evidence, std::size_t channel, const Eigen::VectorXd& residual);

/// Fit of all found effects but one, with the leaders of pumps that there are without it.
/// @param index of a found effect; their number: all of them
EffectFit fit_without(const Diagnosis& d, std::size_t index);

/// Difference in evidence below which two effects are the same on these logs: what a law's own form is wrong by makes
/// that share, squared, of its gain. [nats]
double same_within(const FoundEffect& found, double same_nats);

/// In words and numbers, with errors without and with it.
DiagnosedEffect describe_effect(const Diagnosis& d, std::size_t index,
                                const SearchOptions& options);

}  // namespace sparflow
