#pragma once
/// Rounds of `improve` on one model: effects estimated together, backward elimination, merging. Used by improve.cpp only.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/extension/extension_step.h"
#include "diagnosis/extension/improve_round.h"

namespace sparflow {

/// @return whether the list has the effect at that place
bool contains(const std::vector<EffectAt>& list, const EffectAt& e);

/// Repeated rounds of diagnosis, joint estimate and backward elimination.
class Improvement {
 public:
  Improvement(const RefitContext& context, ExtendResult& result, Judged& current)
      : context_(context), result_(result), current_(current) {}

  /// Estimates the effects of a round together with those of the model and removes what the data do not bear out. The round
  /// gets what was removed; of one that an earlier run has made, that is removed and nothing else is tested.
  /// @param diagnosis that named them; null in a round of an earlier run
  /// @return whether anything was kept
  bool add(ImproveRound& round, const std::shared_ptr<const Diagnosis>& diagnosis,
           const SearchProgress& progress);

  /// Tests the effects of former rounds again beside those that came after them, and removes what has become useless.
  void test_again(const SearchProgress& progress);

  /// Exchanges effects on forces for others that the catalogue says are confused with them, as long as that lowers the error on
  /// motions left out beyond chance, or puts an effect that the catalogue has first in the place of a later one without raising
  /// it: which of two was found first depends on what was in the model by then.
  void exchange(const SearchProgress& progress);

  /// Adds effects on pressures that no diagnosis named, because learned laws imitate them or few motions show them, by
  /// the measure by which effects that a diagnosis named stay: they lower the error of the pressures on motions left out.
  void add_to_pressures(const SearchProgress& progress);

  /// Effects that the next diagnosis must not name.
  const std::vector<EffectAt>& excluded() const { return aside_; }
  std::size_t rejected() const { return rejected_; }
  std::size_t added() const { return added_.size(); }

 private:
  /// A set of effects, and what was removed from it.
  struct Trial {
    std::vector<EffectAt> effects;
    std::vector<ExtendStep> failures;
    std::shared_ptr<const Diagnosis> diagnosis;
  };

  /// A set of effects estimated together, with the errors by which each of them is judged.
  struct Joint {
    CraneModel model;  ///< what is learned in it is that of the current model
    std::vector<EffectAt> all;
    CrossValidated measured;
    std::optional<CompareResult> on_tests;  ///< forces and flows
  };
  /// An effect taken out of a joint set, and whether the data bear it out.
  struct Tested {
    ExtendStep step;
    bool stays = false;
  };

  /// An effect of a joint set in place of which another one predicts better.
  struct Exchange {
    EffectAt out, in;
    double own = 1.0;         ///< [-] error of the forces after over before
    double deviations = 0.0;  ///< [-] fall of the logarithm of all errors over its standard error
  };
  /// Whether a fall of an error by so many deviations is more than the largest of several by chance (Bonferroni's bound).
  bool beyond_chance(double deviations, std::size_t tried) const;
  /// Effects on pressures that are neither in the model nor were taken out of it.
  std::vector<EffectAt> not_tested_on_pressures() const;
  /// What an effect on pressures that is added to a joint set changes; nothing where these logs do not show it.
  PressureChange change_with(const Joint& joint, const EffectAt& e,
                             const SearchProgress& progress) const;
  /// Whether the logs determine an effect, with values inside their bounds and plausible on this machine.
  bool is_sound(const AppliedEffect& e) const;

  /// Errors of forces and flows after an exchange; absent where the effect acts nowhere in these logs.
  std::optional<CompareResult> errors_after(const Joint& joint, const Exchange& change,
                                            const SearchProgress& progress) const;
  /// Exchanges of effects on forces, with their errors.
  std::vector<Exchange> possible_exchanges(const Joint& joint,
                                           const SearchProgress& progress) const;
  /// The exchange that lowers the error most among those that lower it beyond chance or put a usual cause in the place of an
  /// unusual one without raising it.
  std::optional<Exchange> best_exchange(const Joint& joint, const SearchProgress& progress) const;

  std::vector<EffectAt> places(const std::vector<std::string>& keys) const;

  /// Backward elimination: removes from the set the one of `tested` that the data bear out least, until they bear out all.
  /// @return those of `tested` that stay
  std::vector<EffectAt> eliminate(Trial& trial, std::vector<EffectAt> tested,
                                  const SearchProgress& progress) const;

  /// Removes these effects from the set, as an elimination did before. @return those of `tested` that stay
  std::vector<EffectAt> remove(Trial& trial, std::vector<EffectAt> tested,
                               const std::vector<EffectAt>& removed,
                               const SearchProgress& progress) const;

  static void fail(ExtendStep step, Trial& trial, std::vector<EffectAt>& tested);

  Joint joint(const Trial& trial, const SearchProgress& progress) const;

  /// The step that takes one effect out of a joint set. The errors are those of a cross-validation, of effects on pressures
  /// those beside laws that are linear in their coefficients.
  Tested without_one(const Joint& joint, const EffectAt& e, const SearchProgress& progress) const;

  /// Of the tested effects the one that the data bear out least, if they do not bear out all.
  std::optional<ExtendStep> weakest_of(const Joint& joint, const std::vector<EffectAt>& tested,
                                       const SearchProgress& progress) const;

  const RefitContext& context_;
  ExtendResult& result_;
  Judged& current_;
  std::vector<EffectAt> added_;  ///< by this call, and still there
  std::vector<EffectAt> aside_;  ///< not kept since the last round that kept one
  std::size_t rejected_ = 0;
  int rounds_ = 0;
};

}  // namespace sparflow
