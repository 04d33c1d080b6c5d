#pragma once
/// One step of an extension: an effect is added or removed, everything is learned again, and errors are compared. Used by
/// extend.cpp and improve.cpp only.
#include <chrono>
#include <string>
#include <vector>

#include "diagnosis/extension/extend.h"
#include "diagnosis/extension/refit_context.h"

namespace sparflow {

using StepClock = std::chrono::steady_clock;

/// A step with the model that it leads to, which the caller may keep or not.
struct TriedStep {
  ExtendStep step;
  Judged next;
  std::vector<std::string> notes;  ///< of the estimate
};

/// Compares the errors without and with an effect, where it acts, and fills the step with them.
void judge_step(const RefitContext& context, const EffectAt& e, const CompareResult& before,
                const CompareResult& after, ExtendStep& step);

/// The errors of forces and flows that a step increased, for an effect on one of the two those of that stage alone.
/// Pressures, which are learned again from the force that the step alters, are no evidence against a law of forces: the
/// pressures learned before may have imitated what was missing.
std::vector<HarmedError> harmed_measured(const ExtendStep& step);

/// Adds one effect to `current`.
TriedStep try_adding(const RefitContext& context, const Judged& current, const EffectAt& add,
                     const SearchProgress& progress);

/// Removes one of the effects of `current`.
TriedStep try_removing(const RefitContext& context, const Judged& current, const EffectAt& effect,
                       const SearchProgress& progress);

/// Adds the notes that the result does not have yet.
void add_notes(std::vector<std::string> notes, ExtendResult& result);

/// Makes a tried step the current model and records it.
void keep(TriedStep tried, const RefitContext& context, Judged& current, ExtendResult& result);

/// Fills the result's model and duration.
void finish(Judged current, StepClock::time_point start, ExtendResult& result);

/// Whether the error where an added effect acts, or that of another measured quantity, grew.
bool contradicted(const ExtendStep& step, const ExtendOptions& options);

/// Why an effect is contradicted or not borne out, as part of a sentence about it.
std::string against(const ExtendStep& step, const ExtendOptions& options);

}  // namespace sparflow
