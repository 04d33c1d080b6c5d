#pragma once
/// Friction of seals and guides with presliding: the LuGre model with speed-dependent bristle damping.
///   dz/dt = v - s0 |v| z / g(v),  g = Fc + (Fs - Fc) exp(-(v/vs)^2),  F = s0 z + s1 exp(-(v/vd)^2) dz/dt + s2 v
/// Source: Canudas de Wit, Olsson, Astrom, Lischinsky (1995), IEEE Trans. Automatic Control 40(3); damping that
/// falls with speed: Olsson (1996), Control Systems with Friction, Lund.
#include <cmath>

namespace sparflow::plant {

struct FrictionParameters {
  double coulomb = 0.0;           ///< [N] Fc
  double stiction_ratio = 1.4;    ///< [-] Fs / Fc
  double stribeck_speed = 0.01;   ///< [m/s] vs
  double viscous = 0.0;           ///< [N s/m] s2, at 40 degC
  double presliding = 1e-4;       ///< [m] bristle deflection at Fc; s0 = Fc / presliding
  double bristle_damping = 0.01;  ///< [s] s1 / s0
  double damping_speed = 0.002;   ///< [m/s] vd
};

struct Friction {
  double force = 0.0;         ///< [N] against positive speed
  double bristle_rate = 0.0;  ///< [m/s]
  double loss =
      0.0;  ///< [W] turned into heat; the rest of force times speed is stored in the bristles
};

/// @param speed [m/s] @param bristle [m] mean deflection z @param viscosity [-] relative to 40 degC
inline Friction friction(double speed, double bristle, double viscosity,
                         const FrictionParameters& p) {
  Friction f;
  f.force = p.viscous * viscosity * speed;
  f.loss = f.force * speed;
  if (p.coulomb <= 0.0) {
    f.bristle_rate = -bristle / 0.01;  // the unused state goes to zero
    return f;
  }
  const double s0 = p.coulomb / p.presliding;
  const double r = speed / p.stribeck_speed, d = speed / p.damping_speed;
  const double level = p.coulomb * (1.0 + (p.stiction_ratio - 1.0) * std::exp(-r * r));
  f.bristle_rate = speed - s0 * std::abs(speed) * bristle / level;
  const double elastic = s0 * bristle;
  const double damping = p.bristle_damping * s0 * std::exp(-d * d) * f.bristle_rate;
  f.force += elastic + damping;
  f.loss += (elastic + damping) * speed - elastic * f.bristle_rate;
  return f;
}

/// Energy of the bent bristles. [J]
inline double bristle_energy(double bristle, const FrictionParameters& p) {
  return p.coulomb <= 0.0 ? 0.0 : 0.5 * p.coulomb / p.presliding * bristle * bristle;
}

}  // namespace sparflow::plant
