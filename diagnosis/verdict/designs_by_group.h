#pragma once
/// Designs and fits of found effects in suspect logs, in references and in both. Used by the comparison with references only.
#include <initializer_list>
#include <vector>

#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

bool same_place(const AppliedEffect& a, const EffectAt& b);

/// Whether the found effect's columns act in all logs already, so that it is a difference.
bool is_shared(const Evidence& evidence, const FoundEffect& f);

/// Columns of a found effect in other logs than the suspect ones.
EffectDesign design_in(const Evidence& evidence, const EffectDesign& found, ActingLogs where);

/// A design that acts in suspect and in reference logs, from the designs for either.
EffectDesign in_all_logs(const EffectDesign& suspect, const EffectDesign& reference);

/// The other effects found, each with a size of its own in the references. Where they act there as well and share a channel,
/// an effect would otherwise take their part there and have another size for that reason alone.
struct OtherEffects {
  std::vector<EffectDesign> in_references;
  std::vector<const EffectDesign*> designs;  // in suspect logs, and those above

  OtherEffects(const Diagnosis& d, std::size_t found);
  OtherEffects(const OtherEffects&) = delete;
  OtherEffects& operator=(const OtherEffects&) = delete;
};

/// Fit of designs beside others, with covariance.
EffectFit fit_beside(const Evidence& evidence, std::vector<const EffectDesign*> others,
                     std::initializer_list<const EffectDesign*> more, const EffectFit& start);

/// The evidence in which a law that both logs have is not estimated anew: beside sizes of another variant of it in either group of
/// logs, which are its part in either, it is not determined.
Evidence with_law_fixed(const Evidence& evidence, const EffectAt& effect);

}  // namespace sparflow
