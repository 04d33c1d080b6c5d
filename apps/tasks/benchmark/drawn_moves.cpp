#include "apps/tasks/benchmark/drawn_moves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/machine/kinematics.h"
#include "models/math/error.h"
#include "problems/time_parametrise.h"
#include "simulator/programmes/programmes.h"

namespace sparflow {
namespace {

double rounded(double x, double step) { return step * std::round(x / step); }

}  // namespace

MoveDrawing::MoveDrawing(const Machine& machine, std::uint64_t seed,
                         const DrawnMovesOptions& options)
    : machine_(machine),
      options_(options),
      random_(seed, "scenarios"),
      statics_(machine),
      usual_(plant::usual_payload(machine)) {}

Eigen::VectorXd MoveDrawing::posture(double payload) {
  /// Postures that are drawn until one can be held, at most.
  /// @threshold [1] 100..1e7; chosen: on the bundled machines about one in two can be held
  constexpr int kMostPostures = 20000;
  for (int draw = 0; draw < kMostPostures; ++draw) {
    Eigen::VectorXd q(machine_.joint_count());
    for (int k = 0; k < machine_.joint_count(); ++k) {
      const Range r = machine_.joints[static_cast<std::size_t>(k)].position;
      const bool driven = machine_.cylinder_of_joint(k) >= 0;
      const double share = driven ? random_.uniform(options_.edge, 1.0 - options_.edge) : 0.5;
      q[k] = rounded(r.lo + (r.hi - r.lo) * share, 1e-3);
    }
    if (holds(q, payload) && tip_position<double>(machine_, q).z() > options_.lowest_tip) return q;
  }
  throw UsageError(fmt::format("machine {}: no posture was found in which its pumps hold {:g} kg",
                               machine_.name, payload));
}

bool MoveDrawing::holds(const Eigen::VectorXd& q, double payload) {
  statics_.update(q.data(), payload, 0);
  for (int c = 0; c < machine_.cylinder_count(); ++c) {
    const Cylinder& drive = machine_.cylinders[static_cast<std::size_t>(c)];
    const int pump = machine_.pump_of_cylinder(c);
    if (!drive.hydraulic() || pump < 0) continue;
    const double force = statics_.force()[c];
    const double area = force > 0.0 ? drive.area_piston() : drive.area_rod();
    const double most = machine_.pumps[static_cast<std::size_t>(pump)].max_pressure;
    if (std::abs(force) / area > options_.holding_share * most) return false;
  }
  return true;
}

double MoveDrawing::shortest(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                             double payload) {
  constexpr int kParts = 12;  // of the line, at whose ends it is asked whether it can be held
  for (int k = 1; k < kParts; ++k)
    if (!holds(from + static_cast<double>(k) / kParts * (to - from), payload)) return 0.0;
  MotionProblem p;
  p.machine = machine_;
  p.limits = limits_of(machine_);
  p.limits.valve_fraction = options_.flow_share;
  for (double& flow : p.limits.pump_max_flow) flow *= options_.flow_share;
  p.payload = payload;
  p.start = from;
  p.goal = JointGoal{to};
  Eigen::MatrixXd path(2, from.size());
  path.row(0) = from;
  path.row(1) = to;
  return time_parametrise(p, path, 0.0).shortest;
}

double MoveDrawing::payload() {
  return random_.chance(0.25) ? 0.0 : rounded(random_.uniform(0.2, 0.8) * usual_, 10.0);
}

double MoveDrawing::duration(double shortest) {
  return std::max(6.0, rounded(random_.uniform(1.3, 2.5) * shortest + 1.0, 0.5));
}

bool MoveDrawing::far_apart(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const {
  return (tip_position<double>(machine_, to) - tip_position<double>(machine_, from)).norm() >=
         options_.least_way;
}

std::vector<benchmark::Scenario> drawn_moves(const Machine& machine,
                                             const plant::PlantParameters& parameters,
                                             std::uint64_t seed, int count,
                                             const DrawnMovesOptions& options) {
  /// Moves that are drawn for each one that is wanted, at most.
  /// @threshold [1] 10..1e5; chosen: about one in three can be done; a machine of which none can is an error
  constexpr int kMostDraws = 1000;
  MoveDrawing d(machine, seed, options);
  std::vector<benchmark::Scenario> moves;
  moves.reserve(static_cast<std::size_t>(count));
  for (int draw = 0; static_cast<int>(moves.size()) < count; ++draw) {
    if (draw == kMostDraws * count)
      throw UsageError(
          fmt::format("machine {}: no move was found that its pumps can hold", machine.name));
    benchmark::Scenario s;
    s.machine = machine;
    s.plant = parameters;
    s.payload = d.payload();
    s.start = d.posture(s.payload);
    const Eigen::VectorXd to = d.posture(s.payload);
    const double shortest = d.shortest(s.start, to, s.payload);
    if (shortest <= 0.0 || !d.far_apart(s.start, to)) continue;
    benchmark::ScenarioGoal goal;
    goal.tip = tip_position<double>(machine, to);
    goal.duration = d.duration(shortest);
    if (!d.random().chance(0.7)) goal.q = to;
    s.id = fmt::format("move {}", moves.size() + 1);
    s.tolerance = 0.1;
    s.time_limit = 2.0 * goal.duration + 10.0;
    s.goals = {goal};
    s.seeds = {seed};
    moves.push_back(std::move(s));
  }
  return moves;
}

}  // namespace sparflow
