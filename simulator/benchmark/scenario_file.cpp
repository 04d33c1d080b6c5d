#include "simulator/benchmark/scenario_file.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "models/files/file_quantities.h"
#include "models/files/machine_file.h"
#include "models/machine/kinematics.h"
#include "models/math/door.h"
#include "models/yaml/yaml_reader.h"
#include "simulator/plant/parameters/parameter_table.h"
#include "simulator/plant/parameters/plant_effects.h"
#include "simulator/plant/parameters/plant_file.h"

namespace sparflow::benchmark {
namespace {

namespace fs = std::filesystem;
using namespace quantities;

constexpr Quantity kTime{"duration", "s", Sign::kPositive};
constexpr Quantity kTolerance{"tolerance", "m", Sign::kPositive, 1.0, 10.0};
constexpr Quantity kTipPoint{"coordinate", "m", Sign::kAny, 1.0, 1000.0};

/// A tip off the plane of a planar machine by more is an error of the file.
/// @threshold [m] 1e-6..0.01; numerical: a tenth of a millimetre is rounding of a file
constexpr double kPlane = 1e-4;

const std::vector<std::string> kSensorKeys = {
    "position_noise", "position_step",  "pressure_noise_bar", "pressure_step_bar",
    "force_noise",    "sensor_delay_s", "drop_out_per_s"};

class ScenarioReader {
 public:
  ScenarioReader(std::string file, std::string folder, FindBundled bundled)
      : file_(std::move(file)), folder_(std::move(folder)), bundled_(std::move(bundled)) {}

  Scenario read(const std::string& text) {
    const YamlMap root =
        parse_yaml(text, file_)
            .map("a scenario: id, machine, start, goals, ...",
                 {"id", "set", "machine", "plant", "model", "effects", "start", "payload_kg",
                  "goals", "oil_C", "sensors", "seeds", "time_limit_s", "tolerance_m"});
    s_.file = file_;
    s_.id = root.need("id", "the scenario's name").name("the scenario's name");
    if (const auto set = root.find("set"))
      s_.set = set->choice({"tuning", "test"}) == 0 ? "tuning" : "test";
    s_.machine_path = path(root.need("machine", "the machine file"), "machines/", ".yaml");
    s_.machine = load_machine(s_.machine_path);
    if (s_.machine.cylinders.empty()) root.fail("the machine has no cylinder to command");
    if (const auto model = root.find("model")) s_.model_path = path(*model, "models/", ".json");
    read_plant(root);
    s_.start = read_posture(root.need("start", "the posture at the start, {q: {JOINT: position}}")
                                .map("the posture at the start, {q: {JOINT: position}}", {"q"})
                                .need("q", "a position for each joint"));
    s_.payload = root.number_or("payload_kg", kMass, 0.0);
    s_.tolerance = root.number_or("tolerance_m", kTolerance, s_.tolerance);
    double least = 0.0;
    for (const YamlValue& g : root.need("goals", "moves of the work").list("moves of the work")) {
      read_goal(g);
      least += s_.goals.back().duration;
    }
    if (s_.goals.empty()) root.fail("goals: got no move, expected one or more");
    // twice the durations, and time to come to rest
    s_.time_limit = 2.0 * least + 10.0;
    if (const auto limit = root.find("time_limit_s")) {
      s_.time_limit = limit->number(kTime);
      if (s_.time_limit < least)
        limit->fail(fmt::format("got {:g}, expected at least the sum of the goals' durations, {:g}",
                                s_.time_limit, least));
    }
    if (const auto seeds = root.find("seeds")) {
      s_.seeds.clear();
      for (const YamlValue& seed : seeds->list("numbers"))
        s_.seeds.push_back(static_cast<std::uint64_t>(seed.integer("a seed", 0)));
      if (s_.seeds.empty()) seeds->fail("got no seed, expected one or more");
    }
    return std::move(s_);
  }

 private:
  std::string path(const YamlValue& value, const std::string& folder, const std::string& end) {
    const std::string given = value.text("a file");
    const std::string beside = (fs::path(folder_) / given).lexically_normal().string();
    if (is_file(beside)) return beside;
    std::string known;
    try {
      if (bundled_) known = bundled_(folder + given + end);
    } catch (const InputError&) {  // there is none, which is said at its place below
    }
    if (known.empty())
      value.fail(
          fmt::format("there is no file {} (the path is relative to the scenario's file) "
                      "and no bundled \"{}\"",
                      beside, folder + given + end));
    return known;
  }

  void read_plant(const YamlMap& root) {
    s_.plant = plant::default_parameters(s_.machine);
    if (const auto plant = root.find("plant")) {
      s_.plant_path = path(*plant, "plants/", ".yaml");
      plant::load_plant_file(s_.plant_path, s_.machine, s_.plant);
    }
    std::vector<plant::EffectSetting> items;
    const auto effects = root.find("effects");
    if (effects) {
      for (const YamlValue& e : effects->list("effects as in `sparflow simulate --effects`")) {
        try {
          items.push_back(plant::parse_effect(e.text("an effect")));
        } catch (const UsageError& error) {
          e.fail(error.what());
        }
      }
    }
    try {
      plant::apply_effects(s_.machine, items, s_.plant);
    } catch (const UsageError& error) {
      if (!effects) throw;
      effects->fail(error.what());
    }
    if (const auto sensors = root.find("sensors")) {
      for (const auto& [key, value] : sensors->map("the sensors", kSensorKeys).entries())
        set(key, value);
    }
    if (const auto oil = root.find("oil_C")) set("oil_C", *oil);
  }

  void set(const std::string& key, const YamlValue& value) {
    const plant::ParameterRow& row = *plant::find_parameter(key);
    const std::string text(row.text), unit(row.unit);
    const double number =
        value.number({text.c_str(), unit.c_str(), Quantity::Sign::kAny, 1.0, 0.0});
    if (number < row.lowest || number > row.highest)
      value.fail(fmt::format("got {:g}, expected {} from {:g} to {:g} [{}]", number, row.text,
                             row.lowest, row.highest, row.unit));
    row.value(s_.plant, 0) = number * row.scale;
  }

  Eigen::VectorXd read_posture(const YamlValue& value) const {
    std::vector<std::string> names;
    for (const Joint& j : s_.machine.joints) names.push_back(j.name);
    const YamlMap map =
        value.map(fmt::format("a position for each joint ({})", listed(names)), names);
    Eigen::VectorXd q(s_.machine.joint_count());
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Joint& joint = s_.machine.joints[i];
      const Quantity what = joint_quantity(joint.type, 0);
      const YamlValue entry = map.need(names[i], what.expected());
      const double position = entry.number(what);
      if (position < joint.position.lo || position > joint.position.hi)
        entry.fail(fmt::format("got {:g}, outside the joint's range [{:g}, {:g}] {}", position,
                               joint.position.lo, joint.position.hi,
                               joint.type == JointType::kRevolute ? "rad" : "m"));
      q[static_cast<Eigen::Index>(i)] = position;
    }
    return q;
  }

  void read_goal(const YamlValue& value) {
    const YamlMap map = value.map("a move {tip: [x, y, z] or q: {...}, duration_s, payload_kg}",
                                  {"tip", "q", "duration_s", "payload_kg"});
    if (map.has("tip") == map.has("q"))
      map.fail(map.has("tip") ? "gives both tip and q; keep one"
                              : "missing; expected tip: [x, y, z] or q: {JOINT: position}");
    ScenarioGoal goal;
    if (const auto q = map.find("q")) {
      goal.q = read_posture(*q);
      goal.tip = tip_position<double>(s_.machine, *goal.q);
    } else {
      goal.tip = map.find("tip")->vector3(kTipPoint);
      check_plane(*map.find("tip"), goal.tip);
    }
    goal.duration = map.need_number("duration_s", kTime);
    if (const auto payload = map.find("payload_kg")) goal.payload = payload->number(kMass);
    s_.goals.push_back(goal);
  }

  /// A planar machine's tip stays in its plane.
  void check_plane(const YamlValue& value, const Eigen::Vector3d& tip) const {
    const Eigen::Vector3d now = tip_position<double>(s_.machine, s_.start);
    Eigen::Matrix3d moves = Eigen::Matrix3d::Zero();
    for (const double share : {0.3, 0.55, 0.8}) {  // three postures, as one may be singular
      Eigen::VectorXd q = s_.start;
      for (Eigen::Index k = 0; k < q.size(); ++k) {
        const Range r = s_.machine.joints[static_cast<std::size_t>(k)].position;
        q[k] = r.lo + share * (r.hi - r.lo);
      }
      const Eigen::Matrix3Xd j =
          point_jacobian_matrix(s_.machine, q, s_.machine.tip.joint, s_.machine.tip.xyz);
      moves += j * j.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> e(moves);
    for (int k = 0; k < 3; ++k) {
      if (e.eigenvalues()[k] > 1e-9 * e.eigenvalues()[2]) continue;
      const double off = e.eigenvectors().col(k).dot(tip - now);
      if (std::abs(off) <= kPlane) continue;
      const Eigen::Vector3d nearest = tip - off * e.eigenvectors().col(k);
      value.fail(
          fmt::format("lies {:.4g} m off the plane the machine moves its tip in; the "
                      "nearest point of the plane is [{:.4f}, {:.4f}, {:.4f}]",
                      std::abs(off), nearest.x(), nearest.y(), nearest.z()));
    }
  }

  std::string file_, folder_;
  FindBundled bundled_;
  Scenario s_;
};

}  // namespace

Scenario load_scenario(const std::string& path, const FindBundled& bundled) {
  return parse_scenario(read_file(path), path, fs::path(path).parent_path().string(), bundled);
}

Scenario parse_scenario(const std::string& text, const std::string& name, const std::string& folder,
                        const FindBundled& bundled) {
  return ScenarioReader(name, folder, bundled).read(text);
}

}  // namespace sparflow::benchmark
