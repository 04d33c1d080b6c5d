#pragma once
/// Forces that the balance of a cylinder does not know, in the forms that such forces have on machines. Each has a size that
/// is zero in the mean; an estimate that leaves them out takes them for areas and masses, and its intervals miss the truth.
/// Source: Kennedy, O'Hagan (2001), J. R. Stat. Soc. B 63(3); friction curves: Armstrong-Helouvry et al. (1994),
/// Automatica 30(7).
#include "identification/machine_from_log/load_rows.h"

namespace sparflow::from_log {

/// What the sizes refer to, of the rows from which the estimate is made.
struct ErrorScale {
  double pressure_force =
      0.0;  ///< [N] root mean square of the larger chamber's pressure times the piston's area
  double load = 0.0;   ///< [N] root mean square of the static force
  double speed = 0.0;  ///< [m/s] largest but for outliers
};

/// @param piston area [m^2]  @param load static force [N] by row
ErrorScale error_scale(const LoadRows& rows, double piston, const Eigen::VectorXd& load);

/// Number of columns that error_columns() has.
int error_count();

/// @return [rows x terms] [N], each of one standard deviation: an offset, friction that grows with the load, falls with speed,
/// grows with its square or differs between the directions, and inertia that the masses do not have
Eigen::MatrixXd error_columns(const LoadRows& rows, const Eigen::VectorXd& load,
                              const ErrorScale& scale, const MachineFromLogOptions& options);

}  // namespace sparflow::from_log
