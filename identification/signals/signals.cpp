#include "identification/signals/signals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "models/machine/static_force.h"
#include "models/math/error.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Newton's method from `start`. @return NaN when it does not converge inside the joint's range
double newton_from(const Machine& machine, int cylinder, double length, double start) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const Range range = machine.joints[static_cast<std::size_t>(c.joint)].position;
  double q = start;
  try {
    for (int i = 0; i < 8; ++i) {
      const Taylor3 x = linkage_rates(machine, cylinder, q);
      const double step = (length - x.value) / x.d1;
      q += step;
      if (!(q >= range.lo && q <= range.hi)) return kNaN;
      if (std::abs(step) < 1e-10) return q;  // quadratic convergence: the error is far smaller
    }
  } catch (const std::domain_error&) {
  }
  return kNaN;
}

/// @return the joint's coordinate as logged, or from the measured stroke of its cylinder
VectorXd raw_joint(const Machine& machine, const Log& log, int joint, MachineSignals& out) {
  const std::string& name = machine.joints[static_cast<std::size_t>(joint)].name;
  const Channel* direct = log.find(Role::kJointPosition, joint);
  const int cylinder = machine.cylinder_of_joint(joint);
  const Channel* stroke = cylinder < 0 ? nullptr : log.find(Role::kStroke, cylinder);
  if (direct != nullptr) {
    if (stroke != nullptr) {
      out.notes.push_back(
          fmt::format("joint {}: both its position and the stroke are logged; the "
                      "position is used",
                      name));
    }
    return direct->values;
  }
  SPARFLOW_CHECK(stroke != nullptr, "a log without position and stroke of a joint was let in");
  Index unreachable = 0;
  VectorXd q = joints_at_strokes(machine, cylinder, stroke->values, &unreachable);
  if (unreachable == 0) return q;
  const Range range = machine.joints[static_cast<std::size_t>(joint)].position;
  double lo = stroke_at(machine, cylinder, range.lo), hi = stroke_at(machine, cylinder, range.hi);
  if (lo > hi) std::swap(lo, hi);
  const std::string reach = fmt::format("{:.3f} .. {:.3f} m", lo, hi);
  if (!q.array().isFinite().any()) {
    throw InputError(
        {log.path, 0, 0}, stroke->column,
        fmt::format("no sample lies in the strokes that joint {}'s range and linkage allow, "
                    "{}; got e.g. {:.4f} m. Check unit, zero point (length_at_zero_stroke) and "
                    "the machine file's linkage",
                    name, reach, stroke->values[0]));
  }
  out.notes.push_back(
      fmt::format("{}: {} sample(s) left out, outside the strokes the linkage allows ({})",
                  stroke->column, unreachable, reach));
  return q;
}

VectorXd values_or_empty(const Log& log, Role role, int index) {
  const Channel* channel = log.find(role, index);
  return channel == nullptr ? VectorXd() : channel->values;
}

VectorXd smoothed_or_empty(const SavitzkyGolay& filter, const VectorXd& values) {
  return values.size() == 0 ? VectorXd() : filter.apply(values, 0);
}

void measured(const Machine& machine, const Log& log, int index, MachineSignals& out) {
  const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(index)];
  CylinderSignals& c = out.cylinders[static_cast<std::size_t>(index)];
  c.command = values_or_empty(log, Role::kCommand, index);
  c.measured_flow = values_or_empty(log, Role::kFlow, index);
  c.force = values_or_empty(log, Role::kForce, index);
  c.stroke_measured = log.find(Role::kStroke, index) != nullptr &&
                      log.find(Role::kJointPosition, cylinder.joint) == nullptr;
  if (cylinder.hydraulic()) {
    c.pressure_a = values_or_empty(log, Role::kPressureA, index);
    c.pressure_b = values_or_empty(log, Role::kPressureB, index);
  } else if (log.find(Role::kPressureA, index) || log.find(Role::kPressureB, index)) {
    out.notes.push_back(fmt::format(
        "the pressures of {} are not used: the machine file gives it no bore", cylinder.name));
  }
  c.logs_a = c.pressure_a.array().isFinite().any();
  c.logs_b = c.pressure_b.array().isFinite().any();
  if (c.force.size() == 0 && c.pressure_a.size() > 0 && c.pressure_b.size() > 0) {
    c.force = c.pressure_a * cylinder.area_piston() - c.pressure_b * cylinder.area_rod();
  }
}

/// Computes lengths, speeds, tip and static forces at every usable sample.
void evaluate_machine(const Machine& machine, MachineSignals& out) {
  StaticForce statics(machine);
  std::vector<double> q(machine.joints.size());
  Index open = 0;
  for (Index k = 0; k < out.samples(); ++k) {
    if (!out.usable[k]) continue;
    for (int j = 0; j < machine.joint_count(); ++j) q[static_cast<std::size_t>(j)] = out.q(k, j);
    try {
      statics.update(q.data(), out.payload[k], 0);
    } catch (const std::domain_error&) {
      out.usable[k] = false;
      ++open;
      continue;
    }
    for (std::size_t i = 0; i < out.cylinders.size(); ++i) {
      CylinderSignals& c = out.cylinders[i];
      const Taylor3& x = statics.length(static_cast<int>(i));
      const int joint = machine.cylinders[i].joint;
      const double rate = out.qd(k, joint);
      c.length[k] = x.value;
      c.rate[k] = x.d1;
      c.speed[k] = x.d1 * rate;
      c.acceleration[k] = x.d1 * out.qdd(k, joint) + x.d2 * rate * rate;
      c.static_force[k] = statics.force()[static_cast<Index>(i)];
    }
    out.tip.row(k) = statics.chain().point(machine.tip.joint, machine.tip.xyz).transpose();
  }
  if (open > 0) {
    out.notes.push_back(fmt::format("{} sample(s) left out: a four-bar cannot close there", open));
  }
}

/// Sets direction, masks, flow and working pressure of one cylinder.
void judge_motion(const Cylinder& cylinder, const SegmentOptions& options, const Mask& usable,
                  const Eigen::VectorXi& moves, CylinderSignals& c) {
  const Index n = c.speed.size();
  const bool commanded = c.has_command() && c.command.array().isFinite().any();
  const bool any_pressure = c.pressure_a.size() > 0 || c.pressure_b.size() > 0;
  c.direction = Eigen::VectorXi::Zero(n);
  c.flow = VectorXd::Zero(n);
  c.moving = c.driven = Mask::Constant(n, false);
  if (any_pressure) c.working_pressure = c.working_pressure_smooth = VectorXd::Constant(n, kNaN);
  for (Index k = 0; k < n; ++k) {
    if (!usable[k]) continue;
    const double towards = commanded ? c.command[k] : c.speed[k];
    const double threshold = commanded ? options.command : options.speed;
    if (std::abs(towards) > threshold) c.direction[k] = towards > 0.0 ? 1 : -1;  // NaN gives 0
    if (c.direction[k] == 0) continue;
    const bool extend = c.direction[k] > 0;
    c.moving[k] = moves[k] != 0;
    c.driven[k] = moves[k] == c.direction[k];
    c.flow[k] = std::max(0.0, c.speed[k] * c.direction[k]) *
                (extend ? cylinder.area_piston() : cylinder.area_rod());
    const VectorXd& raw = extend ? c.pressure_a : c.pressure_b;
    const VectorXd& smooth = extend ? c.pressure_a_smooth : c.pressure_b_smooth;
    if (raw.size() > 0) {
      c.working_pressure[k] = raw[k];
      c.working_pressure_smooth[k] = smooth[k];
    }
  }
}

/// Removes commands that are zero throughout although their cylinder moves: they were not recorded (open-loop tests, a
/// lever that bypasses the logger), and the direction then follows from the speed.
void drop_dead_commands(const Machine& machine, const SegmentOptions& options,
                        MachineSignals& out) {
  constexpr double kClearly = 5.0;  // times the speed threshold, above leakage and sensor noise
  constexpr double kLeast_s = 1.0;  // least duration of motion
  for (std::size_t i = 0; i < out.cylinders.size(); ++i) {
    CylinderSignals& c = out.cylinders[i];
    if (!c.has_command() || !c.command.array().isFinite().any()) continue;
    if ((c.command.array().abs() > options.command).any()) continue;
    double moves = 0.0, fastest = 0.0;
    for (Index k = 0; k < out.samples(); ++k) {
      if (!(std::abs(c.speed[k]) > kClearly * options.speed) || out.edge[k]) continue;
      moves += out.step;
      fastest = std::max(fastest, std::abs(c.speed[k]));
    }
    if (moves < kLeast_s) continue;
    out.notes.push_back(
        fmt::format("u_{0} is zero throughout although {0} moves by up to {1:.0f} mm/s: that "
                    "command was not logged and is left out",
                    machine.cylinders[i].name, 1e3 * fastest));
    c.command.resize(0);
  }
}

void find_motion(const Machine& machine, const SegmentOptions& options, MachineSignals& out) {
  const Index n = out.samples(), cylinders = machine.cylinder_count();
  Eigen::MatrixXd speed(n, cylinders), command = Eigen::MatrixXd::Constant(n, cylinders, kNaN);
  for (Index i = 0; i < cylinders; ++i) {
    const CylinderSignals& c = out.cylinders[static_cast<std::size_t>(i)];
    speed.col(i) = c.speed;
    if (c.has_command()) command.col(i) = c.command;
  }
  const Eigen::MatrixXi moves = motion_directions(speed, command, options);
  out.segments = find_segments(out.time, speed, command, out.runs, options);
  for (std::size_t i = 0; i < out.cylinders.size(); ++i) {
    judge_motion(machine.cylinders[i], options, out.usable, moves.col(static_cast<Index>(i)),
                 out.cylinders[i]);
  }
}

Mask edges(const MachineSignals& s) {
  Mask edge = Mask::Constant(s.samples(), false);
  for (const SampleRange& run : s.runs) {
    const double first = s.time[run.begin], last = s.time[run.end - 1];
    for (Index k = run.begin; k < run.end; ++k) {
      edge[k] = std::min(s.time[k] - first, last - s.time[k]) < 0.5 * s.window;
    }
  }
  return edge;
}

/// Frees what is no longer read after speeds and forces are known (SignalOptions::slim).
void free_poses(MachineSignals& s) {
  for (Eigen::MatrixXd* m : {&s.q_measured, &s.qd, &s.qdd, &s.tip}) m->resize(0, 0);
}

/// Computes all signals that follow from the measured ones and the filter.
void derive(const Machine& machine, const SavitzkyGolay& filter, const SignalOptions& options,
            MachineSignals& out) {
  const Index n = out.samples(), joints = machine.joint_count();
  out.window = filter.window();
  out.order = filter.order();
  out.edge = edges(out);
  out.q.resize(n, joints);
  out.qd.resize(n, joints);
  out.qdd.resize(n, joints);
  out.usable = out.payload.array().isFinite();
  for (int j = 0; j < joints; ++j) {
    const Smoothed joint = filter.smooth(out.q_measured.col(j));
    out.q.col(j) = joint.value;
    out.qd.col(j) = joint.first;
    out.qdd.col(j) = joint.second;
    quieten_acceleration(out.time, out.runs, out.q_measured.col(j), filter, out.qdd.col(j));
    out.usable = out.usable && joint.value.array().isFinite() && joint.first.array().isFinite();
  }
  out.tip = Eigen::MatrixXd::Constant(n, 3, kNaN);
  for (CylinderSignals& c : out.cylinders) {
    for (VectorXd* v : {&c.length, &c.rate, &c.speed, &c.acceleration, &c.static_force}) {
      *v = VectorXd::Constant(n, kNaN);
    }
    c.pressure_a_smooth = smoothed_or_empty(filter, c.pressure_a);
    c.pressure_b_smooth = smoothed_or_empty(filter, c.pressure_b);
    c.force_smooth = smoothed_or_empty(filter, c.force);
  }
  evaluate_machine(machine, out);
  out.slim = options.slim;
  if (out.slim) free_poses(out);
  drop_dead_commands(machine, options.motion, out);
  find_motion(machine, options.motion, out);
  for (CylinderSignals& c : out.cylinders) {
    if (out.slim) {
      c.pressure_a_smooth.resize(0);
      c.pressure_b_smooth.resize(0);
      c.model_force = std::move(c.static_force);
      c.static_force.resize(0);
    } else {
      c.model_force = c.predicted_force = c.static_force;
    }
  }
  for (PumpSignals& pump : out.pumps)
    pump.pressure_smooth = smoothed_or_empty(filter, pump.pressure);
}

}  // namespace

VectorXd joints_at_strokes(const Machine& machine, int cylinder, const VectorXd& strokes,
                           Index* unreachable) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const double zero = c.length_at_zero_stroke.value_or(0.0);
  VectorXd q(strokes.size());
  Index lost = 0;
  double near = kNaN;
  for (Index k = 0; k < strokes.size(); ++k) {
    q[k] = kNaN;
    if (!std::isfinite(strokes[k])) continue;
    if (std::isfinite(near)) q[k] = newton_from(machine, cylinder, strokes[k] + zero, near);
    if (!std::isfinite(q[k])) {
      try {
        q[k] = joint_at_stroke(machine, cylinder, strokes[k]);
      } catch (const std::domain_error&) {
        ++lost;
      }
    }
    if (std::isfinite(q[k])) near = q[k];
  }
  if (unreachable != nullptr) *unreachable = lost;
  return q;
}

VectorXd sample_durations(const VectorXd& time, const std::vector<SampleRange>& runs) {
  VectorXd duration = VectorXd::Zero(time.size());
  for (const SampleRange& run : runs) {
    for (Index k = run.begin; k + 1 < run.end; ++k) {
      const double half = 0.5 * (time[k + 1] - time[k]);
      duration[k] += half;
      duration[k + 1] += half;
    }
  }
  return duration;
}

MachineSignals smoothed_anew(const Machine& machine, const MachineSignals& signals, double window_s,
                             const SignalOptions& options) {
  MachineSignals out = signals;
  for (CylinderSignals& c : out.cylinders) {
    for (VectorXd* v : {&c.pressure_effect, &c.return_effect, &c.pressure_sensor_effect,
                        &c.demand_effect, &c.flow_effect, &c.reached}) {
      v->resize(0);
    }
  }
  for (PumpSignals& p : out.pumps) p.pressure_effect.resize(0);
  out.of_effective_machine = false;
  derive(machine, {out.time, out.runs, window_s, options.smoothing.order}, options, out);
  return out;
}

MachineSignals with_accelerations_of_filter(const Machine& machine, MachineSignals signals) {
  const SavitzkyGolay filter(signals.time, signals.runs, signals.window, signals.order);
  for (int j = 0; j < machine.joint_count(); ++j) {
    const VectorXd own = filter.apply(signals.q_measured.col(j), 2);
    const VectorXd change = own - signals.qdd.col(j);
    for (std::size_t i = 0; i < signals.cylinders.size(); ++i) {
      CylinderSignals& c = signals.cylinders[i];
      if (machine.cylinders[i].joint == j) c.acceleration += c.rate.cwiseProduct(change);
    }
    signals.qdd.col(j) = own;
  }
  return signals;
}

MachineSignals make_signals(const Machine& machine, const Log& log, const SignalOptions& options) {
  if (const std::string parts = parts_of(machine);
      !log.machine_parts.empty() && log.machine_parts != parts)
    throw InputError({log.path, 0, 0}, "",
                     fmt::format("this log was read for another machine: its channels belong to "
                                 "{}, and the machine here has {}; read "
                                 "the log again with this machine",
                                 log.machine_parts, parts));
  MachineSignals out;
  out.file = log.file;
  out.sha256 = log.sha256;
  out.step = log.step;
  out.time = log.time;
  out.runs = log.runs;
  const SavitzkyGolay filter = make_filter(log, options.smoothing);
  const Index n = out.samples(), joints = machine.joint_count();
  out.q_measured.resize(n, joints);
  for (int j = 0; j < joints; ++j) out.q_measured.col(j) = raw_joint(machine, log, j, out);
  const Channel* payload = log.find(Role::kPayload);
  out.payload_measured = payload != nullptr;
  out.payload = payload != nullptr ? payload->values : VectorXd(VectorXd::Zero(n));
  if (payload == nullptr) out.notes.push_back("no payload_kg in the log: 0 kg is assumed");
  out.oil = values_or_empty(log, Role::kOilTemperature, -1);
  out.return_pressure = values_or_empty(log, Role::kReturnPressure, -1);
  out.cylinders.resize(machine.cylinders.size());
  for (int i = 0; i < machine.cylinder_count(); ++i) measured(machine, log, i, out);
  out.pumps.resize(machine.pumps.size());
  for (int p = 0; p < machine.pump_count(); ++p) {
    out.pumps[static_cast<std::size_t>(p)].pressure = values_or_empty(log, Role::kPumpPressure, p);
  }
  derive(machine, filter, options, out);
  for (const Channel& channel : log.channels) {
    if (channel.role == Role::kCandidate) {
      out.candidates.push_back({channel.signal, channel.unit, channel.values});
    }
  }
  const Index lost = n - out.usable.cast<Index>().sum();
  if (lost > 0) {
    out.notes.push_back(fmt::format(
        "{} of {} samples left out: pose, speed or payload is not known there", lost, n));
  }
  return out;
}

MachineSignals without_checked(MachineSignals signals) {
  for (CylinderSignals& c : signals.cylinders)
    for (VectorXd* v : {&c.length, &c.rate, &c.pressure_a, &c.pressure_b}) v->resize(0);
  return signals;
}

MachineSignals::MachineSignals() = default;
MachineSignals::MachineSignals(const MachineSignals&) = default;
MachineSignals::MachineSignals(MachineSignals&&) noexcept = default;
MachineSignals& MachineSignals::operator=(const MachineSignals&) = default;
MachineSignals& MachineSignals::operator=(MachineSignals&&) noexcept = default;
MachineSignals::~MachineSignals() = default;

}  // namespace sparflow
