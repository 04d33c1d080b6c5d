#pragma once
/// Modes derived from a smooth motion: which cylinder moves in which direction in which interval.
#include "models/machine/trajectory.h"
#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/transcription/transcription.h"

namespace sparflow {

struct ModeOptions {
  /// A cylinder slower than this share of its full speed creeps under the smoothed activation and is set to rest: no
  /// proportional spool meters less than a few percent of its flow.
  /// @threshold [1] 0..0.2; chosen: valves meter from a few per cent on
  double rest_share = 0.02;
  /// Share of a cylinder's stroke that may be lost by setting it to rest.
  /// @threshold [1] 0..0.5; chosen: a cylinder that moves by more must be allowed to move
  double lost_share = 0.05;
  /// Shorter moves are dropped.
  /// @threshold [intervals] 1..20; derived: one interval to start in, one to stop in and one between them
  int shortest_move = 3;
};

/// @return [intervals x cylinders] of kRest, kExtend and kRetract
ModeTable modes_of(const CraneModel& model, const MotionProblem& problem, const Trajectory& motion,
                   const ModeOptions& options = {});

/// Sets the velocity bounds that the modes imply: zero during rest, one sign during a move.
void apply_modes(const CraneModel& model, const ModeTable& modes, TranscriptionBounds& bounds);

}  // namespace sparflow
