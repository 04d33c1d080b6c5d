#pragma once
/// Tables and picture of the strategy map.
#include <string>
#include <vector>

namespace sparflow {

struct MapPoint {
  double duration = 0.0;                                       // [s]
  double sequential = 0.0, simultaneous = 0.0, optimal = 0.0;  // [J], NaN = none of this duration
  std::string from;  // the start from which the optimum was found
  std::vector<double>
      share_moving;  // [-] of the optimum's duration with 0, 1, 2 ... cylinders moving
};

struct MapCurve {
  std::string reach;
  double payload = 0.0;                                     // [kg]
  double shortest = 0.0;                                    // [s]
  double sequential_limit = 0.0, simultaneous_limit = 0.0;  // [J] at unlimited time
  std::string message;
  std::vector<MapPoint> points;  // by duration
};

/// Best duration of a strategy for an idle power [W]: the least energy + idle power x duration over the curve.
struct BestTime {
  double duration = 0.0;  // [s], 0 = none
  double cost = 0.0;      // [J]
};
enum class MapWay { kSequentialMotion, kSimultaneousMotion, kOptimalMotion };
BestTime best_time(const MapCurve& curve, MapWay way, double idle_power);

/// The tables as CSV, the picture as SVG; idle powers in [W].
std::string map_csv(const std::vector<MapCurve>& curves);
std::string idle_csv(const std::vector<MapCurve>& curves, const std::vector<double>& idle_powers);
std::string map_svg(const std::vector<MapCurve>& curves, const std::vector<double>& idle_powers);
/// The figures that docs/sequential_or_simultaneous.md quotes, as text.
std::string map_summary(const std::vector<MapCurve>& curves,
                        const std::vector<double>& idle_powers);

}  // namespace sparflow
