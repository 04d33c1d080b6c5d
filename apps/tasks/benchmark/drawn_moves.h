#pragma once
/// Moves drawn from a seed: postures that the pumps can hold, and the shortest times of straight joint lines between them.
#include <vector>

#include "models/machine/static_force.h"
#include "simulator/benchmark/scenario.h"
#include "simulator/random/random.h"

namespace sparflow {

struct DrawnMovesOptions {
  /// Share of the pumps' largest pressure that a drawn posture may ask for.
  /// @threshold [1] 0.1..1; chosen: room for margin, friction and return pressure
  double holding_share = 0.7;
  /// Share of valves' and pumps' flows in the shortest time, of which durations are factors.
  /// @threshold [1] 0.1..1; chosen: below what optimal motions may use (OptimalMotionOptions::flow_share)
  double flow_share = 0.85;
  /// Least distance of the tip's places at both ends of a move.
  /// @threshold [m] 0..10; chosen: shorter moves are corrections
  double least_way = 1.2;
  /// Share of each joint's range at both ends from which no posture is drawn.
  /// @threshold [1] 0..0.4; chosen: away from cushions and stops
  double edge = 0.1;
  /// Lowest place of the tip.
  /// @threshold [m] -10..10; chosen: somewhat below the base, as a load beside the machine is
  double lowest_tip = -1.0;
};

class MoveDrawing {
 public:
  /// @param machine must outlive this object
  MoveDrawing(const Machine& machine, std::uint64_t seed, const DrawnMovesOptions& options = {});

  /// A posture that the pumps can hold with this payload [kg]. @return [rad] or [m] by joint
  Eigen::VectorXd posture(double payload);
  /// Whether the pumps can hold this payload [kg] there.
  bool holds(const Eigen::VectorXd& q, double payload);
  /// Shortest time of the straight joint line [s]; 0: it cannot be held throughout.
  double shortest(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double payload);
  /// A payload from empty, in one of four, to four fifths of what the machine usually carries. [kg]
  double payload();
  /// A duration for a move of this shortest time [s], between one and a third and two and a half times as long, at least 6 s.
  double duration(double shortest);
  /// Whether these postures are far enough apart for a move.
  bool far_apart(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const;

  simulator::Random& random() { return random_; }
  const Machine& machine() const { return machine_; }
  double usual_payload() const { return usual_; }  ///< [kg]

 private:
  const Machine& machine_;
  DrawnMovesOptions options_;
  simulator::Random random_;
  StaticForce statics_;
  double usual_ = 0.0;  // [kg]
};

/// Moves of one goal each on this plant, numbered from 1 in their names; seven in ten are to a point, the others to a posture.
/// @param parameters of the plant
std::vector<benchmark::Scenario> drawn_moves(const Machine& machine,
                                             const plant::PlantParameters& parameters,
                                             std::uint64_t seed, int count,
                                             const DrawnMovesOptions& options = {});

}  // namespace sparflow
