#pragma once
/// Physical dimensions and the unit texts users write: `bar/(l/min)^2`, `N s/m`, `1/degC`, `%`.
/// Angles count as pure numbers (SI brochure, 9th ed., sec. 2.3.3), so rad and deg have no dimension.
#include <array>
#include <string>

namespace sparflow {

/// Exponents of m, kg, s and K. Halves are allowed, as for the flow through an orifice [m^3/(s Pa^0.5)].
struct Dimension {
  std::array<int, 4> twice{};  ///< two times each exponent, in the order above

  bool none() const { return *this == Dimension{}; }  ///< a pure number
  friend bool operator==(const Dimension&, const Dimension&) = default;
  friend Dimension operator*(const Dimension& a, const Dimension& b);
  friend Dimension operator/(const Dimension& a, const Dimension& b);
  /// @param exponent any number; @throws TextError (column 0) when the result has exponents finer than halves
  Dimension power(double exponent) const;
  /// "N s/m", "Pa s^2/m^6", "1/K"; "1" for pure numbers. parse_unit() reads it back with factor 1.
  std::string text() const;
};

namespace dimensions {
inline constexpr Dimension kNone{};
inline constexpr Dimension kLength{{2, 0, 0, 0}};
inline constexpr Dimension kMass{{0, 2, 0, 0}};
inline constexpr Dimension kTime{{0, 0, 2, 0}};
inline constexpr Dimension kTemperature{{0, 0, 0, 2}};
inline constexpr Dimension kRate{{0, 0, -2, 0}};
inline constexpr Dimension kRateOfRate{{0, 0, -4, 0}};
inline constexpr Dimension kArea{{4, 0, 0, 0}};
inline constexpr Dimension kSpeed{{2, 0, -2, 0}};
inline constexpr Dimension kAcceleration{{2, 0, -4, 0}};
inline constexpr Dimension kFlow{{6, 0, -2, 0}};
inline constexpr Dimension kForce{{2, 2, -4, 0}};
inline constexpr Dimension kPressure{{-2, 2, -4, 0}};
}  // namespace dimensions

/// "[N s/m]" or "no unit", for messages.
std::string in_brackets(const Dimension& dimension);

struct Unit {
  Dimension dimension;
  double si = 1.0;  ///< SI value = number in this unit * si
  /// True for `degC` alone, the reading of a thermometer. Temperatures stay in degC, so that its factor is 1; only
  /// the difference of two readings is a quantity [K]. Inside a compound (`1/degC`) the degree is a kelvin.
  bool reading = false;
};

/// Product of unit names with `*`, a space or `·` between, at most one level of `/` (or several: `m/s/s`),
/// parentheses, exponents `^2`, `^-1`, `^0.5`, `²`, `³`. `1` and `-` are pure numbers.
/// @throws TextError with the column and, where there is one, the unit that was probably meant
Unit parse_unit(const std::string& text);

/// All unit names that parse_unit() knows, for documentation: "m, mm, cm, ...".
std::string known_units();

}  // namespace sparflow
