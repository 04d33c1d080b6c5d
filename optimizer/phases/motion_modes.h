#pragma once
/// Modes derived from a smooth motion: which cylinder moves in which direction in which interval.
#include "models/machine/trajectory.h"
#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/transcription/transcription.h"

namespace sparflow {

struct ModeOptions {
  /// A cylinder slower than this share of its full speed creeps under the smoothed activation and is set to rest: no
  /// proportional spool meters less than a few percent of its flow.
  double rest_share = 0.02;
  double lost_share =
      0.05;  ///< share of a cylinder's stroke that may be lost by setting it to rest
  int shortest_move =
      3;  ///< [intervals] shorter moves are dropped: they are too short to start and stop in
};

/// @return [intervals x cylinders] of kRest, kExtend and kRetract
ModeTable modes_of(const CraneModel& model, const MotionProblem& problem, const Trajectory& motion,
                   const ModeOptions& options = {});

/// Sets the velocity bounds that the modes imply: zero during rest, one sign during a move.
void apply_modes(const CraneModel& model, const ModeTable& modes, TranscriptionBounds& bounds);

}  // namespace sparflow
