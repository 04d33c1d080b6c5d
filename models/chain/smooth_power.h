#pragma once
/// Smooth version of the exact pump law (models/chain/crane_model.h), for gradient-based optimisation: power of
/// all pumps as a function of cylinder speeds and static forces, with exact first and second derivatives.
///
/// For each cylinder, with t = tanh(v/eps), w = (1+t)/2:  |v| -> m = v t,  Q = (w A + (1-w) B) m,
///   demand d = t^2 [w p+(A m, F) + (1-w) p-(B m, F) + c].
/// For each pump the smooth law of models/chain/pump_law.h. Energies under this law serve the solver only and are never reported.
#include <vector>

#include "models/chain/crane_model.h"

namespace sparflow {

/// What a cylinder does during a phase. Only kFree needs blending: kExtend and kRetract are exact for v of their sign,
/// and kRest takes no flow and has no demand.
enum class CylinderMode : unsigned char { kFree, kRest, kExtend, kRetract };

/// Below this share the pressure of a direction changes the demand by less than 1e-11 bar for pressures up to 1000 bar,
/// far below any tolerance of the solver, so its pressure model is not evaluated.
/// @threshold [1] 0..1e-10; derived: 1e-14 of 1000 bar is 1e-11 bar
inline constexpr double kNegligibleShare = 1e-14;

struct Smoothing {
  double speed = 2e-3;    ///< eps [m/s]
  double pressure = 1e5;  ///< beta [Pa]; 0: the exact maximum of the demands
};

/// Each thread needs its own object; nothing is allocated after construction. Order of the variables everywhere:
/// (v_0 .. v_{m-1}, F_0 .. F_{m-1}) over the machine's m cylinders.
class SmoothPower {
 public:
  explicit SmoothPower(const CraneModel& model);

  Smoothing smoothing;

  /// Power of all pumps. [W]
  double value(const double* speed, const double* force, const CylinderMode* mode);
  /// Power with gradient() and hessian() filled. [W]
  double derivatives(const double* speed, const double* force, const CylinderMode* mode);

  const Eigen::VectorXd& gradient() const { return gradient_; }  ///< [W s/m | W/N], 2 m
  const Eigen::MatrixXd& hessian() const { return hessian_; }    ///< symmetric, 2 m x 2 m

  /// Flow of one cylinder with d/dv and d2/dv2; cheap, since no pressure model is evaluated. [m^3/s, ...]
  struct Flow {
    double q = 0.0, d1 = 0.0, d2 = 0.0;
  };
  Flow flow(int cylinder, double speed, CylinderMode mode) const;

  /// Pressure of pump `p` [Pa] after the last call, with (after derivatives()) its gradient and Hessian.
  double pump_pressure(int p) const { return pumps_[static_cast<std::size_t>(p)].pressure; }
  /// Adds `factor` times the pump pressure's gradient or Hessian, same variable order.
  void add_pressure_gradient(int p, double factor, double* gradient) const;
  void add_pressure_hessian(int p, double factor, Eigen::MatrixXd& hessian) const;

 private:
  struct Demand {  // value and derivatives in (v, F) of one cylinder; inactive ones do not count
    bool active = false;
    double d = 0.0, v = 0.0, f = 0.0, vv = 0.0, vf = 0.0, ff = 0.0;
    double share = 0.0;  // soft-max weight within its pump
    Flow flow;
  };
  struct PumpSum {
    double pressure = 0.0, flow = 0.0;
  };
  void demand(int cylinder, double speed, double force, CylinderMode mode, bool derivatives);
  void pump_sums();

  const CraneModel* model_;
  std::vector<Demand> demands_;
  std::vector<PumpSum> pumps_;
  std::vector<int> pump_of_;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd hessian_;
};

}  // namespace sparflow
