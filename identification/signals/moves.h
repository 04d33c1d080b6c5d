#pragma once
/// Cuts a recorded log into moves: work between two rests, which can be compared with another motion from the same start to
/// the same end.
#include <vector>

#include "identification/signals/signals.h"
#include "models/hydraulics/engine_map.h"

namespace sparflow {

struct MoveOptions {
  /// Shortest rest of all cylinders that ends a move.
  /// @threshold [s] 0.1..60; chosen: levers are exchanged in less, and what follows within it belongs to the same work
  double pause_s = 1.0;
  /// A longer move is cut at its longest rest, while it has one.
  /// @threshold [s] 1..3600; chosen: a crane's move from pick to place takes less
  double longest_s = 45.0;
  /// Way of all rods together below which a move is a correction and left out.
  /// @threshold [m] 0..1; chosen: below it sensors and settling are a large part of the energy
  double least_way = 0.1;
};

/// One move, from the last sample at rest before it to the first at rest after it.
struct RecordedMove {
  SampleRange samples;
  bool from_rest = true, to_rest = true;  ///< false where a gap or an end of the log cuts it
  double way = 0.0;                       ///< [m] of all rods together
  double gain = 0.0;  ///< [m] sum of the rods' distances between their first and their last place
};

/// The moves of a log in order of time.
std::vector<RecordedMove> recorded_moves(const MachineSignals& signals,
                                         const MoveOptions& options = {});

/// Energy that the pumps delivered by their logged pressure and the flows of the measured speeds, by pump [J]; not a number
/// for a pump whose pressure the log lacks.
std::vector<double> measured_energy(const Machine& machine, const MachineSignals& signals,
                                    const SampleRange& range);

/// The pumps' logged pressures and the flows of the measured speeds; pressures are not numbers for a pump that the log lacks.
PumpTrace measured_pumps(const Machine& machine, const MachineSignals& signals,
                         const SampleRange& range);

/// Time in which no cylinder moves, of the gap-free stretches of a log [s].
double time_at_rest(const MachineSignals& signals);

}  // namespace sparflow
