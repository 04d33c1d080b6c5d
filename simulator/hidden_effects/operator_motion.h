#pragma once
/// The operator: blocks of single and simultaneous moves with pauses between, levers moved open loop. Statistics like
/// those of a working log: moves of 3 to 10 s, rest a seventh of the time, two functions at once a third of it.
#include <vector>

#include "models/machine/machine.h"
#include "simulator/hidden_effects/crane_laws.h"

namespace sparflow::simulator {

class OperatorMotion {
 public:
  /// @param machine outlives this
  OperatorMotion(const Machine& machine, const CraneLaws& laws, std::uint64_t motion_seed);

  std::vector<double> start_posture();
  /// Levers by cylinder at time t, given where the crane stands.
  /// @param length_rate dx/dq by cylinder
  void levers(double t, double h, const std::vector<double>& q,
              const std::vector<double>& length_rate, std::vector<double>& command);
  bool resting() const { return moves_.empty(); }  ///< in a pause between blocks

 private:
  struct Move {
    int cylinder = 0;
    bool lever_held = false;        ///< trapezoid of the lever; else of the joint's speed
    double amplitude = 0.0;         ///< [-] lever, or [rad/s] or [m/s]
    double start = 0.0;             ///< [s] after the block's begin
    double ramp = 0.5, hold = 3.0;  ///< [s]
    double phase = 0.0;  ///< [s] of its profile; slower than time when the pump is short of flow
    double duration() const { return hold + 2.0 * ramp; }
    double profile() const;
  };
  void plan_block(double t, const std::vector<double>& q);
  bool plan_move(int cylinder, double window, double q, Move& move);

  const Machine& machine_;
  const CraneLaws& laws_;
  Random random_;
  std::vector<Move> moves_;
  std::vector<int> preferred_;  ///< last direction by cylinder, so that poses are swept
  double block_start_ = 0.0, pause_end_ = 0.0;
};

}  // namespace sparflow::simulator
