#pragma once
/// Sensors of the plant: what is told of a record, with noise, quantisation, offset, delay and drop-outs.
#include <deque>
#include <string>
#include <vector>

#include "simulator/plant/run/plant_run.h"
#include "simulator/random/random.h"

namespace sparflow::plant {

enum class SensedKind { kExact, kPosition, kPressure, kForce };

/// One channel in the order of docs/log_format.md: joints, commands, pressures or forces by cylinder, pumps, return line,
/// payload, oil.
struct SensedChannel {
  std::string name;  ///< of the log's column, "q_boom_rad"
  SensedKind kind = SensedKind::kExact;
  double scale = 1.0;       ///< number in a file = SI value / scale
  double offset = 0.0;      ///< SI
  double gap_until = -1.0;  ///< [s] end of a gap in this channel
};

/// Positions, commands and payload come at once, pressures and forces after the sensors' delay; each channel has its own
/// noise and its own gaps. The same seed tells the same.
class Sensors {
 public:
  Sensors(const Machine& machine, const PlantParameters& parameters, std::uint64_t seed);
  const std::vector<SensedChannel>& channels() const { return channels_; }
  /// Values by channel, SI; NaN in a gap. Records must come in the order of their time.
  std::vector<double> sense(const Record& record);

 private:
  void add_channel(const std::string& name, SensedKind kind, double scale, double offset = 0.0);
  double sensed(SensedKind kind, double value);
  std::vector<double> values(const Record& r) const;

  const Machine& machine_;
  SensorParameters sensors_;
  double hook_mass_ =
      0.0;  ///< [kg] told where the load is less: whoever weighs a load on a rope weighs the hook
  simulator::Random random_;
  std::vector<SensedChannel> channels_;
  std::deque<std::pair<double, std::vector<double>>> past_;  // true values, for delayed channels
  double largest_force_ = 0.0;
};

}  // namespace sparflow::plant
