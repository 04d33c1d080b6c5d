#pragma once
/// Modes read off a smooth motion: which cylinder moves, in which direction, in which interval.
#include "models/machine/trajectory.h"
#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/transcription/transcription.h"

namespace sparflow {

struct ModeOptions {
  /// A cylinder slower than this share of its full speed is creeping under the smoothed activation and is
  /// put to rest: no proportional spool meters less than a few percent of its flow.
  double rest_share = 0.02;
  double lost_share = 0.05;  ///< share of a cylinder's way that putting creep to rest may give up
  int shortest_move =
      3;  ///< [intervals] shorter moves are dropped: they cannot leave and regain rest usefully
};

/// @return [intervals x cylinders] of kRest, kExtend and kRetract
ModeTable modes_of(const CraneModel& model, const MotionProblem& problem, const Trajectory& motion,
                   const ModeOptions& options = {});

/// Bounds that make the modes true: velocity zero through rest, one sign through a move.
void apply_modes(const CraneModel& model, const ModeTable& modes, TranscriptionBounds& bounds);

}  // namespace sparflow
