#pragma once
/// Errors of pressures that are left beside the learned laws, with and without an effect: how an effect on pressures is judged.
/// The laws of the evidence are linear in their coefficients and are fitted to the very motions on which the errors are
/// counted, with the effect as without it. A law that is learned anew as a Gaussian process moves these errors more than most
/// effects do.
#include <vector>

#include "diagnosis/evidence/evidence.h"

namespace sparflow {

/// Sums over the channels of an evidence, of the rows that are in both models' evidence.
struct PressureErrors {
  struct Channel {
    EvidenceKind kind;
    int index;
    double before = 0.0, after = 0.0;  ///< [Pa^2] squared errors without and with the effect
    double moved = 0.0;                ///< [Pa^2] by which both models differ
    double rows = 0.0;
  };
  std::vector<Channel> channels;

  void add(const PressureErrors& other);
  /// Error after over before, RMS, as a mean of logarithms over the rows of all channels in which the models differ by at
  /// least this share of the error; 1 where they do so nowhere. [-]
  double change(double least_share) const;
};

/// Channels of pressures, pumps and the return line that both evidences have.
/// @param before, after collected from the same logs with models that differ in their effects
PressureErrors errors_beside_laws(const Evidence& before, const Evidence& after);

}  // namespace sparflow
