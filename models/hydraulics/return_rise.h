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

/// Mean of a process, with derivatives where its arguments have them. [Pa]
inline double process_mean(const GaussianProcess& process, double flow, double force) {
  return process.mean(flow, force);
}
inline Jet process_mean(const GaussianProcess& process, const Jet& flow, const Jet& force) {
  if (flow.variables() == 0 && force.variables() == 0) {
    return process.mean(flow.value, force.value);
  }
  const GpDerivatives g = process.mean_derivatives(flow.value, force.value);
  return Jet::chain(flow, force, g.value, g.d_flow, g.d_force, g.d_flow_flow, g.d_flow_force,
                    g.d_force_force);
}

namespace return_rise {

/// Loads by A_supply: the least change of load over which the slope is evaluated, and the least range of loads that a
/// pressure model must have learned for it. [Pa]
inline constexpr double kLeastLoad = 5e5, kLeastSeen = 3e5;
/// A pressure model of a single load has no slope; a supply pressure this far above the static branch is then taken for
/// that of a valve, with a transition of the second width. [Pa]
inline constexpr double kValveFrom = 15e5, kValveSpread = 2e5;
/// Usual pressure of a return line. [Pa]
inline constexpr double kReturnLine = 6e5;

/// Share of a larger load that the supply takes up: at most the first where a valve is active, at least the second on the
/// static branch (a force that is wrong by a tenth changes the share as much).
inline constexpr double kSteepestValve = 0.6, kFlattestLoad = 0.9;

/// max(0, x) with its corner rounded over about `rounded`.
template <class T>
T positive(const T& x, double rounded = 0.02) {
  using std::sqrt;
  return 0.5 * (x + sqrt(x * x + T(rounded * rounded)));
}

/// The weight w above, 0..1. @param above supply pressure minus that which balances the load alone [Pa]
template <class T>
T static_share(const GaussianProcess& process, int side, double supply, double other,
               const T& above, const T& flow, const T& force, const T& rise) {
  using std::exp;
  using std::sqrt;
  const GpParameters& p = process.parameters();
  const double seen = p.force_max - p.force_min;  // 0: not known
  if (seen > 0.0 && seen < kLeastSeen * supply)
    return 1.0 / (1.0 + exp((above - T(kValveFrom)) / kValveSpread));
  const double least = kLeastLoad * supply;
  T width = sqrt(other * other * rise * rise + T(least * least));
  if (seen > 0.0 && width > T(seen)) width = seen;
  const bool upwards = (side > 0) == (rise >= T(0.0));
  T from = upwards ? force : T(force - width);
  if (seen > 0.0 && from > T(p.force_max - width)) from = p.force_max - width;
  if (seen > 0.0 && from < T(p.force_min)) from = p.force_min;
  const T slope =
      (process_mean(process, flow, T(from + width)) - process_mean(process, flow, from)) *
      (side * supply) / width;
  return (positive<T>(slope - kSteepestValve) - positive<T>(slope - kFlattestLoad)) /
         (kFlattestLoad - kSteepestValve);
}

}  // namespace return_rise

/// Increase of the supply pressure. Corners are rounded, consistently in values and derivatives. Beyond the learned loads
/// the branch is that at their border. [Pa]
/// @param process of this side, not empty  @param own its mean at (flow, force) [Pa]
/// @param force total force [N]  @param rise of the return chamber, of either sign [Pa]
template <class T>
T supply_rise(const GaussianProcess& process, const Cylinder& cylinder, int side, const T& own,
              const T& flow, const T& force, const T& rise) {
  const double supply = side > 0 ? cylinder.area_piston() : cylinder.area_rod();
  const double other = side > 0 ? cylinder.area_rod() : cylinder.area_piston();
  const T whole = (other / supply) * rise;
  const BranchCorner& corner = process.parameters().corner;
  if (corner.there()) return rise_across<T>(corner, flow, force, whole);
  const T above = own - (side / supply) * force;
  const T share = return_rise::static_share(process, side, supply, other, above, flow, force, rise);
  if (rise <= T(0.0)) return share * whole;
  // On the valve's branch the part beyond the gap counts; it is zero without a rise.
  constexpr double kRounded = 2e4;  // [Pa]
  const T gap =
      return_rise::positive<T>(above - T(other / supply * return_rise::kReturnLine), kRounded);
  const T beyond =
      return_rise::positive<T>(whole - gap, kRounded) - return_rise::positive<T>(-gap, kRounded);
  return share * whole + (1.0 - share) * beyond;
}

}  // namespace sparflow
