#pragma once
/// The map's tables and its picture.
#include <string>
#include <vector>

namespace sparflow {

struct MapPoint {
  double duration = 0.0;                                       // [s]
  double sequential = 0.0, simultaneous = 0.0, optimal = 0.0;  // [J], NaN = none in this time
  std::string from;                                            // the optimum's start
  std::vector<double> share_moving;                            // of the optimum's time, 0, 1, 2 ...
};

struct MapCurve {
  std::string reach;
  double payload = 0.0;                                     // [kg]
  double shortest = 0.0;                                    // [s]
  double sequential_limit = 0.0, simultaneous_limit = 0.0;  // [J] with unlimited time
  std::string message;
  std::vector<MapPoint> points;  // by duration
};

/// One way's best time for an idle power: the least of energy + power x time over the curve.
struct BestTime {
  double duration = 0.0;  // [s], 0 = none
  double cost = 0.0;      // [J]
};
enum class MapWay { kSequential, kSimultaneous, kOptimal };
BestTime best_time(const MapCurve& curve, MapWay way, double idle_power);

std::string map_csv(const std::vector<MapCurve>& curves);
std::string idle_csv(const std::vector<MapCurve>& curves, const std::vector<double>& idle_powers);
std::string map_svg(const std::vector<MapCurve>& curves, const std::vector<double>& idle_powers);
/// The figures the page of text quotes.
std::string map_summary(const std::vector<MapCurve>& curves,
                        const std::vector<double>& idle_powers);

}  // namespace sparflow
