#pragma once
/// Baseline methods of the blind test: three simple ways to find a missing effect, judged on the same logs as
/// `diagnose`. They use the same channels, learned laws and catalogue, but unfiltered rows with independent noise.
#include <string>
#include <vector>

#include "diagnosis/evidence/evidence.h"
#include "identification/log/log.h"

namespace sparflow::bench {

/// Effects that a baseline method names, most likely first; none = nothing is missing. It cannot answer "unknown".
struct SimpleAnswer {
  std::vector<EffectAt> found;
  std::vector<std::vector<double>> values;  ///< [SI] by effect, in the order of its parameters
};

/// Evidence channels without filter, with every sample of the same stretches.
class RawEvidence {
 public:
  /// @param model without effects
  RawEvidence(const CraneModel& model, const std::vector<Log>& suspects,
              const std::vector<Log>& references);
  RawEvidence(const RawEvidence&) = delete;  // Its series point to its machine.
  RawEvidence& operator=(const RawEvidence&) = delete;

  /// Forward selection by least squares with independent noise and one variance for each channel: adds the candidate
  /// with the lowest Bayesian information criterion until it decreases no more or there are `most` effects.
  /// Source: G. Schwarz (1978), Annals of Statistics 6(2), 461-464.
  SimpleAnswer iid_bic(int most = 5) const;

  /// Names the candidate whose signature (at typical values) has the largest correlation with a channel's residual, or
  /// nothing when that is not significant at 5 % over all pairs (Bonferroni) with independent rows.
  SimpleAnswer strongest_correlation() const;

 private:
  struct Channel {
    EvidenceKind kind = EvidenceKind::kForce;
    int index = 0;
    std::vector<std::pair<std::size_t, Eigen::Index>> sample;  ///< log and row in it
    Eigen::VectorXd y;                                         ///< SI
    Eigen::MatrixXd baseline;
  };
  struct Design;
  class IidFit;

  double measured(std::size_t log, EvidenceKind kind, int index, Eigen::Index row) const;
  Eigen::VectorXd baseline_row(std::size_t log, EvidenceKind kind, int index,
                               Eigen::Index row) const;
  Eigen::MatrixXd columns(const EffectAt& effect, const std::vector<double>& shape,
                          const Channel& channel) const;
  std::vector<std::vector<double>> shapes(const EffectAt& effect) const;

  Machine machine_;
  std::vector<MachineSignals> signals_;  ///< suspects, then references
  Evidence evidence_;
  std::vector<Channel> channels_;
};

/// Effect of fitting the model again instead of diagnosing: by stage, the share of the additional error (beyond that on
/// the references) that a fit on the suspect logs removes, judged on motions left out of that fit. Stages in which the
/// effect adds less than a tenth to the error are left out.
struct AbsorbedError {
  std::string stage;   ///< force, flow, pressure, pump
  double share = 0.0;  ///< [-]
};
/// Computes these shares. @param model learned from the references
std::vector<AbsorbedError> absorbed_by_refit(const CraneModel& model,
                                             const std::vector<Log>& references,
                                             const std::vector<Log>& suspects);

}  // namespace sparflow::bench
