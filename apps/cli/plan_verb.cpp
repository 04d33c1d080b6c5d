#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/cli/console.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/plan_page.h"
#include "models/math/error.h"
#include "problems/problem_file.h"

namespace sparflow::cli {
namespace {

struct PlanArguments {
  std::string problem, output;
  SeedOptions seeds;
  Outputs outputs;
};

std::string path_csv(const Machine& machine, const std::vector<SeedPath>& paths) {
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

/// The paths as the page draws them.
PlannedPaths drawn(const Seeds& seeds) {
  PlannedPaths paths{seeds.paths.message, {}, seeds.refused};
  for (const SeedMotion& m : seeds.motions)
    paths.motions.push_back({m.name, m.motion, m.shortest_duration});
  return paths;
}

int run(const PlanArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("plan", outputs, {{"--problem", a.problem}});
  check_writable(a.output);
  a.outputs.check();
  const MotionProblem problem = load_problem(a.problem);
  for (const std::string& w : problem.machine_warnings) warn(w);
  for (const std::string& n : problem.notes) note(n);
  const Seeds seeds = [&] {
    Progress progress("plan");
    SeedOptions options = a.seeds;
    options.progress = [&](double share, const std::string& what) { progress(share, what); };
    return make_seeds(problem, options, problem.knots.value_or(100));
  }();
  nlohmann::json json = {{"message", seeds.paths.message},
                         {"solve_s", seeds.paths.solve_s},
                         {"paths", nlohmann::json::array()}};
  tell(fmt::format("{}: {}\n", problem.name, seeds.paths.message));
  if (!seeds.motions.empty())
    tell(fmt::format("  {:<18} {:>9} {:>22}  goal configuration\n", "path", "waypoints",
                     "shortest duration"));
  for (std::size_t i = 0; i < seeds.paths.paths.size(); ++i) {
    const SeedPath& path = seeds.paths.paths[i];
    const std::string name = fmt::format("{} {}", path.planner, i + 1);
    double shortest = 0.0;
    for (const SeedMotion& m : seeds.motions) {
      if (m.name == name) shortest = m.shortest_duration;
    }
    std::string posture;
    nlohmann::json end;
    for (Eigen::Index j = 0; j < path.path.cols(); ++j) {
      const Joint& joint = problem.machine.joints[static_cast<std::size_t>(j)];
      const double q = path.path(path.path.rows() - 1, j);
      const bool turns = joint.type == JointType::kRevolute;
      posture += fmt::format("{} {:.{}f} {}  ", joint.name, turns ? q * 57.29577951308232 : q,
                             turns ? 1 : 2, turns ? "deg" : "m");
      end[joint.name] = q;
    }
    tell(fmt::format(
        "  {:<18} {:>9} {:>20}    {}\n", name, path.path.rows(),
        shortest > 0.0 ? fmt::format("{:.2f} s", shortest) : std::string("cannot be driven"),
        posture));
    json["paths"].push_back({{"name", name},
                             {"planner", path.planner},
                             {"waypoints", path.path.rows()},
                             {"shortest_duration_s", shortest},
                             {"end", end}});
  }
  for (const std::string& r : seeds.refused) warn(r);
  if (!a.output.empty())
    write_file_atomically(a.output, path_csv(problem.machine, seeds.paths.paths));
  if (!a.outputs.report.empty()) plan_page(problem, drawn(seeds)).write(a.outputs.report);
  if (!a.outputs.json.empty())
    a.outputs.write_json(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  return seeds.paths.status == SeedStatus::kFound ? kDone : kNotSolved;
}

}  // namespace

void add_plan_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<PlanArguments>();
  CLI::App* verb = app.add_subcommand(
      "plan", "find collision-free paths from start to goal (OMPL); energy is not considered");
  verb->add_option("--problem,-p", a->problem, "motion problem (YAML)")
      ->required()
      ->type_name("FILE");
  verb->add_option("--output,-o", a->output, "file for the waypoints of all paths (CSV)")
      ->type_name("PATHS.csv");
  verb->add_option("--paths", a->seeds.count, "largest number of paths")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb->add_option("--seconds", a->seeds.seconds, "time for the search [s]")
      ->check(number_from(1e-3, 1e6))
      ->capture_default_str();
  verb->add_option("--seed", a->seeds.random_seed, "random seed")->capture_default_str();
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
