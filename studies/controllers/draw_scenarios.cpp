/// Draws scenarios for `sparflow benchmark` from a seed: postures, payloads, goals and times on a machine that a bundled model
/// was fitted for.
///   build/bench/draw_scenarios --machine loader_crane --model loader_crane_plant --set test --count 10 --seed 1 -o DIR
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "models/files/machine_file.h"
#include "models/machine/kinematics.h"
#include "models/machine/static_force.h"
#include "models/math/error.h"
#include "problems/bundled.h"
#include "problems/time_parametrise.h"
#include "simulator/programmes/programmes.h"
#include "simulator/random/random.h"

namespace sparflow::bench {
namespace {

/// Share of the pump's pressure that a drawn posture may ask for.
constexpr double kHoldingShare = 0.7;
constexpr double kLeastWay = 1.2;  // [m] of the tip in a move
constexpr double kFlowShare =
    0.85;  // of valves and pumps, in the shortest time that durations are factors of

double rounded(double x, double step) { return step * std::round(x / step); }

class Drawing {
 public:
  Drawing(const Machine& machine, std::uint64_t seed)
      : machine_(machine), random_(seed, "scenarios"), statics_(machine) {}

  /// A posture that the pumps can hold with this payload, the tip not far below the base.
  Eigen::VectorXd posture(double payload) {
    while (true) {
      Eigen::VectorXd q(machine_.joint_count());
      for (int k = 0; k < machine_.joint_count(); ++k) {
        const Range r = machine_.joints[static_cast<std::size_t>(k)].position;
        const bool driven = machine_.cylinder_of_joint(k) >= 0;
        q[k] = rounded(r.lo + (r.hi - r.lo) * (driven ? random_.uniform(0.1, 0.9) : 0.5), 1e-3);
      }
      if (holds(q, payload) && tip_position<double>(machine_, q).z() > -1.0) return q;
    }
  }

  bool holds(const Eigen::VectorXd& q, double payload) {
    statics_.update(q.data(), payload, 0);
    for (int c = 0; c < machine_.cylinder_count(); ++c) {
      const Cylinder& drive = machine_.cylinders[static_cast<std::size_t>(c)];
      const int pump = machine_.pump_of_cylinder(c);
      if (!drive.hydraulic() || pump < 0) continue;
      const double force = statics_.force()[c];
      const double area = force > 0.0 ? drive.area_piston() : drive.area_rod();
      const double most = machine_.pumps[static_cast<std::size_t>(pump)].max_pressure;
      if (std::abs(force) / area > kHoldingShare * most) return false;
    }
    return true;
  }

  /// Whether the straight joint line can be held throughout, and its shortest time [s]; 0: it cannot.
  double shortest(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double payload) {
    for (int k = 1; k < 12; ++k)
      if (!holds(from + k / 12.0 * (to - from), payload)) return 0.0;
    MotionProblem p;
    p.machine = machine_;
    p.limits = limits_of(machine_);
    p.limits.valve_fraction = kFlowShare;
    for (double& flow : p.limits.pump_max_flow) flow *= kFlowShare;
    p.payload = payload;
    p.start = from;
    p.goal = JointGoal{to};
    Eigen::MatrixXd path(2, from.size());
    path.row(0) = from;
    path.row(1) = to;
    return time_parametrise(p, path, 0.0).shortest;
  }

  simulator::Random& random() { return random_; }
  const Machine& machine() const { return machine_; }

 private:
  const Machine& machine_;
  simulator::Random random_;
  StaticForce statics_;
};

std::string posture_text(const Machine& machine, const Eigen::VectorXd& q) {
  std::string text;
  for (int k = 0; k < machine.joint_count(); ++k)
    text += fmt::format("{}{}: {:.3f}", k > 0 ? ", " : "",
                        machine.joints[static_cast<std::size_t>(k)].name, q[k]);
  return "{q: {" + text + "}}";
}

/// Goals of one scenario as YAML, or nothing where a move is too short or cannot be held.
std::string goals(Drawing& d, Eigen::VectorXd from, double payload, double usual) {
  const int moves = d.random().chance(0.7) ? 1 : d.random().chance(0.5) ? 2 : 3;
  std::string text;
  for (int g = 0; g < moves; ++g) {
    const Eigen::VectorXd to = d.posture(payload);
    const Eigen::Vector3d tip = tip_position<double>(d.machine(), to);
    const double time = d.shortest(from, to, payload);
    if (time <= 0.0 || (tip - tip_position<double>(d.machine(), from)).norm() < kLeastWay)
      return "";
    const double duration = std::max(6.0, rounded(d.random().uniform(1.3, 2.5) * time + 1.0, 0.5));
    const bool by_tip = d.random().chance(0.7);
    text +=
        by_tip
            ? fmt::format("- {{tip: [{:.4f}, {:.4f}, {:.4f}]", tip.x(), tip.y(), tip.z())
            : "- {" +
                  posture_text(d.machine(), to).substr(1, posture_text(d.machine(), to).size() - 2);
    text += fmt::format(", duration_s: {:g}", duration);
    if (g + 1 < moves) {
      // a load is put down, or taken within what the posture holds
      double next = payload > 0.0 ? 0.0 : rounded(d.random().uniform(0.2, 0.7) * usual, 10.0);
      if (!d.holds(to, next)) next = 0.0;
      if (next != payload) text += fmt::format(", payload_kg: {:g}", next);
      payload = next;
    }
    text += "}\n";
    from = to;
  }
  return text;
}

int run(int argc, char** argv) {
  std::string machine_name = "loader_crane", model = "loader_crane_plant", set = "test",
              output = ".";
  int count = 10, seed = 1;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string option = argv[i], value = argv[i + 1];
    if (option == "--machine") machine_name = value;
    if (option == "--model") model = value;
    if (option == "--set") set = value;
    if (option == "--count") count = std::stoi(value);
    if (option == "--seed") seed = std::stoi(value);
    if (option == "-o") output = value;
  }
  const Machine machine = load_machine(bundled_file("machines/" + machine_name + ".yaml"));
  const double usual = plant::usual_payload(machine);
  std::filesystem::create_directories(output);
  for (int k = 0; k < count;) {
    static std::uint64_t draw = 0;
    Drawing d(machine, static_cast<std::uint64_t>(seed) * 100000 + draw++);
    const double payload =
        d.random().chance(0.25) ? 0.0 : rounded(d.random().uniform(0.2, 0.8) * usual, 10.0);
    const Eigen::VectorXd start = d.posture(payload);
    const std::string moves = goals(d, start, payload, usual);
    if (moves.empty()) continue;
    const std::string id = fmt::format("{}_{}_{:02}", set, machine_name, ++k);
    std::ofstream file(output + "/" + id + ".yaml");
    file << fmt::format("id: {}\nset: {}\nmachine: {}\nmodel: {}\n", id, set, machine_name, model)
         << "start: " << posture_text(machine, start)
         << fmt::format("\npayload_kg: {:g}\n", payload) << "goals:\n"
         << moves << fmt::format("oil_C: {:.0f}\n", d.random().uniform(25.0, 60.0));
    if (d.random().chance(0.3)) file << "effects: [flexible_boom]\n";
    file << fmt::format("tolerance_m: 0.1\nseeds: [{}]\n", 1 + d.random().below(1000));
  }
  return 0;
}

}  // namespace
}  // namespace sparflow::bench

int main(int argc, char** argv) {
  try {
    return sparflow::bench::run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 3;
  }
}
