#pragma once
/// Areas, masses and friction from the balance of pressures and static forces of all cylinders at once.
///
/// In each moving, nearly static row of a cylinder
///   A_A p_A - (A_A - A_D) p_B = F_known(q, payload) + Phi(q) pi + F_c sign(v) + c v + m a
/// with the areas A_A of the bore and A_D of the rod's section, masses and first moments pi, and friction F_c and c; m a takes
/// what acceleration is left. The residual is written as error of p_A, so that noise and unmodelled forces are in the
/// dependent variable and bias no area; the balance is homogeneous, and its scale comes from what is known: a payload that
/// changes, a mass, an area, or a measured flow. Forces of forms that the balance does not know (model_error.h) are estimated
/// beside it with a prior size, so that areas and masses do not take them up and their intervals know of them.
#include <vector>

#include "identification/machine_from_log/load_rows.h"
#include "identification/machine_from_log/model_error.h"

namespace sparflow::from_log {

/// What is known or found about one cylinder's areas.
struct AreaState {
  bool bore_open = false, rod_open = false;
  double piston = 0.0;    ///< [m^2] all parallel cylinders
  double rod = 0.0;       ///< [m^2] the rods' section
  bool has_scale = true;  ///< false: nothing known sets its scale; its rows take no part
  double piston_half = 0.0, rod_half = 0.0;         ///< [m^2] half widths of 95 % intervals
  double flow_piston = 0.0, flow_piston_std = 0.0;  ///< [m^2] by flow while extending; std 0: none
  double flow_annulus = 0.0, flow_annulus_std = 0.0;  ///< [m^2] while retracting
  std::string source;
};

struct FrictionState {
  double coulomb = 0.0, coulomb_half = 0.0;  ///< [N]
  double viscous = 0.0;                      ///< [N s/m]
  double inertia = 0.0;                      ///< [kg] left by acceleration
  ErrorScale scale;
  Eigen::VectorXd errors;  ///< by column of error_columns(), in standard deviations; empty: none
};

struct LoadFit {
  std::vector<AreaState> areas;         ///< by cylinder
  std::vector<FrictionState> friction;  ///< by cylinder
  std::vector<bool> used;               ///< by cylinder: its rows took part
  Eigen::VectorXd masses;               ///< by unknown, one of the solutions
  Eigen::MatrixXd
      free;  ///< [unknowns x directions] that change no force of these rows beside all else
  /// [unknowns x directions] those of `free` that have a force, which an offset, friction or an area takes up.
  Eigen::MatrixXd confounded;
  /// Of the masses: squares of half widths, as Intervals::squared.
  std::vector<Eigen::MatrixXd> squared_half;
  double half_of(const Eigen::VectorXd& weights) const;  ///< of a sum of masses
};

/// Friction and forces of unknown forms in rows of a cylinder. [N] @param load static force
Eigen::VectorXd force_beside_load(const LoadRows& rows, const Eigen::VectorXd& load,
                                  const FrictionState& friction,
                                  const MachineFromLogOptions& options);

/// @param loads rows by cylinder, empty where there are none
LoadFit fit_loads(const Known& known, const std::vector<LoadRows>& loads);

}  // namespace sparflow::from_log
