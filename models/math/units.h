#pragma once
/// Units of files and displays; values are converted where they are read or shown and nowhere else.
namespace sparflow::units {
// no threshold: units
inline constexpr double kBar = 1e5;                      ///< [Pa] in one bar
inline constexpr double kLitrePerMinute = 1.0 / 6e4;     ///< [m^3/s] in one l/min
inline constexpr double kDegree = 0.017453292519943295;  ///< [rad] in one degree
}  // namespace sparflow::units
