#pragma once
/// Unmodelled structure in the residual, and whether it makes the effects found doubtful. Used by diagnose.cpp only.
#include <vector>

#include "diagnosis/residual/residual_model.h"
#include "diagnosis/verdict/diagnose.h"
#include "diagnosis/verdict/residual_levels.h"

namespace sparflow {

/// Variance of a channel that a residual model explains, divided by that which effects and residual model explain
/// together. 0..1. What the references leave beyond the sensors' noise as well says nothing against an effect, unless it is
/// opposite.
double unmodelled_share(const Diagnosis& d, const ResidualStructure& left, BesideReferences beside);

/// Whether unmodelled structure makes an effect doubtful: structure in the channel where the effect acts most, or
/// larger structure in another channel whose cause shows there too, so that the effect may be a part of it. An error of
/// a sensor is the same in every channel that uses its reading, so structure in any of them makes it doubtful.
bool is_doubtful(const Evidence& evidence, const DiagnosedEffect& e,
                 const std::vector<ResidualStructure>& unmodelled);

/// 0..1 share of the squared error beyond the noise floor that all found effects explain, in the channel where the
/// effect acts most; one where the remaining error is near the noise floor.
double explained_share(const Diagnosis& d, const DiagnosedEffect& e);

/// Whether an effect is minor: a much larger error of unknown cause stays unexplained at its place, and the effect only
/// resembles a part of it. True effects leave no errors of that size where they act most (docs/diagnose.md, section 7).
bool is_minor_effect(const Diagnosis& d, const DiagnosedEffect& e);

/// Describes the error that stays unexplained beside a minor effect; it depends on no single signal.
Unexplained describe_minor_effect(const Evidence& evidence, const DiagnosedEffect& e);

/// Describes unmodelled structure that a residual model found.
Unexplained describe_residual_structure(const Evidence& evidence, const ResidualStructure& left);

/// Describes evidence that fits an effect only with implausible parameters. @param f one of SearchResult::unnamed
Unexplained describe_unnamed(const Diagnosis& d, const FoundEffect& f);

/// Describes a channel whose residual is larger than in the references although no effect and no signal explains it.
Unexplained describe_beyond_references(const Diagnosis& d, std::size_t channel);

/// Describes an isolated event that an effect would explain although no law can be tested on it.
Unexplained describe_isolated_event(const Diagnosis& d, const IsolatedEventOptions& options);

}  // namespace sparflow
