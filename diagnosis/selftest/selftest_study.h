#pragma once
/// Power and confusion of every candidate on the user's own motions. Used by selftest.cpp only.
#include <optional>
#include <utility>
#include <vector>

#include "diagnosis/experiment/effect_power.h"
#include "diagnosis/regression/null_distribution.h"
#include "diagnosis/selftest/selftest.h"
#include "diagnosis/selftest/selftest_size.h"

namespace sparflow {

/// Whether effects of a stage are tested for their absorbed share: pressure models and margins are learned there.
bool behind_learned_law(EffectStage stage);

/// What the logs say before an effect is injected.
struct SelftestEvidence {
  Evidence evidence;
  std::optional<Evidence> alone;  ///< the same without references; absent when there are none
  EffectFit fit;                  ///< without effects, with the channels' noise models
};

class SelftestStudy {
 public:
  /// @param null distribution of the largest gain of these candidates, in their order
  /// All references must outlive this.
  SelftestStudy(const Machine& machine, const SelftestEvidence& logs,
                std::vector<SearchCandidate> candidates, NullDistribution null,
                const SelftestOptions& options);

  std::vector<InjectedEffect> run();
  const EffectSize& size(std::size_t i) const { return sizes_[i]; }
  const SearchCandidate& candidate(std::size_t i) const { return candidates_[i]; }

 private:
  Signature typical_signature(std::size_t i) const;
  /// [nats] threshold of the gain without penalty, scaled for this candidate.
  double least_gain_of(std::size_t i) const;
  double chance(std::size_t i, double gain) const;
  std::pair<double, std::vector<double>> times_for(std::size_t i, const Signature& typical,
                                                   double gain) const;
  double absorbed_alone(const SearchCandidate& c, const EffectSize& s) const;
  /// Why an effect that acts in the logs is named at no plausible size.
  std::string never_reason(std::size_t i) const;
  void see(std::size_t i);
  void confuse(std::size_t i);

  const Machine& machine_;
  const Evidence& evidence_;
  const std::optional<Evidence>& alone_;
  const EffectFit& fit_;
  const SelftestOptions& options_;
  const SearchOptions& search_;
  NullDistribution null_;
  double threshold_;
  PowerStudy power_;
  std::vector<SearchCandidate> candidates_;
  std::vector<EffectSize> sizes_;
  std::vector<std::vector<ProjectedDesign>> projected_;
  std::vector<InjectedEffect> result_;
};

}  // namespace sparflow
