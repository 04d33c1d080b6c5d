#pragma once
/// What one would try before a diagnosis of its own: three simple ways to find a missing effect, judged on the same
/// logs as `diagnose` (bench/blind_test). They get the same channels, baselines and catalogue; they take rows as they
/// are, without the common filter, and their noise as independent.
#include <string>
#include <vector>

#include "diagnosis/evidence/evidence.h"
#include "identification/log/log.h"

namespace sparflow::bench {

/// Effects a simple way names, most likely first; none = nothing is missing. No way here can say "unknown".
struct SimpleAnswer {
  std::vector<EffectAt> found;
  std::vector<std::vector<double>> values;  ///< [SI] by effect, in the order of its parameters
};

/// Evidence channels without filter: every sample of the same stretches.
class RawEvidence {
 public:
  /// @param model without effects
  RawEvidence(const CraneModel& model, const std::vector<Log>& suspects,
              const std::vector<Log>& references);
  RawEvidence(const RawEvidence&) = delete;  // its series point at its machine
  RawEvidence& operator=(const RawEvidence&) = delete;

  /// Least squares with independent noise, one variance a channel: the candidate with the lowest Bayesian information
  /// criterion, again and again until it falls no more or there are `most` effects.
  /// Source: G. Schwarz (1978), Annals of Statistics 6(2), 461-464.
  SimpleAnswer iid_bic(int most = 5) const;

  /// The candidate whose signal (its columns at typical values) correlates most with a channel's residual; nothing
  /// when that is not significant at 5 % over all pairs tried (Bonferroni), rows taken as independent.
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

/// What learning again does instead of finding a cause: by stage, the share of the error beyond the reference's own
/// that is gone once everything is fitted again on the suspect logs, judged on motions left out of that fit. Stages in
/// which the effect adds less than a tenth to the error are left out.
struct Swallowed {
  std::string stage;  ///< force, flow, pressure, pump
  double share = 0.0;
};
/// @param model learned from the references
std::vector<Swallowed> swallowed_by_refit(const CraneModel& model,
                                          const std::vector<Log>& references,
                                          const std::vector<Log>& suspects);

}  // namespace sparflow::bench
