#pragma once
/// Oil with entrained air: specific volume, bulk modulus and flow work over pressure, viscosity over temperature.
///   v(p) = (1 - a) exp(-(p - p0) / K) + a (p0 / p)^(1/n),  E = -v / (dv/dp),  h = integral of v dp from p0
/// with absolute pressures and p0 = one atmosphere. Masses are counted as the volume that they have at p0: a flow q
/// [m^3/s] is a mass flow divided by the density at p0. So mass and energy are conserved exactly, also where a
/// chamber's volume changes between compression and decompression.
/// Source: Jelali, Kroll (2003), Hydraulic Servo-systems, ch. 3 (mixture with polytropic air). Valid: dissolved air and
/// vapour left out, so pressures below one atmosphere are softer than real oil's.
#include <cmath>

namespace sparflow::plant {

inline constexpr double kAtmosphere = 101325.0;  ///< [Pa] absolute

struct OilParameters {
  double bulk_modulus = 1.5e9;    ///< [Pa] of the oil without air
  double air_fraction = 0.005;    ///< [-] entrained air, share of the volume at one atmosphere
  double polytropic = 1.2;        ///< [-] exponent n of the air, above 1
  double viscosity_40 = 46e-6;    ///< [m^2/s] kinematic, at 40 degC
  double viscosity_100 = 6.8e-6;  ///< [m^2/s] kinematic, at 100 degC
};

class Oil {
 public:
  explicit Oil(const OilParameters& p);

  /// Properties at one pressure.
  struct Properties {
    double volume;   ///< [-] specific volume, 1 at one atmosphere
    double modulus;  ///< [Pa] bulk modulus E
    double
        flow_work;  ///< [J/m^3] h, work that brings a unit of oil from p0 to this pressure and into it
  };
  /// @param pressure [Pa] gauge; below 5 kPa absolute the volume continues linearly
  Properties at(double pressure) const;

  /// Kinematic viscosity over that at 40 degC (Walther's equation, ASTM D341). @param temperature [degC]
  double relative_viscosity(double temperature) const;

 private:
  Properties mixture(double absolute) const;
  OilParameters p_;
  double walther_a_ = 0.0, walther_b_ = 0.0, viscosity_offset_ = 0.7;
  Properties floor_{};
  double floor_slope_ = 0.0;
};

/// A volume of oil between a rigid part and a hose whose wall yields: V = rigid + hose (1 + p / hose_modulus).
struct Chamber {
  double rigid = 0.0;           ///< [m^3]
  double hose = 0.0;            ///< [m^3] at gauge pressure 0
  double hose_modulus = 1.0e9;  ///< [Pa]

  double volume(double pressure) const { return rigid + hose * (1.0 + pressure / hose_modulus); }
  /// Rate of pressure. @param inflow [m^3/s] at p0 @param growth [m^3/s] rate of the rigid volume. [Pa/s]
  double pressure_rate(const Oil::Properties& oil, double pressure, double inflow,
                       double growth) const {
    return (oil.volume * inflow - growth) / (volume(pressure) / oil.modulus + hose / hose_modulus);
  }
  /// Energy stored in oil and wall [J], zero at gauge pressure 0; its rate is h q - p dV/dt of the rigid part.
  double energy(const Oil::Properties& oil, double pressure) const {
    return volume(pressure) / oil.volume * (oil.flow_work - pressure * oil.volume) +
           0.5 * hose * pressure * pressure / hose_modulus;
  }
};

}  // namespace sparflow::plant
