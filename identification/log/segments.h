#pragma once
/// Splits a log into segments of motion and of rest. Neighbouring samples are correlated, so data that judges a model is
/// held out by whole segments.
#include <Eigen/Dense>
#include <vector>

#include "identification/log/log.h"

namespace sparflow {

struct SegmentOptions {
  double speed =
      2e-3;  ///< [m/s] |dx/dt| above which a cylinder moves; position noise gives 1-2 mm/s
  double command = 1e-6;    ///< [-] |u| above which it is commanded
  double pause_s = 0.2;     ///< [s] a shorter rest (a reversal) does not end a motion
  double shortest_s = 0.1;  ///< [s] a shorter motion counts as rest
};

/// The direction of motion of each cylinder at each sample; the program's only definition of a "moving sample". A
/// cylinder moves when it is faster than `speed` and, where its command is logged, the command is not zero.
/// @param velocity [samples x cylinders] dx/dt [m/s], NaN = unknown
/// @param command [samples x cylinders] -1..1, or no columns; a column all NaN = not logged
/// @return [samples x cylinders] +1 extends, -1 retracts, 0 at rest or with unknown speed or command
Eigen::MatrixXi motion_directions(const Eigen::MatrixXd& velocity, const Eigen::MatrixXd& command,
                                  const SegmentOptions& options = {});

/// Shares of a segment's samples in which a cylinder moves.
struct CylinderMotion {
  double extends = 0.0;   ///< 0..1
  double retracts = 0.0;  ///< 0..1
  bool moves() const { return extends > 0.0 || retracts > 0.0; }
};

struct Segment {
  SampleRange samples;
  int run = 0;          ///< index into the log's runs; a segment never leaves its run
  bool moving = false;  ///< at least one cylinder moves (short pauses included)
  std::vector<CylinderMotion> cylinders;  ///< in the machine's order
};

/// @param time [s]  @param velocity, command as above
/// @return segments in order of time; they cover every sample once, and motion and rest alternate within a run
std::vector<Segment> find_segments(const Eigen::VectorXd& time, const Eigen::MatrixXd& velocity,
                                   const Eigen::MatrixXd& command,
                                   const std::vector<SampleRange>& runs,
                                   const SegmentOptions& options = {});

}  // namespace sparflow
