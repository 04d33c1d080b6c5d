#pragma once
/// Corner of a supply pressure between its two branches.
///
/// The supply pressure is the larger of what a counterbalance valve requires, V, and the static branch
/// S = (load + A_return p_return)/A_supply (models/hydraulics/return_rise.h): p = max(V, S) = V + max(0, S - V). A
/// Gaussian process with a smooth kernel rounds such a corner by several bar and oscillates beside it, and where samples
/// lie only away from the corner it interpolates linearly across it. Therefore the second term, whose slope follows from
/// the balance of forces, is part of the mean, and the process learns the remainder.
#include <cmath>

namespace sparflow {

/// S - V = level + per_flow Q + per_force F. It is linear in the flow, because a square would diverge beyond the samples;
/// the process learns a curvature that samples show.
struct BranchCorner {
  double level = 0.0;      ///< [Pa]
  double per_flow = 0.0;   ///< [Pa/(m^3/s)]
  double per_force = 0.0;  ///< [Pa/N]; 0 = there is no corner

  bool there() const { return per_force != 0.0; }
};

/// Pressure over which max(0, S - V) is rounded, as in models/hydraulics/loads_beyond.h. [Pa]
/// @threshold [Pa] 1e3..1e6; chosen: two bar, small beside the pressures on either side
inline constexpr double kCornerRounded = 2e5;

/// Increase of the supply pressure [Pa] when the static branch increases by `rise` [Pa], of either sign: zero on the
/// valve's branch, all of it on the static branch, and across the corner the part beyond it.
template <class T>
T rise_across(const BranchCorner& c, const T& flow, const T& force, const T& rise) {
  using std::sqrt;
  const auto positive = [](const T& u) {
    return 0.5 * (u + sqrt(u * u + T(kCornerRounded * kCornerRounded)));
  };
  const T u = T(c.level) + c.per_flow * flow + c.per_force * force;
  return positive(T(u + rise)) - positive(u);
}

/// max(0, S - V), rounded, with its derivatives.
struct CornerRise {
  double value = 0.0;                                                 ///< [Pa]
  double d_flow = 0.0, d_force = 0.0;                                 ///< SI
  double d_flow_flow = 0.0, d_flow_force = 0.0, d_force_force = 0.0;  ///< SI
};

/// @param flow [m^3/s]  @param force [N]
inline CornerRise corner_rise(const BranchCorner& c, double flow, double force) {
  constexpr double kRounded = kCornerRounded;
  const double u = c.level + c.per_flow * flow + c.per_force * force;
  const double root = std::sqrt(u * u + kRounded * kRounded);
  const double first = 0.5 * (1.0 + u / root);
  const double second = 0.5 * kRounded * kRounded / (root * root * root);
  return {0.5 * (u + root),
          first * c.per_flow,
          first * c.per_force,
          second * c.per_flow * c.per_flow,
          second * c.per_flow * c.per_force,
          second * c.per_force * c.per_force};
}

/// Range of force over which the corner is curved. [N]
inline double corner_width(const BranchCorner& c) { return 10e5 / std::abs(c.per_force); }

}  // namespace sparflow
