#pragma once
/// Builds one evidence channel from stretches of logs. Used by evidence_collector.cpp only.
#include <vector>

#include "diagnosis/evidence/evidence.h"

namespace sparflow {

/// [m^3/s], [N] scales of flow and force in a baseline, so that its columns are of order one.
inline constexpr double kBaselineFlow = 1e-3, kBaselineForce = 1e5;

/// Cuts the stretches in which a mask is true, shortened by `margin` samples at both ends, into blocks.
class ChannelBuilder {
 public:
  /// @param evidence with series, stride and options; must outlive this
  explicit ChannelBuilder(const Evidence& evidence)
      : since_change(evidence.since_change), evidence_(evidence) {}

  EvidenceChannel channel;  ///< the caller sets kind, place, unit and noise floor
  /// [logs][samples, s] time for which the machine has been settling; no logs: not used
  std::vector<Eigen::VectorXd> since_change;

  /// @param values residual in one log [samples, SI]  @param base baseline columns [samples x columns]
  void add(std::size_t log, const Eigen::Array<bool, Eigen::Dynamic, 1>& mask,
           const Eigen::VectorXd& values, const Eigen::MatrixXd& base, Eigen::Index margin);
  /// Baseline of the rows so far. [rows x columns]
  Eigen::MatrixXd baseline() const;
  /// Appends the channel. @return false when there are too few rows or blocks; nothing is appended then
  bool finish(std::vector<EvidenceChannel>& out);

 private:
  void block(std::size_t log, Eigen::Index first, Eigen::Index last, const Eigen::VectorXd& values,
             const Eigen::MatrixXd& base);
  void close(std::size_t log, const NoiseBlock& b);

  const Evidence& evidence_;
  std::vector<double> y_;
  std::vector<double> since_;          // [s] by row, of since_change
  std::vector<Eigen::VectorXd> rows_;  // baseline
};

/// Sets the derivatives of a chamber's baseline by the flow and, in a supply channel, by the measured force; its columns are 1, Q, Q^2
/// and, there, F, Q F in the scales above. Where an anti-cavitation valve limits a supply pressure from below, a column for that limit is
/// added first.
void set_slopes(EvidenceChannel& channel, std::size_t suspects, const EvidenceOptions& options);

}  // namespace sparflow
