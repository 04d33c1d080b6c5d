#pragma once
/// Turns the plant's states into a log: sampling, noise, rounding, columns.
#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {

// Standard deviations of white noise at noise factor 1, as in the shared example logs.
inline constexpr double kPressureNoise = 0.8 * kBar;  ///< [Pa]
inline constexpr double kAngleNoise = 3.0e-4;         ///< [rad]
inline constexpr double kTravelNoise = 1.0e-3;        ///< [m]

class LogRecorder {
 public:
  LogRecorder(const Machine& machine, const LogRequest& request, std::size_t rows);
  void add(const PlantState& state, const SensorState& sensors, double payload);
  /// Draws the noise, lets the laws change whole channels (delays, stuck values), then adds the noise.
  void finish(std::vector<std::unique_ptr<HiddenLaw>>& hidden, Random& random);
  GeneratedLog log() const;  ///< columns rounded, without truth

 private:
  const Machine& machine_;
  const LogRequest& request_;
  Recording r_;
  std::vector<std::vector<double>> force_;  ///< [N] of drives without chambers
};

}  // namespace sparflow::simulator
