#include "bench/motion_cases.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>

#include "identification/learning/fit.h"
#include "models/files/machine_file.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"

namespace sparflow::bench {
namespace {

double seconds_of(const rusage& usage) {
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

GaussianProcess synthetic_process(double area, bool extend, int centres, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double full_flow = 0.15 * area, force_span = 150e5 * area;
  GpParameters p;
  p.length_flow = 0.4 * full_flow;
  p.length_force = 0.4 * force_span;
  p.signal_std = 10e5;
  p.noise_std = 0.8e5;
  p.mean_constant = 15e5;
  p.mean_slope = (extend ? 1.0 : -1.0) / area;
  p.flow.resize(centres);
  p.force.resize(centres);
  p.weight.resize(centres);
  for (int i = 0; i < centres; ++i) {
    p.flow[i] = full_flow * unit(random);
    p.force[i] = force_span * (2.0 * unit(random) - 1.0);
    // The kernels add some ten bar in all, whatever their number.
    p.weight[i] = (unit(random) - 0.3) * 4e5 * (24.0 / centres) / (p.signal_std * p.signal_std);
  }
  p.flow_max = full_flow;
  p.force_min = -force_span;
  p.force_max = force_span;
  p.data_count = centres;
  return GaussianProcess(p);
}

}  // namespace

CraneModel bundled_model() {
  const Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  return fit(machine, {load_log(bundled_file("logs/loader_crane_train.csv"), machine)}).model;
}

namespace {

/// A reach without obstacles.
struct Reach {
  std::string name;
  std::vector<double> start;  ///< posture [rad] or [m]
  Eigen::Vector3d goal;       ///< of the tip [m]
  double payload = 0.0;       ///< [kg]
  double duration = 0.0;      ///< [s]
};

MotionProblem problem_of(const Reach& reach, const Machine& machine) {
  MotionProblem p;
  p.name = reach.name;
  p.machine = machine;
  p.payload = reach.payload;
  p.start = Eigen::Map<const Eigen::VectorXd>(reach.start.data(),
                                              static_cast<Eigen::Index>(reach.start.size()));
  p.goal = TipGoal{reach.goal};
  p.duration = {reach.duration, reach.duration};
  p.limits = limits_of(machine);
  return p;
}

}  // namespace

std::vector<MotionProblem> loader_crane_reaches() {
  std::vector<MotionProblem> reaches;
  reaches.reserve(6);
  for (const char* name : {"lift", "lower", "unfold"}) {
    reaches.push_back(
        load_problem(bundled_file(fmt::format("reaches/loader_crane_{}.yaml", name))));
    MotionProblem& p = reaches.back();
    if (!p.duration.fixed()) p.duration = {20.0, 20.0};
    p.idle_power = 0.0;
    p.name = name;
  }
  const Machine machine = reaches.front().machine;
  MotionProblem brisk = reaches.front();
  brisk.name = "lift, 12 s";
  brisk.duration = {12.0, 12.0};
  reaches.push_back(brisk);
  reaches.push_back(
      problem_of({"heavy, up", {0.6, -0.9, 2.0}, {6.5, 0.0, 5.0}, 800.0, 18.0}, machine));
  reaches.push_back(problem_of({"fold", {0.5, -0.4, 3.0}, {5.0, 0.0, 1.0}, 200.0, 20.0}, machine));
  return reaches;
}

MotionProblem chain_problem(int joints) {
  std::string text = "name: chain\ngravity: [0, 0, -9.81]\njoints:\n";
  std::string links = "links:\n", cylinders = "cylinders:\n", feeds;
  double length = 2.5, mass = 400.0, size = 1.0;
  const auto frame = [](int k) { return k < 0 ? std::string("base") : fmt::format("j{}", k); };
  double before = 0.0;
  for (int k = 0; k < joints; ++k) {
    const double height = k == 0 ? 2.0 : 0.0;
    text += fmt::format(
        "  - {{name: j{}, type: revolute, parent: {}, origin: {{xyz: [{:.4f}, 0, {:.4f}]}}, axis: "
        "[0, -1, 0], position: [-0.8, 0.6], velocity: [-0.15, 0.15], acceleration: [-0.4, 0.4]}}\n",
        k, frame(k - 1), before, height);
    links += fmt::format(
        "  - {{name: l{}, joint: j{}, mass: {:.2f}, cog: [{:.4f}, 0, 0], inertia: {:.3f}}}\n", k, k,
        mass, 0.5 * length, mass * length * length / 12.0);
    cylinders += fmt::format(
        "  - {{name: c{}, joint: j{}, bore: {:.4f}, rod: {:.4f}, linkage: {{type: pins, barrel: "
        "{{frame: {}, xyz: [{:.4f}, 0, {:.4f}]}}, rod: {{frame: j{}, xyz: [{:.4f}, 0, "
        "{:.4f}]}}}}}}\n",
        k, k, 0.15 * size, 0.10 * size, frame(k - 1), before - 0.4 * size, height - 1.2 * size, k,
        0.5 * size, -0.15 * size);
    feeds += fmt::format("{}c{}", k > 0 ? ", " : "", k);
    before = length;
    length *= 0.75;
    mass *= 0.7;
    size *= 0.85;
  }
  text += fmt::format("tip: {{joint: j{}, xyz: [{:.4f}, 0, 0]}}\n", joints - 1, before) + links +
          cylinders;
  text += fmt::format(
      "pumps:\n  - {{name: main, feeds: [{}], max_flow_lpm: 400, max_pressure_bar: 350, "
      "standby_bar: 22}}\n",
      feeds);
  MotionProblem p;
  p.name = fmt::format("chain of {} joints", joints);
  p.machine = parse_machine(text, p.name, ".");
  p.limits = limits_of(p.machine);
  p.start.resize(joints);
  Eigen::VectorXd goal(joints);
  for (int k = 0; k < joints; ++k) {
    p.start[k] = k % 2 == 0 ? -0.3 : 0.3;
    goal[k] = k % 2 == 0 ? 0.3 : -0.4;
  }
  p.goal = JointGoal{goal};
  p.duration = {14.0, 14.0};
  return p;
}

CraneModel synthetic_model(const Machine& machine, int centres) {
  CraneModel model = CraneModel::untrained(machine);
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    const Cylinder& c = model.machine.cylinders[i];
    CylinderModel& learned = model.cylinders[i];
    learned.margin = (6.0 + 2.0 * static_cast<double>(i)) * 1e5;
    const auto seed = static_cast<unsigned>(17 + 2 * i);
    learned.extend = synthetic_process(c.area_piston(), true, centres, seed);
    learned.retract = synthetic_process(c.area_rod(), false, centres, seed + 1);
  }
  return model;
}

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

double load_average() {
  double load = 0.0;
  return getloadavg(&load, 1) == 1 ? load : std::nan("");
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return seconds_of(usage);
}

double children_cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  return seconds_of(usage);
}

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

}  // namespace sparflow::bench
