#include "problems/place_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/files/file_quantities.h"
#include "models/machine/kinematics.h"
#include "models/math/units.h"
#include "problems/motion_limits.h"

namespace sparflow {
namespace {

using namespace quantities;

constexpr Quantity kTipPoint{"coordinate", "m", Sign::kAny, 1.0, 1000.0};
constexpr Quantity kStopTolerance{"distance", "m", Sign::kNonNegative, 1.0, 100.0};
constexpr Quantity kDwell{"time at rest", "s", Sign::kNonNegative, 1.0, 1e5};

/// Goals are given to a millimetre; a tenth of that counts as rounding.
constexpr double kPlaneTolerance = 1e-4;  // [m]

}  // namespace

std::vector<std::string> PlaceReader::joint_names() const {
  std::vector<std::string> names;
  for (const Joint& joint : problem_.machine.joints) names.push_back(joint.name);
  return names;
}

Eigen::VectorXd PlaceReader::posture(const YamlValue& value) const {
  const std::vector<std::string> names = joint_names();
  const std::string expected = fmt::format("a position for each joint ({})", listed(names));
  if (names.empty()) value.fail("the machine has no joints to move");
  const YamlMap map = value.map(expected, names);
  Eigen::VectorXd q(problem_.machine.joint_count());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const YamlValue entry = map.need(names[i], joint_quantity(joint(i).type, 0).expected());
    const double position = entry.number(joint_quantity(joint(i).type, 0));
    const Range& range = problem_.limits.position[i];
    if (position < range.lo || position > range.hi) {
      const bool as_degrees = revolute(i) && std::abs(position) > 7.0;
      entry.fail(fmt::format(
          "got {:g}{}, outside the joint's range [{:g}, {:g}] {}{}", position,
          revolute(i) && !as_degrees ? fmt::format(" ({:.1f} deg)", position / units::kDegree) : "",
          range.lo, range.hi, revolute(i) ? "rad" : "m",
          as_degrees ? "; angles are in rad, are these degrees?" : ""));
    }
    q[static_cast<Eigen::Index>(i)] = position;
  }
  return q;
}

Eigen::VectorXd PlaceReader::velocity(const YamlValue& value, const Eigen::VectorXd& q,
                                      double onwards) const {
  const YamlMap map = value.map("rates by joint name", joint_names());
  Eigen::VectorXd qd = Eigen::VectorXd::Zero(q.size());
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const auto i = static_cast<std::size_t>(j);
    const auto entry = map.find(joint(i).name);
    if (!entry) continue;
    qd[j] = entry->number(joint_quantity(joint(i).type, 1));
    const char* unit = revolute(i) ? "rad" : "m";
    const Range& v = problem_.limits.velocity[i];
    if (qd[j] < v.lo || qd[j] > v.hi)
      entry->fail(fmt::format("got {:g}, expected a rate within the limits [{:g}, {:g}] {}/s",
                              qd[j], v.lo, v.hi, unit));
    const Range& a = problem_.limits.acceleration[i];
    const double brake = onwards * qd[j] > 0.0 ? -a.lo : a.hi;
    const double way = 0.5 * qd[j] * std::abs(qd[j]) / std::max(brake, 1e-12);
    const Range& range = problem_.limits.position[i];
    const double there = q[j] + onwards * way;
    if (there < range.lo || there > range.hi)
      entry->fail(fmt::format(
          "got {:g}: {} {:.3g} {} within the acceleration limits, and its range ends before, at "
          "{:g}",
          qd[j], onwards > 0.0 ? "to stop from this rate takes" : "to reach this rate takes",
          std::abs(way), unit, there < range.lo ? range.lo : range.hi));
  }
  std::string limit;
  if (const double ratio = LimitRatios(problem_).speed(q, qd, &limit); ratio > 1.0)
    value.fail(fmt::format("these rates need {:.2f} times the limit of the {}", ratio, limit));
  return qd;
}

void PlaceReader::goal(const YamlValue& value) {
  const YamlMap map =
      value.map("a goal {tip: [x, y, z], angle_rad} or {q: {JOINT: position}, velocity}",
                {"tip", "angle_rad", "q", "velocity"});
  if (map.has("tip") == map.has("q")) {
    map.fail(map.has("tip") ? "gives both tip and q; keep one"
                            : "missing; expected tip: [x, y, z] or q: {JOINT: position}");
  }
  if (const auto q = map.find("q")) {
    if (const auto angle = map.find("angle_rad"))
      angle->fail("a goal posture q sets the tip's angle already; drop the one or the other");
    const Eigen::VectorXd there = posture(*q);
    problem_.goal = JointGoal{there};
    if (const auto rates = map.find("velocity"))
      problem_.goal_velocity = velocity(*rates, there, -1.0);
    return;
  }
  if (const auto rates = map.find("velocity"))
    rates->fail(
        "needs a goal with a posture q: the rates belong to one posture, and a tip "
        "leaves it free");
  const Eigen::Vector3d point = tip(*map.find("tip"));
  problem_.goal = TipGoal{point};
  if (const auto angle = map.find("angle_rad"))
    oriented_goal(*angle, {point, angle->number(kAngle)});
}

/// A stop of a cycle, or `start`.
Stop PlaceReader::stop(const YamlValue& value, std::size_t number) const {
  const std::string form =
      "a stop {tip: [x, y, z], tolerance_m} or {q: {JOINT: position}, tolerance: {JOINT: "
      "distance}} or {start: true}, with name, payload_kg, dwell_s";
  const YamlMap map = value.map(
      form, {"name", "tip", "tolerance_m", "q", "tolerance", "start", "payload_kg", "dwell_s"});
  Stop read;
  read.name = fmt::format("stop {}", number);
  if (const auto name = map.find("name")) read.name = name->text("the stop's name");
  const int places = int(map.has("tip")) + int(map.has("q")) + int(map.has("start"));
  if (places != 1)
    map.fail(places == 0 ? "missing; expected tip: [x, y, z], q: {JOINT: position} or start: true"
                         : "gives more than one of tip, q and start; keep one");
  if (const auto point = map.find("tip")) {
    TipGoal there{tip(*point)};
    there.tolerance = map.number_or("tolerance_m", kStopTolerance, 0.0);
    read.goal = there;
  } else if (const auto tolerance = map.find("tolerance_m")) {
    tolerance->fail("belongs to a stop of the tip; a posture has tolerance: {JOINT: distance}");
  }
  if (const auto q = map.find("q")) {
    read.goal = JointGoal{posture(*q), joint_tolerance(map)};
  } else if (const auto tolerance = map.find("tolerance")) {
    tolerance->fail("belongs to a stop with a posture q; a stop of the tip has tolerance_m");
  }
  if (const auto start = map.find("start")) {
    if (!start->flag()) start->fail("got false; drop the key, or write start: true");
    read.goal = JointGoal{problem_.start};
  }
  if (const auto payload = map.find("payload_kg")) read.payload = payload->number(kMass);
  read.dwell = map.number_or("dwell_s", kDwell, 0.0);
  return read;
}

Eigen::VectorXd PlaceReader::joint_tolerance(const YamlMap& map) const {
  Eigen::VectorXd tolerance;
  const auto value = map.find("tolerance");
  if (!value) return tolerance;
  const YamlMap named = value->map("a tolerance by joint name", joint_names());
  tolerance = Eigen::VectorXd::Zero(problem_.machine.joint_count());
  for (std::size_t i = 0; i < problem_.machine.joints.size(); ++i) {
    Quantity distance = joint_quantity(joint(i).type, 0);
    distance.sign = Sign::kNonNegative;
    tolerance[static_cast<Eigen::Index>(i)] = named.number_or(joint(i).name, distance, 0.0);
  }
  return tolerance;
}

void PlaceReader::cycle(const YamlValue& value) {
  std::vector<Stop> stops;
  /// Largest number of stops of a cycle, each of which is planned as a motion of its own first.
  /// @threshold [1] 1..100; chosen: some minutes
  constexpr int kMostStops = 20;
  for (const YamlValue& v : value.list("the stops of a cycle in their order", kMostStops))
    stops.push_back(stop(v, stops.size() + 1));
  if (stops.empty()) value.fail("got no stop, expected at least one");
  const Stop last = stops.back();
  stops.pop_back();
  problem_.stops = std::move(stops);
  problem_.goal = last.goal;
  problem_.goal_name = last.name;
  if (last.payload || last.dwell > 0.0)
    problem_.notes.push_back(fmt::format(
        "{}: payload_kg and dwell_s of the last stop, {}, come after the end of the motion and "
        "do not change it",
        problem_.name, last.name));
}

/// Replaces the tip goal by the nearest configuration that also has the tip's angle.
void PlaceReader::oriented_goal(const YamlValue& value, const OrientedTip& wanted) {
  if (std::abs(wanted.angle) > 7.0)
    value.fail(fmt::format("got {:g}; angles are in rad, are these degrees?", wanted.angle));
  const std::vector<Eigen::VectorXd> postures = oriented_postures(problem_, wanted);
  if (postures.empty()) {
    value.fail(fmt::format(
        "no posture within the limits puts the tip at [{:g}, {:g}, {:g}] pointing at {:.1f} deg "
        "(0: horizontal and away from the base, -90: down); at the start it points at {:.1f} deg",
        wanted.tip.x(), wanted.tip.y(), wanted.tip.z(), wanted.angle / units::kDegree,
        tip_angle(problem_.machine, problem_.start, wanted.tip) / units::kDegree));
  }
  problem_.goal = JointGoal{postures.front()};
  if (postures.size() > 1) {
    problem_.notes.push_back(fmt::format(
        "{}: more than one posture reaches the goal at that angle; the one nearest to the start "
        "is taken (goal: {{q: ...}} would choose another)",
        problem_.name));
  }
}

Eigen::Vector3d PlaceReader::tip(const YamlValue& value) const {
  const Eigen::Vector3d point = value.vector3(kTipPoint);
  const Eigen::Vector3d now = tip_position<double>(problem_.machine, problem_.start);
  const auto rounded = [](double x) { return std::abs(x) < 1e-9 ? 0.0 : x; };
  for (const Eigen::Vector3d& fixed : fixed_tip_directions(problem_.machine)) {
    const double off = fixed.dot(point - now);
    if (std::abs(off) <= kPlaneTolerance) continue;
    Eigen::Index axis = 0;
    const bool along_an_axis = fixed.cwiseAbs().maxCoeff(&axis) > 1.0 - 1e-9;
    if (along_an_axis) {
      value.fail(
          fmt::format("got {0} = {1:g}, expected {0} = {2:g}: the machine moves its tip only in "
                      "that plane",
                      "xyz"[axis], point[axis], rounded(now[axis])));
    }
    const Eigen::Vector3d nearest = point - off * fixed;
    value.fail(
        fmt::format("lies {:.4g} m off the plane the machine moves its tip in; the nearest "
                    "point of the plane is [{:.4f}, {:.4f}, {:.4f}]",
                    std::abs(off), nearest.x(), nearest.y(), nearest.z()));
  }
  return point;
}

}  // namespace sparflow
