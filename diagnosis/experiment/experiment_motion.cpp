// The list of motions, and a synthetic log of each on the machine.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "diagnosis/experiment/experiment.h"
#include "models/chain/pump_law.h"
#include "models/machine/static_force.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// [-] Peak acceleration of a half cosine, by way over time squared: pi^2 / 2, rounded up.
constexpr double kHalfCosinePeak = 4.94;
constexpr double kFewestSamplesOfALeg = 4.0;  ///< samples that a leg takes at least
constexpr double kMoving = 1e-7;              ///< [m/s] a smaller speed is rounding

double middle(const Joint& j, double share) {
  return j.position.lo + share * (j.position.hi - j.position.lo);
}

/// Progress along a leg, 0..1: a half cosine, or a trapezoidal speed with ramps of `rise` of the time.
double progress(double t, bool steps, double rise) {
  t = std::clamp(t, 0.0, 1.0);
  if (!steps) return 0.5 * (1.0 - std::cos(std::numbers::pi * t));
  const double top = 1.0 / (1.0 - rise);
  if (t < rise) return 0.5 * top * t * t / rise;
  if (t > 1.0 - rise) return 1.0 - 0.5 * top * (1.0 - t) * (1.0 - t) / rise;
  return top * (t - 0.5 * rise);
}

/// Flow of a cylinder's valve at full command. [m^3/s]
double full_flow(const CraneModel& model, int cylinder, bool extend, const MotionOptions& options) {
  const CylinderModel& c = model.cylinders[static_cast<std::size_t>(cylinder)];
  const double learned = extend ? c.valve_gain_extend : c.valve_gain_retract;
  if (learned > 0.0) return learned;
  for (const Valve& v : model.machine.valves) {
    if (v.cylinder == cylinder) return extend ? v.max_flow_extend : v.max_flow_retract;
  }
  return options.unknown_valve_flow;
}

/// Mean joint speed that limits, valve and pump allow when `count` joints move together. [rad/s, m/s]
double fastest(const CraneModel& model, int joint, std::size_t count,
               const MotionOptions& options) {
  const Machine& m = model.machine;
  const auto at = static_cast<std::size_t>(joint);
  double speed = std::min(std::abs(m.joints[at].velocity.lo), std::abs(m.joints[at].velocity.hi));
  VectorXd q(m.joint_count());
  for (int j = 0; j < m.joint_count(); ++j)
    q[j] = middle(m.joints[static_cast<std::size_t>(j)], 0.5);
  StaticForce statics(m);
  for (int i = 0; i < m.cylinder_count(); ++i) {
    const Cylinder& c = m.cylinders[static_cast<std::size_t>(i)];
    if (c.joint != joint || !c.hydraulic()) continue;
    double flow = std::min(full_flow(model, i, true, options), full_flow(model, i, false, options));
    const int pump = m.pump_of_cylinder(i);
    if (pump >= 0 && m.pumps[static_cast<std::size_t>(pump)].max_flow > 0.0)
      flow = std::min(
          flow, m.pumps[static_cast<std::size_t>(pump)].max_flow / static_cast<double>(count));
    for (const double share : {options.low, 0.5, options.high}) {
      q[joint] = middle(m.joints[at], share);
      try {
        statics.update(q.data(), 0.0, 0);
      } catch (const std::domain_error&) {
        continue;  // a four-bar that cannot close with the others in the middle
      }
      const double rate = std::abs(statics.length(i).d1);
      if (rate > 0.0) speed = std::min(speed, options.flow_share * flow / (c.area_piston() * rate));
    }
  }
  return speed * 2.0 / std::numbers::pi;  // mean of a half sine with that peak
}

std::vector<MotionLeg> up_and_down(const std::vector<int>& joints,
                                   const std::vector<double>& speeds,
                                   const std::vector<double>& payloads,
                                   const MotionOptions& options) {
  std::vector<MotionLeg> legs;
  for (const double payload : payloads) {
    for (const double speed : speeds) {
      legs.push_back({joints, options.high, speed, 1.0, payload});
      legs.push_back({joints, options.low, speed, 1.0, payload});
    }
  }
  return legs;
}

/// What is driven, before the machine answers.
struct DrivenMotion {
  Eigen::MatrixXd q;  ///< [samples x joints]
  VectorXd payload;   ///< [samples] [kg]
};

/// How long a leg takes by the limits of its joints, valves and pumps. [s]
/// @param here, goal joint positions at its ends
double leg_seconds(const CraneModel& model, const MotionLeg& leg, const VectorXd& here,
                   const VectorXd& goal, const MotionOptions& options) {
  const Machine& m = model.machine;
  double seconds = 0.0;
  for (const int j : leg.joints) {
    const auto at = static_cast<std::size_t>(j);
    const double mean = leg.speed * fastest(model, j, leg.joints.size(), options);
    const double way = std::abs(goal[j] - here[j]);
    const double brake =
        std::min(std::abs(m.joints[at].acceleration.lo), std::abs(m.joints[at].acceleration.hi));
    seconds = std::max(seconds, way / std::max(mean, 1e-9));
    if (brake > 0.0) seconds = std::max(seconds, std::sqrt(way * kHalfCosinePeak / brake));
  }
  return seconds;
}

/// The recipe's legs in turn from the middle of all ranges. @param step [s]  @param n samples
DrivenMotion drive(const CraneModel& model, const MotionRecipe& recipe, double step, Index n,
                   const MotionOptions& options) {
  const Machine& m = model.machine;
  const auto joints = static_cast<Index>(m.joint_count());
  DrivenMotion out{Eigen::MatrixXd(n, joints), VectorXd(n)};
  VectorXd here(joints), goal(joints);
  for (Index j = 0; j < joints; ++j) here[j] = middle(m.joints[static_cast<std::size_t>(j)], 0.5);
  Index k = 0;
  const auto pause = [&](double seconds, double load) {
    for (double t = 0.0; t < seconds && k < n; t += step, ++k) {
      out.q.row(k) = here;
      out.payload[k] = load;
    }
  };
  pause(0.5, recipe.legs.front().payload);
  for (std::size_t turn = 0; k < n; ++turn) {
    const MotionLeg& leg = recipe.legs[turn % recipe.legs.size()];
    goal = here;
    for (const int j : leg.joints) goal[j] = middle(m.joints[static_cast<std::size_t>(j)], leg.to);
    const double seconds =
        std::max(kFewestSamplesOfALeg * step, leg_seconds(model, leg, here, goal, options));
    const double rise =
        std::clamp(options.ramp / seconds, options.shortest_ramp, options.longest_ramp);
    for (double t = 0.0; t < seconds && k < n; t += step, ++k) {
      out.q.row(k) = here + progress(t / seconds, recipe.steps, rise) * (goal - here);
      out.payload[k] = leg.payload;
    }
    here = goal;
    pause(leg.pause, leg.payload);
  }
  return out;
}

/// Static answer of the machine to a motion. [samples x cylinders]
struct StaticAnswer {
  Eigen::MatrixXd length;  ///< [m] pin to pin
  Eigen::MatrixXd force;   ///< [N]
};

StaticAnswer static_answer(const Machine& m, const DrivenMotion& driven) {
  const Index n = driven.q.rows();
  StaticAnswer out{Eigen::MatrixXd(n, m.cylinder_count()), Eigen::MatrixXd(n, m.cylinder_count())};
  StaticForce statics(m);
  VectorXd pose(m.joint_count());
  for (Index i = 0; i < n; ++i) {
    pose = driven.q.row(i);
    statics.update(pose.data(), driven.payload[i], 0);
    out.force.row(i) = statics.force();
    for (int c = 0; c < m.cylinder_count(); ++c) out.length(i, c) = statics.length(c).value;
  }
  return out;
}

/// Speed of a cylinder from its lengths, by central differences inside and one-sided ones at the ends. [m/s]
VectorXd speed_of(const Eigen::MatrixXd& length, Index cylinder, double step) {
  const Index n = length.rows();
  VectorXd v(n);
  for (Index i = 0; i < n; ++i) {
    const Index before = std::max<Index>(0, i - 1), after = std::min<Index>(n - 1, i + 1);
    v[i] = (length(after, cylinder) - length(before, cylinder)) /
           (step * static_cast<double>(std::max<Index>(1, after - before)));
  }
  return v;
}

/// Pressures in the filled and in the emptied chamber. [Pa]
struct ChamberPressures {
  double supply = 0.0, back = 0.0;
};

/// @param force of the cylinder [N]  @param v its speed [m/s]
ChamberPressures chamber_pressures(const Cylinder& cylinder, double force, double v,
                                   const MotionOptions& options) {
  const bool extends = v >= 0.0;
  const double a = cylinder.area_piston(), b = cylinder.area_rod();
  const double supply_area = extends ? a : b, return_area = extends ? b : a;
  const double back_flow = return_area * std::abs(v);
  // the return line sets the return pressure unless a valve must hold an overrunning load
  ChamberPressures p;
  p.back = options.return_pressure + options.return_loss * back_flow * back_flow;
  const double load = extends ? force : -force;  // against the motion
  p.supply = (load + p.back * return_area) / supply_area;
  if (p.supply < options.least_supply) {
    p.supply = options.least_supply;
    p.back = (p.supply * supply_area - load) / return_area;
  }
  return p;
}

void add_channel(Log& log, Role role, int index, const std::string& signal,
                 const VectorXd& values) {
  Channel c;
  c.column = c.signal = signal;
  c.role = role;
  c.index = index;
  c.values = values;
  c.valid = values.array().isFinite();
  log.channels.push_back(std::move(c));
}

/// The log of a motion as its channels are added, with the largest demand on each pump so far.
struct MotionLog {
  Log log;
  Eigen::MatrixXd demand;  ///< [samples x pumps] [Pa]
};

/// Adds command and chamber pressures of a cylinder, or its force where it has no chambers.
void add_cylinder(const CraneModel& model, int index, const StaticAnswer& answer,
                  const MotionOptions& options, MotionLog& out) {
  const Machine& m = model.machine;
  const Cylinder& cylinder = m.cylinders[static_cast<std::size_t>(index)];
  const VectorXd v = speed_of(answer.length, index, out.log.step);
  const Index n = v.size();
  VectorXd u = VectorXd::Zero(n), pa(n), pb(n);
  for (Index i = 0; i < n; ++i) {
    const bool extends = v[i] >= 0.0, moves = std::abs(v[i]) > kMoving;
    const double side = extends ? 1.0 : -1.0;
    if (!cylinder.hydraulic()) {
      u[i] = moves ? side : 0.0;
      continue;
    }
    const double flow = (extends ? cylinder.area_piston() : cylinder.area_rod()) * std::abs(v[i]);
    if (moves) u[i] = side * flow / full_flow(model, index, extends, options);
    const ChamberPressures p = chamber_pressures(cylinder, answer.force(i, index), v[i], options);
    pa[i] = extends ? p.supply : p.back;
    pb[i] = extends ? p.back : p.supply;
    const int pump = m.pump_of_cylinder(index);
    if (moves && pump >= 0)
      out.demand(i, pump) = pump_pressure(
          out.demand(i, pump), p.supply + model.cylinders[static_cast<std::size_t>(index)].margin);
  }
  add_channel(out.log, Role::kCommand, index, "u_" + cylinder.name, u);
  if (cylinder.hydraulic()) {
    add_channel(out.log, Role::kPressureA, index, "pA_" + cylinder.name, pa);
    add_channel(out.log, Role::kPressureB, index, "pB_" + cylinder.name, pb);
  } else {
    add_channel(out.log, Role::kForce, index, "force_" + cylinder.name, answer.force.col(index));
  }
}

}  // namespace

std::vector<MotionRecipe> motion_menu(const Machine& machine, double heaviest,
                                      const MotionOptions& options) {
  std::vector<MotionRecipe> menu;
  std::vector<int> all;
  const auto at_two_loads = [&](const std::string& name) {
    return fmt::format(
        "{} up and down at a quarter of its speed, once with no load and once with "
        "about {:.0f} kg",
        name, heaviest);
  };
  for (int j = 0; j < machine.joint_count(); ++j) {
    const auto driven = std::any_of(machine.cylinders.begin(), machine.cylinders.end(),
                                    [&](const Cylinder& c) { return c.joint == j; });
    if (!driven) continue;
    all.push_back(j);
    const std::string& name = machine.joints[static_cast<std::size_t>(j)].name;
    const std::vector<int> own = {j};
    menu.push_back({fmt::format("{} alone, slowly out and back over its range", name),
                    up_and_down(own, {0.1}, {0.0}, options), false, false});
    menu.push_back({fmt::format("{} alone, fast out and back over its range", name),
                    up_and_down(own, {1.0}, {0.0}, options), false, false});
    menu.push_back({fmt::format("{} alone, out and back at three speeds: slow, half, full", name),
                    up_and_down(own, {0.1, 0.4, 1.0}, {0.0}, options), false, false});
    menu.push_back(
        {at_two_loads(name), up_and_down(own, {0.25}, {0.0, heaviest}, options), false, false});
    menu.push_back({fmt::format("{} alone, out and back with a sudden command that is held, "
                                "rests of two seconds between",
                                name),
                    {{own, options.high, 0.8, 2.0, 0.0}, {own, options.low, 0.8, 2.0, 0.0}},
                    true,
                    false});
    menu.push_back({fmt::format("{} alone, short moves back and forth about one pose", name),
                    {{own, 0.52, 0.05, 0.5, 0.0},
                     {own, 0.48, 0.05, 0.5, 0.0},
                     {own, 0.50, 0.02, 0.5, 0.0},
                     {own, 0.49, 0.02, 0.5, 0.0}},
                    false,
                    false});
    menu.push_back({fmt::format("{} in five poses with a hold of five seconds in each, with about "
                                "{:.0f} kg",
                                name, heaviest),
                    {{own, 0.2, 0.5, 5.0, heaviest},
                     {own, 0.35, 0.5, 5.0, heaviest},
                     {own, 0.5, 0.5, 5.0, heaviest},
                     {own, 0.65, 0.5, 5.0, heaviest},
                     {own, 0.8, 0.5, 5.0, heaviest}},
                    false,
                    false});
  }
  if (all.size() > 1) {
    menu.push_back({"all joints together, fast out and back",
                    up_and_down(all, {1.0}, {0.0}, options), false, false});
    std::vector<MotionLeg> turns;
    for (const double payload : {0.0, heaviest}) {
      for (const double others : {options.low, options.high}) {
        for (const int j : all) {
          turns.push_back({{j}, others, 0.5, 0.5, payload});
          turns.push_back({{j}, 1.0 - others, 0.5, 0.5, payload});
        }
      }
    }
    menu.push_back({fmt::format("each joint in turn out and back, the others in and then out, with "
                                "no load and with about {:.0f} kg",
                                heaviest),
                    std::move(turns), false, false});
  }
  menu.push_back({"the same few moves from cold until the oil is warm",
                  up_and_down(all, {0.6}, {0.0}, options), false, true});
  return menu;
}

Log synthesise_motion(const CraneModel& model, const MotionRecipe& recipe, double step,
                      double duration, const MotionOptions& options) {
  const Machine& m = model.machine;
  const auto n = static_cast<Index>(duration / step);
  MotionLog out;
  Log& log = out.log;
  log.path = log.file = "motion";
  log.sha256 = std::string(64, '0');
  log.step = step;
  log.time = VectorXd::LinSpaced(n, 0.0, step * static_cast<double>(n - 1));
  log.runs = {{0, n}};
  const DrivenMotion driven = drive(model, recipe, step, n, options);
  const StaticAnswer answer = static_answer(m, driven);
  for (int j = 0; j < m.joint_count(); ++j) {
    add_channel(log, Role::kJointPosition, j, "q_" + m.joints[static_cast<std::size_t>(j)].name,
                driven.q.col(j));
  }
  out.demand.resize(n, m.pump_count());
  for (int p = 0; p < m.pump_count(); ++p)
    out.demand.col(p).setConstant(model.pumps[static_cast<std::size_t>(p)].standby);
  for (int c = 0; c < m.cylinder_count(); ++c) add_cylinder(model, c, answer, options, out);
  for (int p = 0; p < m.pump_count(); ++p) {
    add_channel(log, Role::kPumpPressure, p, "p_" + m.pumps[static_cast<std::size_t>(p)].name,
                out.demand.col(p));
  }
  add_channel(log, Role::kPayload, -1, "payload", driven.payload);
  add_channel(log, Role::kOilTemperature, -1, "oil",
              recipe.warms_up ? VectorXd(VectorXd::LinSpaced(n, options.cold_oil, options.hot_oil))
                              : VectorXd(VectorXd::Constant(n, options.oil)));
  return std::move(out.log);
}

}  // namespace sparflow
