#pragma once
/// The operator: blocks of single and simultaneous moves with pauses between them, with levers moved open loop. The
/// statistics are those of a working log: moves of 3 to 10 s, rest for a seventh of the time, two cylinders at once for
/// a third of it.
#include <array>
#include <vector>

#include "models/machine/machine.h"
#include "simulator/random/random.h"

namespace sparflow::simulator {

/// One cylinder as the operator knows it; index 0 = extending, 1 = retracting.
struct LeverFlow {
  std::array<double, 2> flow{};  ///< [m^3/s] at full command
  std::array<double, 2>
      area{};  ///< [m^2] that the flow fills; of a drive without hydraulics both tell a rod speed: 1, [m/s]
};
/// By cylinder, with the areas of the machine file. @param flows [m^3/s]
std::vector<LeverFlow> lever_flows(const Machine& machine,
                                   const std::vector<std::array<double, 2>>& flows);

class OperatorMotion {
 public:
  /// @param machine must outlive this object
  OperatorMotion(const Machine& machine, std::vector<LeverFlow> flows, std::uint64_t motion_seed);

  std::vector<double> start_posture();
  /// Sets the levers [-] by cylinder at time t [s] for the crane at q. @param h [s] step
  /// @param length_rate dx/dq by cylinder
  void levers(double t, double h, const std::vector<double>& q,
              const std::vector<double>& length_rate, std::vector<double>& command);
  bool resting() const { return moves_.empty(); }  ///< in a pause between blocks

 private:
  struct Move {
    int cylinder = 0;
    bool lever_held = false;        ///< the profile is that of the lever, else of the joint's speed
    double amplitude = 0.0;         ///< [-] lever, or [rad/s] or [m/s]
    double start = 0.0;             ///< [s] after the block's begin
    double ramp = 0.5, hold = 3.0;  ///< [s]
    double phase =
        0.0;  ///< [s] in its profile; grows slower than time when the pump's flow is limited
    double duration() const { return hold + 2.0 * ramp; }
    double profile() const;
  };
  void plan_block(double t, const std::vector<double>& q);
  bool plan_move(int cylinder, double window, double q, Move& move);

  const Machine& machine_;
  std::vector<LeverFlow> flows_;
  Random random_;
  std::vector<Move> moves_;
  std::vector<int> preferred_;  ///< last direction by cylinder, so that all postures are visited
  double block_start_ = 0.0, pause_end_ = 0.0;
};

}  // namespace sparflow::simulator
