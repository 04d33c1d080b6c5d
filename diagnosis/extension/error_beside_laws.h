#pragma once
/// Errors of pressures that are left beside the learned laws, with and without an effect: how an effect on pressures is judged.
/// The laws of the evidence are linear in their coefficients and are fitted to the very motions on which the errors are
/// counted, with the effect as without it. A law that is learned anew as a Gaussian process moves these errors more than most
/// effects do.
#include <map>
#include <utility>
#include <vector>

#include "diagnosis/evidence/evidence.h"

namespace sparflow {

/// Change of an error: what is after it over what was before.
struct PressureChange {
  double ratio = 1.0;       ///< [-] RMS error after over before; 1 where nothing moves
  double deviations = 0.0;  ///< [-] fall of its logarithm over the standard error between motions
};

/// Sums over the channels of an evidence, of the rows that are in both models' evidence.
struct PressureErrors {
  struct Sums {
    double before = 0.0, after = 0.0;  ///< [Pa^2] squared errors without and with the effect
    double moved = 0.0;                ///< [Pa^2] by which both models differ
    double rows = 0.0;
    void add(const Sums& other);
  };
  /// Log and number of its piece of some seconds, within which errors are correlated.
  using Piece = std::pair<int, int>;
  struct Channel {
    EvidenceKind kind;
    int index;
    std::map<Piece, Sums> pieces;
    Sums all() const;
  };
  std::vector<Channel> channels;

  void add(const PressureErrors& other);
  /// Mean of the logarithms over the rows of all channels in which the models differ by at least this share of the error.
  PressureChange change(double least_share) const;
};

/// Channels of pressures, pumps and the return line that both evidences have.
/// @param before, after collected from the same logs with models that differ in their effects
/// @param piece_s length of the pieces [s]
PressureErrors errors_beside_laws(const Evidence& before, const Evidence& after, double piece_s);

}  // namespace sparflow
