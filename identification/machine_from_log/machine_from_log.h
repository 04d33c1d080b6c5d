#pragma once
/// Completes a machine file with open values from logs. Pins follow from strokes and joint positions, areas and masses from
/// the balance of pressures and static forces; docs/machine_from_log.md gives the equations and conventions.
#include <optional>
#include <string>
#include <vector>

#include "identification/log/log.h"
#include "identification/signals/smoothing.h"
#include "models/files/machine_sketch.h"

namespace sparflow {

struct MachineFromLogOptions {
  SmoothingOptions smoothing;
  /// Rows of all logs together that an estimate uses, evenly spread.
  /// @threshold [1] 500..1e6; chosen: beyond them intervals shrink no more, because neighbours tell the same
  Eigen::Index rows = 6000;
  /// Length of the blocks whose residuals count as independent of each other.
  /// @threshold [s] 0.2..60; chosen: oscillations of a boom and the smoothing window are shorter
  double block_s = 2.0;
  /// Each so many blocks form a stretch of which the last part is held out, where no test log is given.
  /// @threshold [1] 2..50; chosen: a fifth of the data judges
  int hold_out_every = 5;
  /// Blocks in a row that are held out together.
  /// @threshold [1] 1..50; chosen: five blocks are about one move of a crane
  int hold_out_blocks = 5;
  /// Speed above which a rod counts as moving, so that the direction of friction is known.
  /// @threshold [m/s] 1e-4..0.05; cited: force errors count such samples (docs/fit_and_compare.md)
  double moving = 2e-3;
  /// Share of a joint's acceleration limit above which a row is no static balance.
  /// @threshold [-] 0.01..1; chosen: inertial forces of a crane then are some percent of its load
  double steady = 0.15;
  /// Size of forces that the balance does not know (standard deviation of each form, model_error.h), as share of the pressure's
  /// or the load's force; 0: there are none.
  /// @threshold [-] 0..0.3; cited: friction beyond Coulomb's and offsets of sensors are some percent (docs/effects.md)
  double model_error = 0.05;
  /// Standard deviation of the inertia that the masses found do not have, as share of theirs.
  /// @threshold [-] 0..2; chosen: masses are found by their weight, which tells half of their inertia
  double inertia_error = 0.5;
  /// Standard deviation of the gain of a flow sensor, which no log of it shows; areas by flow are no better than that.
  /// @threshold [-] 0..0.05; chosen: meters of hydraulic flow are usually specified to some tenths of a percent of the reading, up to one percent
  double flow_gain_error = 0.005;
  /// Half width of a 95 % interval, relative to the value, beyond which a value is asked for.
  /// @threshold [-] 0.005..0.5; chosen: a bore known to a tenth gives its area to a fifth
  double largest_width = 0.1;
  /// Way of a joint, relative to its range, below which nothing is concluded from it.
  /// @threshold [-] 0.001..0.5; chosen: below it a curve cannot be told from a straight line
  double least_way = 0.03;
  /// Share of the known forces' variance that pressures must explain before an area is estimated from them.
  /// @threshold [-] 0.05..0.95; chosen: below it friction and noise would set the scale
  double least_explained = 0.3;
  /// Deviation of a combination of masses, as share of the load, above which it counts as undetermined.
  /// @threshold [-] 0.001..0.5; chosen: it then could not be told from zero where it matters
  double undetermined = 0.1;
  /// Residual on held-out motions, as share of the force's own variation, that is warned of.
  /// @threshold [-] 0.01..1; chosen: a static model with friction explains working cranes to about a tenth
  double warn_residual = 0.15;
  /// Open values of a four-bar beyond which it is asked for instead of searched.
  /// @threshold [1] 1..9; derived: nine numbers describe it, and one smooth curve tells about five apart
  int four_bar_values = 4;
};

/// One mass, or mass times a coordinate of its centre, in a combination of masses.
struct MassTerm {
  int link = -1;
  int axis =
      -1;  ///< -1: the mass itself [kg]; 0, 1, 2: mass times that coordinate [kg m], link's frame
  double factor = 0.0;
};

/// A number that the logs gave.
struct FoundValue {
  std::string name;  ///< "cylinders[boom].bore", "boom: distance of the rod pin from the joint"
  double value = 0.0;
  double half_width = 0.0;  ///< of the 95 % interval
  std::string unit;
  std::string source;                ///< "boom's strokes and joint positions, 2400 rows"
  std::string remark;                ///< "nearest bore of ISO 3320: 0.16 m"; may be empty
  std::vector<MassTerm> terms = {};  ///< of a combination of masses
  int cylinder = -1;                 ///< whose value it is; -1: not a cylinder's
  int link = -1;                     ///< whose value it is; -1: not a link's
};

/// A value that the logs do not determine.
struct MachineQuestion {
  std::string path;      ///< "cylinders[jib].bore"
  std::string sentence;  ///< why it is not determined and what would answer it
};

/// Forces of one cylinder in the rows of one log that took no part in the estimate.
struct HeldOutForces {
  std::string log;            ///< its file
  Eigen::VectorXd time;       ///< [s] ascending
  Eigen::VectorXd measured;   ///< [N] of pressures and areas, or of a load cell
  Eigen::VectorXd predicted;  ///< [N] static force, inertia and friction
  Eigen::Index rows() const { return time.size(); }
};

/// How the machine does on motions that took no part in the estimate.
struct HeldOutError {
  std::string cylinder;
  double force_rmse =
      0.0;  ///< [N] measured minus static force, inertia and friction; NaN: no forces
  double force_static = 0.0;     ///< [N] measured minus static force alone
  double force_variation = 0.0;  ///< [N] standard deviation of the measured force
  Eigen::Index force_rows = 0;
  double stroke_rmse = 0.0;  ///< [m]; NaN: stroke or joint position is not measured
  Eigen::Index stroke_rows = 0;
  std::vector<HeldOutForces>
      forces;  ///< rows of force_rmse, by log; logs without rows are left out
};

struct MachineFromLog {
  std::string name;                      ///< of the machine
  std::vector<FoundValue> values;        ///< that stand in the file
  std::vector<FoundValue> combinations;  ///< of masses, that the logs determine
  std::vector<FoundValue> friction;      ///< found beside them; an effect, no part of the file
  std::vector<MachineQuestion> questions;
  std::vector<HeldOutError> held_out;
  std::vector<std::string> notes;     ///< whole sentences: rules and conventions that were used
  std::vector<std::string> warnings;  ///< whole sentences: what the machine does not explain
  std::string text;  ///< machine file; open values that are asked for still stand in it
  std::optional<Machine> machine;  ///< absent while something is asked for
  bool complete() const { return machine.has_value(); }
};

/// @param logs to estimate from, read for `sketch.machine`  @param tests to judge by; empty: parts of the logs are held out
/// @throws InputError when the logs have no sample to use
MachineFromLog machine_from_logs(const MachineSketch& sketch, const std::vector<Log>& logs,
                                 const std::vector<Log>& tests,
                                 const MachineFromLogOptions& options = {});

/// One screen: values with intervals, questions, errors on held-out motions.
std::string machine_from_log_table(const MachineFromLog& found);
std::string machine_from_log_json(const MachineFromLog& found);
/// One sentence.
std::string machine_from_log_headline(const MachineFromLog& found);

}  // namespace sparflow
