#pragma once
/// Effect of a higher pressure in the return chamber on the supply pressure, from the cylinder's own pressure model.
///
/// The supply pressure is the larger of the static branch S = (load + A_return p_return)/A_supply and what a
/// counterbalance or anti-cavitation valve requires. A return pressure higher by r acts on the static branch like a load
/// larger by A_return r, and on the valves not at all. The pressure model H(Q, F), learned without the rise, shows which
/// branch is active: the supply takes up all of a larger load on the static branch, and the share
/// A_supply/A_return/(R + A_supply/A_return), R the valve's pilot ratio, where a counterbalance valve is active, which is
/// at most 0.6 for R >= 1. Therefore
///   p = H(F) + w(s) r A_return/A_supply,  s = A_supply (H(F + A_return r) - H(F)) / (A_return r),
/// with w = 0 up to s = 0.6, w = 1 from s = 0.9 and linear between. A valve that is set high, or absent, needs no
/// parameter. A pressure model that contains the corner between both branches (models/hydraulics/branch_corner.h) needs
/// no w: its S is higher by r A_return/A_supply. A large rise lifts the static branch above the valve's; what exceeds the
/// gap H - S (with the usual pressure of a return line in S) then appears in the supply although the valve was active
/// without it.
#include <cmath>

#include "models/hydraulics/gaussian_process.h"
#include "models/machine/machine.h"
#include "models/math/jet.h"

namespace sparflow {

/// The side of a cylinder that the pump feeds, with its pressure model. The members outlive it.
struct FedSide {
  const GaussianProcess& process;  ///< of this side, not empty
  const Cylinder& cylinder;
  int side;  ///< +1 extends, -1 retracts
  /// [m^2] area of the chamber that is fed, and of the other one
  double supply() const { return side > 0 ? cylinder.area_piston() : cylinder.area_rod(); }
  double other() const { return side > 0 ? cylinder.area_rod() : cylinder.area_piston(); }
};

/// Mean of a process, with derivatives where its arguments have them. [Pa]
inline double process_mean(const GaussianProcess& process, double flow, double force) {
  return process.mean(flow, force);
}
inline Jet process_mean(const GaussianProcess& process, const Jet& flow, const Jet& force) {
  if (flow.variables() == 0 && force.variables() == 0) {
    return process.mean(flow.value, force.value);
  }
  const GpDerivatives g = process.mean_derivatives(flow.value, force.value);
  return Jet::chain(flow, force,
                    {g.value, g.d_flow, g.d_force, g.d_flow_flow, g.d_flow_force, g.d_force_force});
}

namespace return_rise {

/// Load by A_supply: the least change of load over which the slope is evaluated.
/// @threshold [Pa] 1e4..1e7; chosen: five bar, above the noise of a pressure model
inline constexpr double kLeastLoad = 5e5;
/// Load by A_supply: the least range of loads that a pressure model must have learned for a slope.
/// @threshold [Pa] 1e4..1e7; chosen: three bar, above the noise of a pressure model
inline constexpr double kLeastSeen = 3e5;
/// A pressure model of a single load has no slope; a supply pressure this far above the static branch is then taken
/// for that of a valve.
/// @threshold [Pa] 1e5..1e8; chosen: return lines and friction raise it by less
inline constexpr double kValveFrom = 15e5;
/// Width of that transition.
/// @threshold [Pa] 1e4..1e7; chosen: two bar, so that the law stays smooth
inline constexpr double kValveSpread = 2e5;
/// Usual pressure of a return line. [Pa]
/// @threshold [Pa] 0..1e7; chosen: filter and line take a few bar
inline constexpr double kReturnLine = 6e5;

/// Share of a larger load that the supply takes up, at most, where a valve is active.
/// @threshold [1] 0..1; chosen: pilot ratios leave far less
inline constexpr double kSteepestValve = 0.6;
/// Share of a larger load that the supply takes up, at least, on the static branch.
/// @threshold [1] 0..1; chosen: a force that is wrong by a tenth changes the share as much
inline constexpr double kFlattestLoad = 0.9;

/// max(0, x) with its corner rounded over about `rounded`.
template <class T>
T positive(const T& x, double rounded = 0.02) {
  using std::sqrt;
  return 0.5 * (x + sqrt(x * x + T(rounded * rounded)));
}

/// The weight w above, 0..1. @param above supply pressure minus that which balances the load alone [Pa]
template <class T>
T static_share(const FedSide& fed, const T& above, const T& flow, const T& force, const T& rise) {
  using std::exp;
  using std::sqrt;
  const GpParameters& p = fed.process.parameters();
  const double supply = fed.supply(), other = fed.other();
  const double seen = p.force_max - p.force_min;  // 0: not known
  if (seen > 0.0 && seen < kLeastSeen * supply)
    return 1.0 / (1.0 + exp((above - T(kValveFrom)) / kValveSpread));
  const double least = kLeastLoad * supply;
  T width = sqrt(other * other * rise * rise + T(least * least));
  if (seen > 0.0 && width > T(seen)) width = seen;
  const bool upwards = (fed.side > 0) == (rise >= T(0.0));
  T from = upwards ? force : T(force - width);
  if (seen > 0.0 && from > T(p.force_max - width)) from = p.force_max - width;
  if (seen > 0.0 && from < T(p.force_min)) from = p.force_min;
  const T slope =
      (process_mean(fed.process, flow, T(from + width)) - process_mean(fed.process, flow, from)) *
      (fed.side * supply) / width;
  return (positive<T>(slope - kSteepestValve) - positive<T>(slope - kFlattestLoad)) /
         (kFlattestLoad - kSteepestValve);
}

}  // namespace return_rise

/// Increase of the supply pressure. Corners are rounded, consistently in values and derivatives. Beyond the learned loads
/// the branch is that at their border. [Pa]
/// @param own mean of the side's process at (flow, force) [Pa]
/// @param force total force [N]  @param rise of the return chamber, of either sign [Pa]
template <class T>
T supply_rise(const FedSide& fed, const T& own, const T& flow, const T& force, const T& rise) {
  const double supply = fed.supply(), other = fed.other();
  const T whole = (other / supply) * rise;
  const BranchCorner& corner = fed.process.parameters().corner;
  if (corner.there()) return rise_across<T>(corner, flow, force, whole);
  const T above = own - (fed.side / supply) * force;
  const T share = return_rise::static_share(fed, above, flow, force, rise);
  if (rise <= T(0.0)) return share * whole;
  // On the valve's branch the part beyond the gap counts; it is zero without a rise.
  /// Pressure over which the gap's corner is rounded.
  /// @threshold [Pa] 1e3..1e6; numerical: a fifth of a bar, so that the law stays smooth
  constexpr double kRounded = 2e4;
  const T gap =
      return_rise::positive<T>(above - T(other / supply * return_rise::kReturnLine), kRounded);
  const T beyond =
      return_rise::positive<T>(whole - gap, kRounded) - return_rise::positive<T>(-gap, kRounded);
  return share * whole + (1.0 - share) * beyond;
}

}  // namespace sparflow
