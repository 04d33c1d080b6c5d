#pragma once
/// What a higher pressure in the return chamber does to the supply, by the cylinder's own learned pressure.
///
/// The supply holds whichever asks for more, the static branch S = (load + A_return p_return)/A_supply or what a
/// counterbalance or anti-cavitation valve asks for. A return chamber higher by r acts on the static branch like a load
/// larger by A_return r, and on the valves not at all. The law H(Q, F) learned without it knows which of them rules: the
/// supply takes all of a larger load where the static branch does, and the share A_supply/A_return/(R + A_supply/A_return),
/// R the valve's pilot ratio, where a counterbalance valve does: at most 0.6 for R >= 1. So
///   p = H(F) + w(s) r A_return/A_supply,  s = A_supply (H(F + A_return r) - H(F)) / (A_return r),
/// A law that knows the corner between both branches (models/hydraulics/branch_corner.h) says so itself: S is higher by r A_return/A_supply.
/// Elsewhere w = 0 up to s = 0.6, 1 from 0.9, a straight line between. A valve that is set high, or none, needs no parameter.
/// A large rise carries the static branch over the valve's: beyond the gap between both, H - S with a usual return line's
/// pressure in S, it appears in the supply although the valve ruled without it.
#include <cmath>

#include "models/hydraulics/gaussian_process.h"
#include "models/machine/machine.h"
#include "models/math/jet.h"

namespace sparflow {

/// Process' mean with the derivatives of its arguments. [Pa]
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

/// Share of the load that tells the branches apart where a rise is small, and the least that a law must have seen. [Pa]
inline constexpr double kLeastLoad = 5e5, kLeastSeen = 3e5;
/// A law that has seen one load alone shows no slope: its supply stands this far above the load, or a valve holds it. [Pa]
inline constexpr double kValveFrom = 15e5, kValveSpread = 2e5;
/// Usual pressure of a return line by itself. [Pa]
inline constexpr double kReturnLine = 6e5;

/// Share of a larger load that the supply takes: at most, where a valve rules; at least, where the load does (a force that
/// is wrong by a tenth tilts it as much).
inline constexpr double kSteepestValve = 0.6, kFlattestLoad = 0.9;

/// max(0, x) with its corner rounded over about `rounded`.
template <class T>
T positive(const T& x, double rounded = 0.02) {
  using std::sqrt;
  return 0.5 * (x + sqrt(x * x + T(rounded * rounded)));
}

/// w above. @param above own pressure less what the load asks for [Pa]
template <class T>
T static_share(const GaussianProcess& process, int side, double supply, double other,
               const T& above, const T& flow, const T& force, const T& rise) {
  using std::exp;
  using std::sqrt;
  const GpParameters& p = process.parameters();
  const double seen = p.force_max - p.force_min;  // nothing: not known
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

/// What the supply pressure gains. Corners are rounded, alike in values and derivatives. Beyond the loads that a law was
/// learned from, the branch is that of the last ones it has seen. [Pa]
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
  // from the valve's branch over the gap; nothing at no rise
  constexpr double kRounded = 2e4;  // [Pa]
  const T gap =
      return_rise::positive<T>(above - T(other / supply * return_rise::kReturnLine), kRounded);
  const T beyond =
      return_rise::positive<T>(whole - gap, kRounded) - return_rise::positive<T>(-gap, kRounded);
  return share * whole + (1.0 - share) * beyond;
}

}  // namespace sparflow
