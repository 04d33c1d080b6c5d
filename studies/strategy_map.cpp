/// Compares sequential, simultaneous and optimal motions over duration, payload, reach and idle power.
///   build/bench/strategy_map -o DIR writes strategy_map.csv, strategy_idle.csv,
/// summary.txt and strategy_map.svg.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "bench/planned_seeds.h"
#include "bench/program_options.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "optimizer/baselines/pareto.h"
#include "optimizer/solve/kept_work.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "studies/strategy_map_picture.h"

namespace sparflow {
namespace {

struct Pose {
  std::string reach;             // bundled problem
  std::vector<double> payloads;  // [kg]
};

/// Reaches with payloads: light, medium and near the limit of the pump pressure.
const std::vector<Pose>& poses() {
  static const std::vector<Pose> all = {
      {"loader_crane_lift", {0, 500, 1000}},       {"loader_crane_lower", {0, 600, 1000}},
      {"loader_crane_stretch", {0, 250, 500}},     {"loader_crane_fold", {0, 250, 500}},
      {"loader_crane_sideways", {0, 350, 700}},    {"loader_crane_far_low", {0, 150, 300}},
      {"swing_crane_side_to_side", {0, 250, 400}}, {"hmf_lift", {0, 150, 300}},
  };
  return all;
}

/// Serialises a curve without its motions for the pipe of a child process.
std::string pack_curve(const ParetoCurve& curve) {
  Packer p;
  p.number(curve.shortest).number(curve.sequential_limit).number(curve.simultaneous_limit);
  p.text(curve.message).number(static_cast<double>(curve.points.size()));
  for (const ParetoPoint& point : curve.points) {
    p.number(point.duration).number(point.sequential).number(point.simultaneous);
    p.number(point.optimal.energy.total).text(point.optimal.detail);
    const std::vector<double>& share = point.optimal.energy.share_moving;
    p.numbers(share.data(), share.size());
  }
  return p.bytes();
}

MapCurve unpack_curve(const std::string& bytes) {
  Unpacker u(bytes);
  MapCurve curve;
  curve.shortest = u.number();
  curve.sequential_limit = u.number();
  curve.simultaneous_limit = u.number();
  curve.message = u.text();
  curve.points.resize(static_cast<std::size_t>(u.number()));
  for (MapPoint& point : curve.points) {
    point.duration = u.number();
    point.sequential = u.number();
    point.simultaneous = u.number();
    point.optimal = u.number();
    point.from = u.text();
    point.share_moving = u.numbers();
  }
  return curve;
}

struct MapOptions {
  std::string folder = ".", only;
  int intervals = 80, points = 9, processes = 2, rounds = 1;
  bool ends_only = false;  ///< only the lightest and the heaviest payload
  double longest = 6.0;    ///< longest duration, as a multiple of the shortest
};

/// A curve of the map: a reach with one payload.
struct MapTask {
  std::string reach;
  double payload = 0.0;  ///< [kg]
};

std::vector<MapTask> map_tasks(const MapOptions& o) {
  std::vector<MapTask> tasks;
  for (const Pose& pose : poses()) {
    if (pose.reach.find(o.only) == std::string::npos) continue;
    for (const double payload : pose.payloads) {
      if (o.ends_only && payload != pose.payloads.front() && payload != pose.payloads.back())
        continue;
      tasks.push_back({pose.reach, payload});
    }
  }
  return tasks;
}

std::string file_of(const MapTask& task) { return bundled_file("reaches/" + task.reach + ".yaml"); }

/// Older problems name no model.
std::string model_of(const std::string& named) {
  return named.empty() ? bundled_file("models/loader_crane.json") : named;
}

/// The files on which the curves depend.
std::vector<std::string> files_of(const std::vector<MapTask>& tasks) {
  std::vector<std::string> files;
  for (const MapTask& task : tasks) {
    files.push_back(file_of(task));
    CraneModel model;
    load_problem_with(files.back(), [&](const std::string& named) {
      files.push_back(model_of(named));
      model = load_model(files.back());
      return &model.machine;
    });
  }
  return files;
}

std::string packed_curve_of(const MapTask& task, const MapOptions& o) {
  CraneModel model;
  MotionProblem problem = load_problem_with(file_of(task), [&](const std::string& named) {
    model = load_model(model_of(named));
    return &model.machine;
  });
  problem.payload = task.payload;
  ParetoOptions options;
  options.points = o.points;
  options.longest = o.longest;
  options.grid_nodes = 0;
  OptimizeOptions& optimize = options.strategies.optimize;
  optimize.intervals = o.intervals;
  optimize.processes = 1;
  optimize.search_intervals = std::min(40, o.intervals);
  optimize.sequence_rounds = o.rounds;
  optimize.mesh_error =
      1e-3;  // A single mesh suffices, because the differences of interest are larger.
  options.strategies.smooth_seeds = 1;
  options.strategies.baselines.intervals = o.intervals;
  options.strategies.baselines.polished_orders = 1;
  options.strategies.baselines.optimize = optimize;
  return pack_curve(
      energy_against_time(model, problem, bench::planned_seeds(problem, 4, o.intervals), options));
}

std::vector<MapCurve> solve_curves(const std::vector<MapTask>& tasks, const MapOptions& o,
                                   Journal& journal) {
  const auto task = [&](int i) -> const MapTask& { return tasks[static_cast<std::size_t>(i)]; };
  KeptWork work;
  work.count = static_cast<int>(tasks.size());
  work.at_once = o.processes;
  work.name = [&](int i) { return fmt::format("{} {} kg", task(i).reach, task(i).payload); };
  work.work = [&](int i) { return packed_curve_of(task(i), o); };
  const std::vector<ChildResult> results =
      run_kept(work, journal, [&](int i, int done, const ChildResult&) {
        fmt::print(stderr, "{}/{} {}\n", done, work.count, work.name(i));
      });
  std::vector<MapCurve> curves;
  for (std::size_t i = 0; i < results.size(); ++i) {
    MapCurve curve;
    if (results[i].ok) {
      curve = unpack_curve(results[i].bytes);
    } else {
      curve.message = results[i].error;
    }
    curve.reach = tasks[i].reach;
    curve.payload = tasks[i].payload;
    if (!curve.message.empty())
      fmt::print(stderr, "{} {} kg: {}\n", curve.reach, curve.payload, curve.message);
    curves.push_back(std::move(curve));
  }
  return curves;
}

int run(int argc, char** argv) {
  bench::ProgramOptions app(
      "Map of sequential, simultaneous and optimal motions over duration, payload, reach and idle "
      "power");
  MapOptions o;
  app.add("-o,--out", o.folder, "folder for the tables and the picture");
  app.add("--only", o.only, "reaches whose name contains this");
  app.add("--intervals", o.intervals, "mesh intervals").range(20, 1000);
  app.add("--points", o.points, "number of durations of each curve");
  app.add("--longest", o.longest, "longest duration, as a multiple of the shortest");
  app.add("--rounds", o.rounds, "rounds of the search over mode sequences");
  app.flag("--two-loads", o.ends_only, "only the lightest and the heaviest payload");
  app.add("--processes", o.processes, "curves in parallel");
  app.add_journal();
  if (const auto code = app.parse(argc, argv)) return *code;
  const std::vector<MapTask> tasks = map_tasks(o);
  const std::unique_ptr<Journal> journal =
      app.journal(files_of(tasks), {"--processes", "--out", "-o"});
  const std::vector<MapCurve> curves = solve_curves(tasks, o, *journal);
  std::filesystem::create_directories(o.folder);
  write_file_atomically(o.folder + "/strategy_map.csv", map_csv(curves));
  const std::vector<double> idle = {0.0, 1e3, 2e3, 5e3, 10e3, 15e3};
  write_file_atomically(o.folder + "/strategy_idle.csv", idle_csv(curves, idle));
  write_file_atomically(o.folder + "/strategy_map.svg", map_svg(curves, idle));
  const std::string summary = map_summary(curves, idle);
  write_file_atomically(o.folder + "/summary.txt", summary);
  fmt::print("{}", summary);
  journal->remove();
  return 0;
}

}  // namespace
}  // namespace sparflow

int main(int argc, char** argv) {
  return sparflow::bench::run_program("strategy_map", sparflow::run, argc, argv);
}
