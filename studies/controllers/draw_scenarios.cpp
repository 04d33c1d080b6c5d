/// Draws scenarios for `sparflow benchmark` from a seed: postures, payloads, goals and times on a machine that a bundled model
/// was fitted for.
///   build/bench/draw_scenarios --machine loader_crane --model loader_crane_plant --set test --count 10 --seed 1 -o DIR
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "apps/tasks/benchmark/drawn_moves.h"
#include "models/files/machine_file.h"
#include "models/machine/kinematics.h"
#include "models/math/error.h"
#include "problems/bundled.h"

namespace sparflow::bench {
namespace {

double rounded(double x, double step) { return step * std::round(x / step); }

std::string posture_text(const Machine& machine, const Eigen::VectorXd& q) {
  std::string text;
  for (int k = 0; k < machine.joint_count(); ++k)
    text += fmt::format("{}{}: {:.3f}", k > 0 ? ", " : "",
                        machine.joints[static_cast<std::size_t>(k)].name, q[k]);
  return "{q: {" + text + "}}";
}

/// Goals of one scenario as YAML, or nothing where a move is too short or cannot be held.
std::string goals(MoveDrawing& d, Eigen::VectorXd from, double payload) {
  const int moves = d.random().chance(0.7) ? 1 : d.random().chance(0.5) ? 2 : 3;
  std::string text;
  for (int g = 0; g < moves; ++g) {
    const Eigen::VectorXd to = d.posture(payload);
    const Eigen::Vector3d tip = tip_position<double>(d.machine(), to);
    const double time = d.shortest(from, to, payload);
    if (time <= 0.0 || !d.far_apart(from, to)) return "";
    const double duration = d.duration(time);
    const bool by_tip = d.random().chance(0.7);
    text +=
        by_tip
            ? fmt::format("- {{tip: [{:.4f}, {:.4f}, {:.4f}]", tip.x(), tip.y(), tip.z())
            : "- {" +
                  posture_text(d.machine(), to).substr(1, posture_text(d.machine(), to).size() - 2);
    text += fmt::format(", duration_s: {:g}", duration);
    if (g + 1 < moves) {
      // a load is put down, or taken within what the posture holds
      double next =
          payload > 0.0 ? 0.0 : rounded(d.random().uniform(0.2, 0.7) * d.usual_payload(), 10.0);
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
  std::filesystem::create_directories(output);
  for (int k = 0; k < count;) {
    static std::uint64_t draw = 0;
    MoveDrawing d(machine, static_cast<std::uint64_t>(seed) * 100000 + draw++);
    const double payload = d.payload();
    const Eigen::VectorXd start = d.posture(payload);
    const std::string moves = goals(d, start, payload);
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
