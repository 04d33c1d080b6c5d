#include "studies/reach_tasks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "models/files/model_file.h"
#include "models/machine/kinematics.h"
#include "models/math/sha256.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

namespace sparflow::bench {
namespace {

/// Draws a reach between two random postures, or one that is infeasible on purpose (every tenth).
ReachTask random_task(const MotionProblem& base, const CraneModel& model, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  ReachTask task;
  task.model = &model;
  MotionProblem& p = task.problem;
  p = base;
  p.file.clear();
  p.obstacles.clear();
  p.tip_line.reset();
  p.idle_power = 0.0;
  p.name = fmt::format("{} random {}", base.machine.name, seed);
  const Eigen::Index n = p.start.size();
  const auto posture = [&] {
    Eigen::VectorXd q(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const Range& r = p.limits.position[static_cast<std::size_t>(j)];
      q[j] = r.lo + (0.05 + 0.9 * unit(random)) * (r.hi - r.lo);  // away from the ends of the range
    }
    return q;
  };
  p.start = posture();
  const Eigen::VectorXd end = posture();
  p.payload = std::floor(300.0 * unit(random));
  const Eigen::Vector3d tip = tip_position<double>(p.machine, end);
  p.goal = TipGoal{tip};
  Eigen::MatrixXd line(2, n);
  line << p.start.transpose(), end.transpose();
  const double reach = time_parametrise(p, line, 0.0).shortest;
  // The duration is 1.02 to 4 times that of the straight line to the posture at the goal, so the reach is feasible.
  const double duration = std::max(1.0, reach * (1.02 + 3.0 * unit(random) * unit(random)));
  p.duration = {duration, duration};
  if (seed % 10 == 0) {
    task.meant_feasible = false;
    const Eigen::Vector3d base_point = tip_position<double>(p.machine, p.start);
    if (seed % 20 == 0) {
      task.why_not = "out of reach";
      Eigen::Vector3d out = tip;
      out.x() = (out.x() < 0.0 ? -1.0 : 1.0) * (20.0 + base_point.norm());
      p.goal = TipGoal{out};
    } else {
      task.why_not = "too short a time";
      p.duration = {0.15 * reach, 0.15 * reach};
    }
  }
  return task;
}

}  // namespace

const ModelCache::Entry& ModelCache::entry(const std::string& file) {
  for (const Entry& e : entries_) {
    if (e.file == file) return e;
  }
  std::ifstream in(file, std::ios::binary);
  std::stringstream bytes;
  bytes << in.rdbuf();
  entries_.push_back({file,
                      {file.substr(file.find_last_of('/') + 1), sha256_hex(bytes.str())},
                      std::make_unique<CraneModel>(load_model(file))});
  return entries_.back();
}

std::vector<ReachTask> bundled_tasks(const std::string& only, ModelCache& models) {
  std::vector<ReachTask> tasks;
  for (const std::string& file : bundled_files("reaches", ".yaml")) {
    if (file.find(only) == std::string::npos) continue;
    // Older reaches name no model; those of the loader crane are solved with the bundled one.
    const bool of_loader_crane =
        std::filesystem::path(file).filename().string().starts_with("loader_crane");
    std::string model_file;
    ReachTask task;
    task.problem = load_problem_with(file, [&](const std::string& named) -> const Machine* {
      model_file =
          named.empty() && of_loader_crane ? bundled_file("models/loader_crane.json") : named;
      return model_file.empty() ? nullptr : &models.at(model_file).machine;
    });
    if (model_file.empty()) continue;
    task.model = &models.at(model_file);
    task.mark = models.mark_of(model_file);
    task.source = file;
    // Infeasible reaches say so in the first line of their file.
    std::ifstream in(file);
    std::string first;
    std::getline(in, first);
    task.meant_feasible = first.find("Infeasible") == std::string::npos;
    task.why_not = first;
    tasks.push_back(std::move(task));
  }
  return tasks;
}

std::vector<ReachTask> random_tasks(int count, std::uint64_t seed, ModelCache& models) {
  std::vector<ReachTask> tasks;
  tasks.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const std::uint64_t own = seed + static_cast<std::uint64_t>(i);
    const char* reach = own % 3 != 0   ? "loader_crane_fold"
                        : own % 2 != 0 ? "hmf_lift"
                                       : "swing_crane_far";
    const std::string file = bundled_file(std::string("reaches/") + reach + ".yaml");
    const MotionProblem problem = load_problem_with(
        file, [&](const std::string& named) { return &models.at(named).machine; });
    tasks.push_back(random_task(problem, models.at(problem.model_path), own));
    tasks.back().mark = models.mark_of(problem.model_path);
    tasks.back().source = file;
  }
  return tasks;
}

std::vector<std::string> files_of(const std::vector<ReachTask>& tasks, const ModelCache& models) {
  std::vector<std::string> files = models.files();
  for (const ReachTask& task : tasks) {
    if (std::find(files.begin(), files.end(), task.source) == files.end())
      files.push_back(task.source);
  }
  return files;
}

}  // namespace sparflow::bench
