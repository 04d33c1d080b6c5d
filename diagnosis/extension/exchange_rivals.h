#pragma once
/// Exchanges an effect that a diagnosis has named for a rival that it hardly distinguishes from it, by the errors on data
/// that took no part. Used by improve.cpp only.
#include <vector>

#include "diagnosis/extension/refit_context.h"

namespace sparflow {

/// The other effects that explain what this effect of a diagnosis does nearly as well: those in FoundEffect::alternatives.
std::vector<EffectAt> close_rivals(const Diagnosis& diagnosis, const EffectAt& effect);

struct RivalTrial {
  const CraneModel& from;                ///< with the effects as estimated together
  const std::vector<EffectAt>& effects;  ///< all of the model
  EffectAt effect;                       ///< one of them
  const std::vector<EffectAt>& rivals;
};

/// Puts each rival in the place of the effect and cross-validates. Of those whose error is within
/// ExtendOptions::equal_rivals of the least and not larger by more than chance between motions, the one that comes first in the catalogue is taken, which lists what is usual
/// before what is rare: the likelihood orders such rivals by the noise of the log, and a copy of the same log with other
/// digits would give another one. A rival is taken only where its parameters are determined and plausible, and where
/// the errors of the other stage do not grow.
/// @return the effect itself or one of the rivals
EffectAt best_of_rivals(const RefitContext& context, const RivalTrial& trial,
                        const SearchProgress& progress);

/// Whether the logs determine that an effect is there at all: the 95 % interval of one of the parameters to which it is
/// proportional excludes zero. True for an effect without such a parameter or without intervals.
bool is_determined(const AppliedEffect& e);

}  // namespace sparflow
