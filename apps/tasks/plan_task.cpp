#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/tasks/argument_range.h"
#include "apps/tasks/motion_inputs.h"

namespace sparflow {
namespace {

/// Shortest duration of a path [s]; 0: the limits do not allow it to be driven.
double shortest_of(const Seeds& seeds, const std::string& name) {
  for (const SeedMotion& m : seeds.motions) {
    if (m.name == name) return m.shortest_duration;
  }
  return 0.0;
}

std::string name_of(const Seeds& seeds, std::size_t path) {
  return fmt::format("{} {}", seeds.paths.paths[path].planner, path + 1);
}

}  // namespace

Seeds plan_task(const MotionProblem& problem, SeedOptions options, const Listener& listener) {
  require_range("plan: --paths", options.count, 1, 64);
  require_range("plan: --seconds", options.seconds, 1e-3, 1e6);
  options.progress = listener.progress;
  require_one_move("plan", problem);
  return make_seeds(problem, options, problem.knots.value_or(100));
}

PlannedPaths drawn_paths(const Seeds& seeds) {
  PlannedPaths paths{seeds.paths.message, {}, seeds.refused};
  for (const SeedMotion& m : seeds.motions)
    paths.motions.push_back({m.name, m.motion, m.shortest_duration});
  return paths;
}

std::string plan_csv(const Machine& machine, const std::vector<SeedPath>& paths) {
  std::string text = "path,planner,waypoint";
  for (const Joint& j : machine.joints)
    text += fmt::format(",q_{}_{}", j.name, j.type == JointType::kRevolute ? "rad" : "m");
  text += "\n";
  for (std::size_t p = 0; p < paths.size(); ++p) {
    for (Eigen::Index w = 0; w < paths[p].path.rows(); ++w) {
      text += fmt::format("{},{},{}", p + 1, paths[p].planner, w + 1);
      for (Eigen::Index j = 0; j < paths[p].path.cols(); ++j)
        text += fmt::format(",{:.9g}", paths[p].path(w, j));
      text += "\n";
    }
  }
  return text;
}

std::string plan_json(const MotionProblem& problem, const Seeds& seeds) {
  nlohmann::json json = {{"message", seeds.paths.message},
                         {"solve_s", seeds.paths.solve_s},
                         {"paths", nlohmann::json::array()}};
  for (std::size_t i = 0; i < seeds.paths.paths.size(); ++i) {
    const SeedPath& path = seeds.paths.paths[i];
    const std::string name = name_of(seeds, i);
    nlohmann::json end;
    for (Eigen::Index j = 0; j < path.path.cols(); ++j) {
      end[problem.machine.joints[static_cast<std::size_t>(j)].name] =
          path.path(path.path.rows() - 1, j);
    }
    json["paths"].push_back({{"name", name},
                             {"planner", path.planner},
                             {"waypoints", path.path.rows()},
                             {"shortest_duration_s", shortest_of(seeds, name)},
                             {"end", end}});
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string plan_table(const MotionProblem& problem, const Seeds& seeds) {
  std::string text = fmt::format("{}: {}\n", problem.name, seeds.paths.message);
  if (!seeds.motions.empty()) {
    text += fmt::format("  {:<18} {:>9} {:>22}  goal configuration\n", "path", "waypoints",
                        "shortest duration");
  }
  for (std::size_t i = 0; i < seeds.paths.paths.size(); ++i) {
    const SeedPath& path = seeds.paths.paths[i];
    const std::string name = name_of(seeds, i);
    const double shortest = shortest_of(seeds, name);
    std::string posture;
    for (Eigen::Index j = 0; j < path.path.cols(); ++j) {
      const Joint& joint = problem.machine.joints[static_cast<std::size_t>(j)];
      const double q = path.path(path.path.rows() - 1, j);
      const bool turns = joint.type == JointType::kRevolute;
      posture += fmt::format("{} {:.{}f} {}  ", joint.name, turns ? q * 57.29577951308232 : q,
                             turns ? 1 : 2, turns ? "deg" : "m");
    }
    text += fmt::format(
        "  {:<18} {:>9} {:>20}    {}\n", name, path.path.rows(),
        shortest > 0.0 ? fmt::format("{:.2f} s", shortest) : std::string("cannot be driven"),
        posture);
  }
  return text;
}

}  // namespace sparflow
