#pragma once
/// One channel of evidence from stretches of logs. Used by evidence.cpp only.
#include <vector>

#include "diagnosis/evidence/evidence.h"

namespace sparflow {

/// [m^3/s], [N] units of a supply channel's baseline, in which its columns are near one.
inline constexpr double kBaselineFlow = 1e-3, kBaselineForce = 1e5;
inline constexpr Eigen::Index kFewestRows = 30;  ///< of a channel

/// Cuts the true stretches of a mask, shortened by `margin` samples at both ends, into blocks.
class ChannelBuilder {
 public:
  /// @param evidence with series and stride; must outlive this
  explicit ChannelBuilder(const Evidence& evidence) : evidence_(evidence) {}

  EvidenceChannel channel;  ///< kind, place, unit, noise: the caller's

  /// @param values of one log [samples]  @param base columns of learned laws [samples x columns]
  void add(std::size_t log, const Eigen::Array<bool, Eigen::Dynamic, 1>& mask,
           const Eigen::VectorXd& values, const Eigen::MatrixXd& base, Eigen::Index margin);
  /// Appends the channel. @return false: too little to judge by, and nothing is appended
  bool finish(std::vector<EvidenceChannel>& out);

 private:
  void block(std::size_t log, Eigen::Index first, Eigen::Index last, const Eigen::VectorXd& values,
             const Eigen::MatrixXd& base, Eigen::Index stride);
  void close(std::size_t log, const NoiseBlock& b);

  const Evidence& evidence_;
  std::vector<double> y_;
  std::vector<Eigen::VectorXd> rows_;  // baseline
};

/// Slope of a supply channel's baseline in the measured force: columns are 1, Q, Q^2, F, Q F in the units above. Where
/// an anti-cavitation valve ends the law, that end joins the baseline first.
void set_force_slope(EvidenceChannel& channel, std::size_t suspects);

}  // namespace sparflow
