#include "problems/problem_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <limits>

#include "models/files/file_quantities.h"
#include "models/files/machine_file.h"
#include "models/math/door.h"
#include "models/math/units.h"
#include "models/yaml/yaml_reader.h"
#include "problems/bundled.h"
#include "problems/motion_limits.h"
#include "problems/obstacle_file.h"
#include "problems/place_file.h"

namespace sparflow {
namespace {

namespace fs = std::filesystem;
using namespace quantities;

constexpr Quantity kDistance{"distance", "m", Sign::kNonNegative, 1.0, 100.0};
constexpr Quantity kTolerance{"tolerance", "m", Sign::kPositive, 1.0, 100.0};
constexpr Quantity kCable{"length of the rope", "m", Sign::kPositive, 1.0, 200.0};
constexpr Quantity kDegrees{"angle", "deg", Sign::kPositive, units::kDegree, 0.0};
constexpr Quantity kTime{"duration", "s", Sign::kPositive};
constexpr Quantity kPower{"power", "W", Sign::kNonNegative};
constexpr Quantity kFraction{"share of the full flow", "", Sign::kPositive};
constexpr Quantity kLeastFraction{"share of the full flow", "", Sign::kNonNegative};
constexpr Quantity kWeight{"weight", "", Sign::kNonNegative};

class ProblemReader {
 public:
  ProblemReader(std::string file, std::string folder)
      : file_(std::move(file)), folder_(std::move(folder)) {}

  MotionProblem read(const std::string& text, const ChooseMachine& choose) {
    const YamlMap root =
        parse_yaml(text, file_)
            .map("a motion problem: machine, start, goal, duration_s, ...",
                 {"name", "machine", "model", "payload_kg", "start", "goal", "cycle", "waypoints",
                  "duration_s", "idle_power_W", "limits", "obstacles", "clearance_m", "path",
                  "sway", "objective", "knots"});
    problem_.file = file_;
    problem_.name = fs::path(file_).stem().string();
    if (const auto name = root.find("name")) problem_.name = name->text("the problem's name");
    read_machine(root, choose);
    problem_.limits = limits_of(problem_.machine);
    if (const auto limits = root.find("limits")) read_limits(*limits);
    problem_.payload = root.number_or("payload_kg", kMass, 0.0);

    PlaceReader places(problem_);
    const std::string start = "the posture at the start, {q: {JOINT: position}, velocity}";
    const YamlMap first = root.need("start", start).map(start, {"q", "velocity"});
    problem_.start = places.posture(first.need("q", start));
    if (const auto velocity = first.find("velocity"))
      problem_.start_velocity = places.velocity(*velocity, problem_.start, 1.0);
    if (const auto cycle = root.find("cycle")) {
      if (const auto goal = root.find("goal"))
        goal->fail("a cycle ends at its last stop; drop the one or the other");
      if (moves_at_an_end(problem_))
        first.find("velocity")->fail("a cycle begins at rest; drop the one or the other");
      places.cycle(*cycle);
    } else {
      places.goal(root.need("goal", "where the motion ends, {tip: [x, y, z]} or {q: {...}}"));
    }
    if (const auto waypoints = root.find("waypoints")) {
      const std::string form = "a point the tip passes, {tip: [x, y, z]}";
      for (const YamlValue& v : waypoints->list("points the tip passes on the way"))
        problem_.waypoints.push_back(places.tip(v.map(form, {"tip"}).need("tip", form)));
    }
    if (const auto waypoints = root.find("waypoints"); waypoints && !problem_.stops.empty())
      waypoints->fail("a cycle has stops and no waypoints; drop the one or the other");
    if (const auto sway = root.find("sway")) read_sway(*sway);
    problem_.idle_power = root.number_or("idle_power_W", kPower, 0.0);
    if (const auto objective = root.find("objective")) read_objective(*objective);
    read_duration(root.need("duration_s", "seconds, {min, max} or free"));
    if (const auto obstacles = root.find("obstacles")) {
      for (const YamlValue& v : obstacles->list("obstacles")) {
        problem_.obstacles.push_back(
            read_obstacle(v, static_cast<int>(problem_.obstacles.size()) + 1));
      }
    }
    problem_.clearance = root.number_or("clearance_m", kDistance, 0.0);
    if (const auto path = root.find("path")) {
      read_path(*path);
      if (problem_.tip_line && !problem_.stops.empty())
        path->fail("a cycle has no straight line of the tip; drop the one or the other");
      if (problem_.tip_line && !problem_.waypoints.empty())
        path->fail(
            "a tip on one straight line cannot pass waypoints as well; drop the one or the other");
    }
    if (const auto knots = root.find("knots")) {
      problem_.knots = knots->integer("the number of knots", 4);
    }
    return problem_;
  }

 private:
  /// Path relative to the problem file's folder.
  std::string resolved(const std::string& given) const {
    return (fs::path(folder_) / given).lexically_normal().string();
  }

  void read_machine(const YamlMap& root, const ChooseMachine& choose) {
    if (const auto model = root.find("model")) {
      problem_.model_path = resolved(model->text("the fitted model's file"));
      if (!is_file(problem_.model_path)) {
        model->fail(fmt::format("there is no file {}; the path is relative to the problem file",
                                problem_.model_path));
      }
    }
    if (const Machine* machine = choose(problem_.model_path); machine != nullptr) {
      if (const auto own = root.find("machine")) {
        problem_.machine_path = machine_file_of(own->text("the machine file"));
        require_same_joints(*own, *machine);
      }
      problem_.machine = *machine;
      return;
    }
    const YamlValue value = root.need("machine", "the machine file");
    const std::string given = value.text("the machine file");
    problem_.machine_path = machine_file_of(given);
    if (problem_.machine_path.empty()) {
      value.fail(
          fmt::format("there is no file {} (the path is relative to the problem file) and no "
                      "bundled machine \"{}\"",
                      resolved(given), given));
    }
    problem_.machine = load_machine(problem_.machine_path, &problem_.machine_warnings);
  }

  /// @param machine that of the model, @param own the problem's own machine file, which a model replaces
  void require_same_joints(const YamlValue& own, const Machine& machine) const {
    if (problem_.machine_path.empty()) return;
    const std::vector<std::string> here = joint_names(load_machine(problem_.machine_path)),
                                   there = joint_names(machine);
    if (here == there) return;
    own.fail(
        fmt::format("the problem is for a machine with the joints {}, the model is of {} with the "
                    "joints {}; give a model of the problem's machine",
                    listed(here), machine.name, listed(there)));
  }

  /// Path of a machine file beside the problem, or of the bundled machine of that name; empty: there is neither.
  std::string machine_file_of(const std::string& given) const {
    const std::string beside = resolved(given);
    return is_file(beside) ? beside : bundled_machine(given);
  }

  static std::string bundled_machine(const std::string& name) {
    try {
      return bundled_file("machines/" + name + ".yaml");
    } catch (const InputError&) {
      return "";
    }
  }

  static std::vector<std::string> joint_names(const Machine& machine) {
    std::vector<std::string> names;
    for (const Joint& joint : machine.joints) names.push_back(joint.name);
    return names;
  }

  const Joint& joint(std::size_t i) const { return problem_.machine.joints[i]; }

  Quantity position_of(std::size_t i) const { return joint_quantity(joint(i).type, 0); }

  void read_sway(const YamlValue& value) {
    const YamlMap map = value.map("limits of the load's sway {limit_deg, cable_m, end_limit_deg}",
                                  {"limit_deg", "cable_m", "end_limit_deg"});
    const auto angle = [&](const char* key) {
      const YamlValue v = map.need(key, "an angle [deg]");
      const double read = v.number(kDegrees);
      /// Largest angle that a limit of the sway may be.
      /// @threshold [deg] 1..60; chosen: beyond it a rope is no longer a pendulum that hangs
      constexpr double kMost = 45.0;
      if (read > kMost * units::kDegree)
        v.fail(fmt::format("got {:g} deg, expected at most {:g}", read / units::kDegree, kMost));
      return read;
    };
    SwayLimit sway;
    sway.limit = angle("limit_deg");
    sway.cable = map.need_number("cable_m", kCable);
    sway.end_limit = map.has("end_limit_deg") ? angle("end_limit_deg") : sway.limit;
    if (sway.end_limit > sway.limit)
      map.find("end_limit_deg")->fail("is larger than limit_deg, which holds at the end as well");
    if (problem_.machine.gravity.norm() <= 0.0)
      value.fail("without gravity no load hangs; drop the key, or give the machine gravity");
    problem_.sway = sway;
  }

  void read_duration(const YamlValue& value) {
    const std::string expected = "a duration [s], {min, max} or free";
    if (value.is_map()) {
      const YamlMap map = value.map(expected, {"min", "max"});
      problem_.duration = {map.need_number("min", kTime), map.need_number("max", kTime)};
      if (problem_.duration.min > problem_.duration.max) {
        value.fail(fmt::format("got min {:g} above max {:g}; swap the two", problem_.duration.min,
                               problem_.duration.max));
      }
      return;
    }
    if (value.word() == "free") {
      if (problem_.idle_power <= 0.0 && problem_.objective.time <= 0.0) {
        value.fail(
            "got free, but idle_power_W is zero: slower is then always cheaper and no best "
            "duration "
            "exists; give idle_power_W, the engine's power while time passes, or {min, max}");
      }
      problem_.duration = {0.0, std::numeric_limits<double>::infinity()};
      return;
    }
    if (value.is_list() || value.word().find_first_of("0123456789.") == std::string::npos) {
      value.fail_expected(expected);
    }
    problem_.duration.min = problem_.duration.max = value.number(kTime);
  }

  void read_limits(const YamlValue& value) {
    const YamlMap map = value.map(
        "limits {joints, pumps, valve_fraction, valve_least_fraction, pressure_std_bar}",
        {"joints", "pumps", "valve_fraction", "valve_least_fraction", "pressure_std_bar"});
    problem_.limits.pressure_std = map.number_or("pressure_std_bar", kPressure, 0.0);
    if (const auto joints = map.find("joints")) {
      const YamlMap named = joints->map("limits by joint name", joint_names(problem_.machine));
      for (std::size_t i = 0; i < problem_.machine.joints.size(); ++i) {
        if (const auto entry = named.find(joint(i).name)) read_joint_limits(*entry, i);
      }
    }
    if (const auto pumps = map.find("pumps")) read_pump_limits(*pumps);
    if (const auto fraction = map.find("valve_fraction")) {
      problem_.limits.valve_fraction = fraction->number(kFraction);
      if (problem_.limits.valve_fraction > 1.0) {
        fraction->fail(fmt::format("got {:g}, expected at most 1, the valve's full flow",
                                   problem_.limits.valve_fraction));
      }
    }
    if (const auto least = map.find("valve_least_fraction")) {
      problem_.limits.valve_least_fraction = least->number(kLeastFraction);
      if (problem_.limits.valve_least_fraction >= problem_.limits.valve_fraction) {
        least->fail(fmt::format(
            "got {:g}, expected less than valve_fraction, {:g}: else no flow is left to the valve",
            problem_.limits.valve_least_fraction, problem_.limits.valve_fraction));
      }
    }
  }

  void read_joint_limits(const YamlValue& value, std::size_t i) {
    const YamlMap map = value.map("limits {position, velocity, acceleration}",
                                  {"position", "velocity", "acceleration"});
    if (const auto position = map.find("position")) {
      const Range given = position->range(position_of(i));
      const Range& machine = joint(i).position;
      if (given.lo < machine.lo || given.hi > machine.hi) {
        position->fail(
            fmt::format("got [{:g}, {:g}], expected a part of the machine's own range "
                        "[{:g}, {:g}]",
                        given.lo, given.hi, machine.lo, machine.hi));
      }
      problem_.limits.position[i] = given;
    }
    if (const auto velocity = map.find("velocity")) {
      problem_.limits.velocity[i] =
          read_range_around_zero(*velocity, joint_quantity(joint(i).type, 1));
    }
    if (const auto acceleration = map.find("acceleration")) {
      problem_.limits.acceleration[i] =
          read_range_around_zero(*acceleration, joint_quantity(joint(i).type, 2));
    }
  }

  void read_pump_limits(const YamlValue& value) {
    std::vector<std::string> names;
    for (const Pump& pump : problem_.machine.pumps) names.push_back(pump.name);
    if (names.empty()) value.fail("the machine has no pumps");
    const YamlMap named = value.map("limits by pump name", names);
    for (std::size_t p = 0; p < names.size(); ++p) {
      const auto entry = named.find(names[p]);
      if (!entry) continue;
      const YamlMap map = entry->map("limits {max_flow_lpm, max_pressure_bar}",
                                     {"max_flow_lpm", "max_pressure_bar"});
      MotionLimits& limits = problem_.limits;
      limits.pump_max_flow[p] = map.number_or("max_flow_lpm", kFlow, limits.pump_max_flow[p]);
      limits.pump_max_pressure[p] =
          map.number_or("max_pressure_bar", kPressure, limits.pump_max_pressure[p]);
    }
  }

  void read_path(const YamlValue& value) {
    const YamlMap map =
        value.map("a path {tip_line: true, tolerance_m}", {"tip_line", "tolerance_m"});
    const bool line = map.need("tip_line", "true or false").flag();
    if (const auto tolerance = map.find("tolerance_m")) tolerance->number(kTolerance);
    if (line) problem_.tip_line = TipLine{map.need_number("tolerance_m", kTolerance)};
  }

  void read_objective(const YamlValue& value) {
    const YamlMap map = value.map("weights {energy, time_W, commands_W, smoothness}",
                                  {"energy", "time_W", "commands_W", "smoothness"});
    ObjectiveWeights& weights = problem_.objective;
    weights.energy = map.number_or("energy", kWeight, 1.0);
    weights.time = map.number_or("time_W", kWeight, 0.0);
    weights.commands = map.number_or("commands_W", kWeight, 0.0);
    if (const auto smoothness = map.find("smoothness")) {
      weights.smoothness = smoothness->number(kWeight);
    }
    const double sum =
        weights.energy + weights.time + weights.commands + weights.smoothness.value_or(0.0);
    if (sum == 0.0) {
      value.fail(
          "both weights are zero, so every motion is as good; give energy or smoothness a "
          "positive weight");
    }
  }

  std::string file_, folder_;
  MotionProblem problem_;
};

}  // namespace

MotionProblem parse_problem(const std::string& text, const std::string& name,
                            const std::string& folder, const Machine* machine) {
  return ProblemReader(name, folder).read(text, [=](const std::string&) { return machine; });
}

MotionProblem load_problem(const std::string& path, const Machine* machine) {
  return load_problem_with(path, [=](const std::string&) { return machine; });
}

MotionProblem load_problem_with(const std::string& path, const ChooseMachine& choose) {
  return ProblemReader(path, fs::path(path).parent_path().string()).read(read_file(path), choose);
}

}  // namespace sparflow
