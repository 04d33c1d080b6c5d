#pragma once
/// Rows of logs for estimates about a machine whose linkages are not known yet: what was measured, raw and smoothed.
#include <vector>

#include "identification/machine_from_log/machine_from_log.h"

namespace sparflow::from_log {

using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;

/// One cylinder; vectors are [rows], empty when no log measures it, NaN where not valid.
struct CylinderRows {
  Eigen::VectorXd stroke;                                  ///< [m] as logged
  Eigen::VectorXd stroke_value, stroke_rate, stroke_bend;  ///< smoothed [m], [m/s], [m/s^2]
  Eigen::VectorXd stroke_rate_least;                       ///< [m/s] as qd_least
  double stroke_noise = 0.0;                               ///< [m] standard deviation, raw
  Eigen::VectorXd pressure_a, pressure_b;                  ///< [Pa] smoothed
  Eigen::VectorXd force;                                   ///< [N] smoothed, a load cell's
  Eigen::VectorXd flow;                                    ///< [m^3/s] smoothed, magnitude
};

struct SketchRows {
  Eigen::VectorXd time;            ///< [s]
  Eigen::VectorXi log;             ///< index in `files`
  std::vector<std::string> files;  ///< of the logs, then of the test logs
  Eigen::MatrixXd position;        ///< [rows x joints] as logged, NaN where a log has none
  Eigen::MatrixXd q, qd, qdd;      ///< [rows x joints] smoothed
  /// Rate of the slowest sample in the window of the filter around a row; 0 where the window has both directions or does not
  /// lie within a run. A smoothed pressure mixes what is measured in its window: beside a rest it is no sliding friction.
  Eigen::MatrixXd qd_least;
  Eigen::VectorXd position_noise;  ///< [joints] standard deviation, raw
  Eigen::VectorXd rate_noise;      ///< [joints] of qd
  Eigen::VectorXd payload;         ///< [kg]; 0 where not logged
  bool payload_logged = true;      ///< in every log
  Eigen::VectorXi block;           ///< rows of one block have correlated residuals
  Mask held_out;                   ///< rows that judge
  Mask usable;                     ///< away from the ends of runs, payload known
  std::vector<CylinderRows> cylinders;
  Eigen::Index rows() const { return time.size(); }
};

/// What an estimate begins with: the sketch, its machine with what was found so far, and the rows.
struct Known {
  const MachineSketch& sketch;
  const Machine& machine;
  const SketchRows& rows;
  const std::vector<bool>& resolved;  ///< by cylinder: its linkage is known
  const MachineFromLogOptions& options;
};

SketchRows sketch_rows(const Machine& machine, const std::vector<Log>& logs,
                       const std::vector<Log>& tests, const MachineFromLogOptions& options);

/// Fills positions that no log has from the strokes of a joint's cylinder, whose linkage is known now. @return whether the
/// joint's positions are known somewhere
bool positions_from_strokes(const Machine& machine, int joint, SketchRows& rows);

}  // namespace sparflow::from_log
