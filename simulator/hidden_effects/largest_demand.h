#pragma once
/// The simulated pump's law. The simulator shares no law with the model, whose opponent it is, so this is a copy of
/// models/chain/pump_law.h; tests/simulator/largest_demand_test.cpp holds it against the first.

namespace sparflow::simulator {

/// Pressure that the load-sensing line asks of a pump, as the cylinders' demands are added.
struct LargestDemand {
  double pressure;  ///< [Pa] starts at standby
  int leader = -1;  ///< cylinder with the largest demand, -1 = standby

  void add(int cylinder, double demand) {
    if (demand > pressure) {
      pressure = demand;
      leader = cylinder;
    }
  }
};

}  // namespace sparflow::simulator
