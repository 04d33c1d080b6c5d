#include "optimizer/crane/exact_energy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "models/effects/effective_machine.h"
#include "models/math/units.h"
#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/crane/instants.h"
#include "optimizer/sway/pendulum.h"
#include "optimizer/transcription/transcription.h"
#include "problems/clearance.h"

namespace sparflow {
namespace {

bool outside_data(const GpParameters& p, double flow, double force) {
  return flow < p.flow_min || flow > p.flow_max || force < p.force_min || force > p.force_max;
}

}  // namespace

MotionEnergy exact_energy(const CraneModel& model, const Trajectory& motion, double payload,
                          int refine, const LeastFlows& least) {
  const std::size_t cylinders = model.cylinders.size();
  MotionEnergy energy;
  energy.pump.assign(model.pumps.size(), 0.0);
  energy.throttling.assign(cylinders, 0.0);
  energy.useful.assign(cylinders, 0.0);
  energy.creep.assign(cylinders, 0.0);
  energy.share_moving.assign(cylinders + 1, 0.0);
  if (motion.size() < 2) return energy;
  Chain chain(model);
  double moving_time = 0.0, outside_time = 0.0;
  for_each_instant(
      motion, refine,
      [&](const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd,
          double step) {
        const MachineState& state =
            chain.evaluate({q.data(), qd.data(), qdd.data()}, payload, true);
        energy.total += step * state.power;
        for (std::size_t p = 0; p < state.pumps.size(); ++p) {
          const PumpState& pump = state.pumps[p];
          energy.pump[p] += step * pump.pressure * pump.flow;
          if (pump.leader >= 0)
            energy.pressure_uncertainty +=
                step * pump.flow *
                state.cylinders[static_cast<std::size_t>(pump.leader)].pressure_std;
        }
        std::size_t moving = 0;
        for (std::size_t i = 0; i < cylinders; ++i) {
          const CylinderState& c = state.cylinders[i];
          if (!c.moving) continue;
          energy.throttling[i] += step * state.throttling(model.machine, static_cast<int>(i));
          energy.useful[i] += step * c.pressure * c.flow;
          if (model.machine.cylinders[i].hydraulic() && !firmly_moving(least, i, c.flow, c.speed)) {
            energy.creep[i] += step * std::abs(c.speed);
            continue;
          }
          ++moving;
          energy.largest_pressure_std = std::max(energy.largest_pressure_std, c.pressure_std);
          const GaussianProcess& process =
              c.speed > 0.0 ? model.cylinders[i].extend : model.cylinders[i].retract;
          moving_time += step;
          if (!process.empty() && outside_data(process.parameters(), c.flow, c.total_force))
            outside_time += step;
        }
        energy.share_moving[moving] += step;
      });
  for (double& share : energy.share_moving) share /= motion.duration();
  energy.moving_share_outside_data = moving_time > 0.0 ? outside_time / moving_time : 0.0;
  const Eigen::Index last = motion.size() - 1;
  energy.potential_difference =
      potential_energy(chain.machine(), motion.q.row(last).transpose(), payload) -
      potential_energy(chain.machine(), motion.q.row(0).transpose(), payload);
  return energy;
}

namespace {

/// The part of a motion between two instants, with knots at both.
Trajectory part_between(const Trajectory& motion, double begin, double end) {
  std::vector<double> times = {begin};
  times.reserve(static_cast<std::size_t>(motion.size()) + 2);
  for (const double t : motion.t) {
    if (t > begin && t < end) times.push_back(t);
  }
  times.push_back(end);
  Trajectory part = resampled(motion, Eigen::Map<const Eigen::VectorXd>(
                                          times.data(), static_cast<Eigen::Index>(times.size())));
  part.stops.clear();
  return part;
}

void add_scaled(std::vector<double>& sum, const std::vector<double>& more, double factor) {
  sum.resize(more.size(), 0.0);
  for (std::size_t i = 0; i < more.size(); ++i) sum[i] += factor * more[i];
}

/// Sum over the cylinders of the time for which they move, over the duration.
double moving_cylinders(const MotionEnergy& energy) {
  double sum = 0.0;
  for (std::size_t i = 0; i < energy.share_moving.size(); ++i)
    sum += static_cast<double>(i) * energy.share_moving[i];
  return sum;
}

}  // namespace

std::vector<CycleLeg> legs_of(const MotionProblem& problem, const Trajectory& motion) {
  std::vector<CycleLeg> legs;
  const std::size_t stops = std::min(problem.stops.size(), motion.stops.size());
  legs.reserve(stops + 1);
  double begin = motion.t[0];
  for (std::size_t leg = 0; leg <= stops; ++leg) {
    const double end = leg < stops ? motion.stops[leg] : motion.t[motion.size() - 1];
    const bool whole = stops == 0;
    legs.push_back({end_of_leg(problem, leg), payload_on(problem, leg), begin, end,
                    whole ? motion : part_between(motion, begin, end)});
    if (leg < stops) begin = end + problem.stops[leg].dwell;
  }
  return legs;
}

MotionEnergy exact_energy(const CraneModel& model, const MotionProblem& problem,
                          const Trajectory& motion, int refine) {
  const LeastFlows least = least_flows(model.machine, problem.limits);
  if (problem.stops.empty()) return exact_energy(model, motion, problem.payload, refine, least);
  MotionEnergy sum;
  double moving_time = 0.0, outside_time = 0.0;
  for (const CycleLeg& leg : legs_of(problem, motion)) {
    const MotionEnergy e = exact_energy(model, leg.motion, leg.payload, refine, least);
    sum.total += e.total;
    add_scaled(sum.pump, e.pump, 1.0);
    add_scaled(sum.throttling, e.throttling, 1.0);
    add_scaled(sum.useful, e.useful, 1.0);
    add_scaled(sum.creep, e.creep, 1.0);
    add_scaled(sum.share_moving, e.share_moving, leg.motion.duration() / motion.duration());
    sum.potential_difference += e.potential_difference;
    sum.largest_pressure_std = std::max(sum.largest_pressure_std, e.largest_pressure_std);
    sum.pressure_uncertainty += e.pressure_uncertainty;
    const double time = moving_cylinders(e) * leg.motion.duration();
    moving_time += time;
    outside_time += time * e.moving_share_outside_data;
  }
  sum.moving_share_outside_data = moving_time > 0.0 ? outside_time / moving_time : 0.0;
  if (!sum.share_moving.empty()) sum.share_moving[0] += total_dwell(problem) / motion.duration();
  return sum;
}

double exact_total_energy(const CraneModel& model, const MotionProblem& problem,
                          const Trajectory& motion, int refine) {
  if (problem.stops.empty()) return exact_total_energy(model, motion, problem.payload, refine);
  double total = 0.0;
  for (const CycleLeg& leg : legs_of(problem, motion))
    total += exact_total_energy(model, leg.motion, leg.payload, refine);
  return total;
}

double exact_total_energy(const CraneModel& model, const Trajectory& motion, double payload,
                          int refine) {
  if (motion.size() < 2) return 0.0;
  Chain chain(model);
  double total = 0.0;
  for_each_instant(
      motion, refine,
      [&](const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd,
          double step) {
        total += step * chain.evaluate({q.data(), qd.data(), qdd.data()}, payload).power;
      });
  return total;
}

namespace {

/// A quantity at one instant, with its limit.
struct Seen {
  double value, limit;
  double over;   // violation, value - limit for an upper limit
  double scale;  // by which `over` becomes a relative excess
  const char* unit;
  double time;
};

/// Collects the worst instant of each limit, named by quantity and part. The name is composed once only, because see() is
/// called at every instant of every check.
class LimitBook {
 public:
  void see(const char* what, const std::string& part, const Seen& now) {
    const double excess = now.over / now.scale;
    if (++next_ >= entries_.size()) next_ = 0;  // limits are passed in the same order every time
    if (next_ < entries_.size() && !entries_[next_].is(what, part)) {
      next_ = 0;
      while (next_ < entries_.size() && !entries_[next_].is(what, part)) ++next_;
    }
    if (next_ == entries_.size()) {
      entries_.push_back(
          {what, part, {what + part, now.value, now.limit, now.unit, now.time, excess}});
      return;
    }
    LimitCheck& check = entries_[next_].check;
    if (excess <= check.excess) return;
    check.value = now.value;
    check.limit = now.limit;
    check.unit = now.unit;
    check.time = now.time;
    check.excess = excess;
  }
  /// Of a value that belongs in a range; the excess is relative to the range's width.
  static Seen range(double value, const Range& r, const char* unit, double time) {
    const bool high = value - r.hi > r.lo - value;
    return {value,
            high ? r.hi : r.lo,
            std::max(value - r.hi, r.lo - value),
            std::max(r.hi - r.lo, 1e-12),
            unit,
            time};
  }
  std::vector<LimitCheck> sorted() const {
    std::vector<LimitCheck> checks;
    checks.reserve(entries_.size());
    for (const Entry& e : entries_) checks.push_back(e.check);
    std::sort(checks.begin(), checks.end(),
              [](const LimitCheck& a, const LimitCheck& b) { return a.excess > b.excess; });
    return checks;
  }

 private:
  struct Entry {
    std::string what, part;
    LimitCheck check;
    bool is(const char* other_what, const std::string& other_part) const {
      return part == other_part && what == other_what;
    }
  };
  std::vector<Entry> entries_;
  std::size_t next_ = 0;
};

void check_joints(const MotionProblem& problem, const Machine& machine, const Trajectory& fine,
                  Eigen::Index k, LimitBook& book) {
  for (int j = 0; j < machine.joint_count(); ++j) {
    const auto i = static_cast<std::size_t>(j);
    const bool turns = machine.joints[i].type == JointType::kRevolute;
    const std::string& name = machine.joints[i].name;
    const MotionLimits& l = problem.limits;
    book.see("position of joint ", name,
             LimitBook::range(fine.q(k, j), l.position[i], turns ? "rad" : "m", fine.t[k]));
    book.see("velocity of joint ", name,
             LimitBook::range(fine.qd(k, j), l.velocity[i], turns ? "rad/s" : "m/s", fine.t[k]));
    book.see(
        "acceleration of joint ", name,
        LimitBook::range(fine.qdd(k, j), l.acceleration[i], turns ? "rad/s2" : "m/s2", fine.t[k]));
  }
}

void check_ends(const MotionProblem& problem, const Machine& machine, const Trajectory& motion,
                LimitBook& book) {
  const Eigen::Index last = motion.size() - 1;
  const Eigen::VectorXd first_q = motion.q.row(0), last_q = motion.q.row(last);
  const double start_error = (first_q - problem.start).cwiseAbs().maxCoeff();
  book.see("distance from the start posture", "",
           {start_error, 0.0, start_error - 1e-9, 1.0, "rad or m", motion.t[0]});
  if (const auto* goal = std::get_if<TipGoal>(&problem.goal)) {
    const double error = (tip_position<double>(machine, last_q) - goal->tip).norm();
    const double allowed = goal->tolerance;
    book.see("distance of the tip from its goal", "",
             {error, allowed, error - allowed - 1e-5, 1.0, "m", motion.t[last]});
  } else {
    const auto& posture = std::get<JointGoal>(problem.goal);
    Eigen::VectorXd off = (last_q - posture.q).cwiseAbs();
    if (posture.tolerance.size() > 0) off = (off - posture.tolerance).cwiseMax(0.0);
    const double error = off.maxCoeff();
    book.see("distance from the goal posture", "",
             {error, 0.0, error - 1e-6, 1.0, "rad or m", motion.t[last]});
  }
  // Waypoints are passed at knots, so the nearest knots are sought, in order.
  Eigen::Index from = 0;
  for (std::size_t w = 0; w < problem.waypoints.size(); ++w) {
    Eigen::Index best = from;
    double nearest = std::numeric_limits<double>::infinity();
    for (Eigen::Index k = from; k <= last; ++k) {
      const Eigen::VectorXd q = motion.q.row(k).transpose();
      const double distance = (tip_position<double>(machine, q) - problem.waypoints[w]).norm();
      if (distance >= nearest) continue;
      nearest = distance;
      best = k;
    }
    book.see("distance of the tip from waypoint ", std::to_string(w + 1),
             {nearest, 0.0, nearest - 1e-5, 1.0, "m", motion.t[best]});
    from = best;
  }
  const auto off = [](Eigen::VectorXd qd, const Eigen::VectorXd& asked) {
    if (asked.size() > 0) qd -= asked;
    return qd.cwiseAbs().maxCoeff();
  };
  const double speed = std::max(off(motion.qd.row(0).transpose(), problem.start_velocity),
                                off(motion.qd.row(last).transpose(), problem.goal_velocity));
  book.see(moves_at_an_end(problem) ? "speed at start and end, off the one asked for"
                                    : "speed at start and end",
           "", {speed, 0.0, speed - 1e-9, 1.0, "rad/s or m/s", motion.t[last]});
}

}  // namespace

LimitCheck check_duration(const MotionProblem& problem, double duration) {
  const bool early = duration < problem.duration.min;
  const double limit = early ? problem.duration.min : problem.duration.max;
  const double beyond = early ? limit - duration : duration - limit;
  return {"duration", duration, limit, "s", duration, std::isfinite(limit) ? beyond / limit : -1.0};
}

bool is_end_condition(const LimitCheck& check) {
  const auto named = [&](const char* word) { return check.what.find(word) != std::string::npos; };
  if (named("start") || named("goal")) return true;
  // where a stop has a tolerance, its limit is one like any other
  return check.limit == 0.0 && (named("at the stops") || named("from posture"));
}

namespace {

/// Sway of the load by the exact pendulum, and the amplitude that is left at stops and at the end.
void check_sway(const MotionProblem& problem, const Machine& machine, const Trajectory& motion,
                LimitBook& book) {
  if (!problem.sway || motion.size() < 2) return;
  const SwayLimit& s = *problem.sway;
  /// Steps of the pendulum's integration in an interval, at which its angle is seen.
  /// @threshold [1] 1..64; derived: a step is then a hundredth of a period or less, an error of the angle below 1e-6
  constexpr int kParts = 8;
  const RopeCourse course = rope_course(machine, motion, s.cable, kParts);
  const auto see = [&](const std::string& what, double angle, double limit, double t) {
    book.see("sway of the load", what,
             {angle / units::kDegree, limit / units::kDegree, angle - limit, limit, "deg", t});
  };
  see("", course.largest_angle, s.limit, course.largest_at);
  for (std::size_t i = 0; i <= motion.stops.size(); ++i) {
    const bool last = i == motion.stops.size();
    const double t = last ? motion.t[motion.size() - 1] : motion.stops[i];
    Eigen::Index k = 0;
    (motion.t.array() - t).abs().minCoeff(&k);
    see(last ? std::string(" at the end") : " after " + end_of_leg(problem, i),
        swing_amplitude(machine, course.knots[static_cast<std::size_t>(k)]), s.end_limit, t);
  }
}

std::vector<LimitCheck> check_leg(const CraneModel& model, const MotionProblem& problem,
                                  const Trajectory& motion, int refine);

/// The worst of every limit over the legs of a cycle, each with its payload; where it ends is told by stop.
std::vector<LimitCheck> check_cycle(const CraneModel& model, const MotionProblem& problem,
                                    const Trajectory& motion, int refine) {
  std::vector<LimitCheck> all;
  const std::vector<CycleLeg> legs = legs_of(problem, motion);
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const Trajectory& part = legs[i].motion;
    MotionProblem one = leg_of(problem, i, i == 0 ? problem.start : part.q.row(0).transpose());
    one.sway.reset();
    for (LimitCheck c : check_leg(model, one, part, refine)) {
      if (c.what.starts_with("distance of the tip from its goal"))
        c.what = "distance of the tip from " + legs[i].to;
      if (c.what.starts_with("distance from the goal"))
        c.what = "distance from posture " + legs[i].to;
      if (c.what == "speed at start and end") c.what = "speed at the stops";
      const auto known = std::find_if(all.begin(), all.end(),
                                      [&](const LimitCheck& k) { return k.what == c.what; });
      if (known == all.end()) {
        all.push_back(std::move(c));
      } else if (c.excess > known->excess) {
        *known = std::move(c);
      }
    }
  }
  LimitBook book;
  check_sway(problem, model.machine, motion, book);
  for (LimitCheck& c : book.sorted()) all.push_back(std::move(c));
  if (motion.stops.size() != problem.stops.size())
    all.push_back({"stops of the cycle", static_cast<double>(motion.stops.size()),
                   static_cast<double>(problem.stops.size()), "", motion.t[0], 1.0});
  std::sort(all.begin(), all.end(),
            [](const LimitCheck& a, const LimitCheck& b) { return a.excess > b.excess; });
  return all;
}

}  // namespace

std::vector<LimitCheck> check_limits(const CraneModel& model, const MotionProblem& problem,
                                     const Trajectory& motion, int refine) {
  return problem.stops.empty() ? check_leg(model, problem, motion, refine)
                               : check_cycle(model, problem, motion, refine);
}

namespace {

std::vector<LimitCheck> check_leg(const CraneModel& model, const MotionProblem& problem,
                                  const Trajectory& motion, int refine) {
  const Machine& machine = model.machine;
  LimitBook book;
  const Trajectory fine = motion.refined(refine);
  Chain chain(model);
  std::unique_ptr<ClearanceModel> clearance;
  if (!problem.obstacles.empty()) clearance = std::make_unique<ClearanceModel>(problem);
  Eigen::Vector3d line_start = Eigen::Vector3d::Zero(), line_direction = Eigen::Vector3d::Zero();
  if (problem.tip_line) {
    const auto* goal = std::get_if<TipGoal>(&problem.goal);
    line_start = tip_position<double>(machine, problem.start);
    const Eigen::Vector3d end =
        goal ? goal->tip : tip_position<double>(machine, std::get<JointGoal>(problem.goal).q);
    line_direction = (end - line_start).normalized();
  }
  const double trusted = problem.limits.pressure_std;
  Eigen::VectorXd q(fine.q.cols()), qd(fine.q.cols()), qdd(fine.q.cols());
  for (Eigen::Index k = 0; k < fine.size(); ++k) {
    q = fine.q.row(k);
    qd = fine.qd.row(k);
    qdd = fine.qdd.row(k);
    const double t = fine.t[k];
    check_joints(problem, machine, fine, k, book);
    const MachineState& state =
        chain.evaluate({q.data(), qd.data(), qdd.data()}, problem.payload, trusted > 0.0);
    using units::kBar;
    using units::kLitrePerMinute;
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const auto i = static_cast<std::size_t>(c);
      const double deviation = state.cylinders[i].pressure_std;
      if (trusted > 0.0 && machine.cylinders[i].hydraulic())
        book.see("standard deviation of the pressure of ", machine.cylinders[i].name,
                 {deviation / kBar, trusted / kBar, deviation - trusted, trusted, "bar", t});
      const Valve* valve = machine.valve_of_cylinder(c);
      if (valve == nullptr) continue;
      const double full =
          state.cylinders[i].speed > 0.0 ? valve->max_flow_extend : valve->max_flow_retract;
      const double limit = problem.limits.valve_fraction * full;
      if (limit <= 0.0) continue;
      const double flow = state.cylinders[i].flow;
      book.see("flow through valve ", machine.cylinders[i].name,
               {flow / kLitrePerMinute, limit / kLitrePerMinute, flow - limit, limit, "l/min", t});
    }
    for (int p = 0; p < machine.pump_count(); ++p) {
      const auto i = static_cast<std::size_t>(p);
      const double flow_limit =
          effect_flow_limit(machine, model.effects, p, problem.limits.pump_max_flow[i]);
      const double pressure_limit = problem.limits.pump_max_pressure[i];
      const PumpState& s = state.pumps[i];
      if (flow_limit > 0.0) {
        book.see("flow of pump ", machine.pumps[i].name,
                 {s.flow / kLitrePerMinute, flow_limit / kLitrePerMinute, s.flow - flow_limit,
                  flow_limit, "l/min", t});
      }
      if (pressure_limit > 0.0 && machine.pumps[i].type == PumpType::kLoadSensing) {
        book.see("pressure of pump ", machine.pumps[i].name,
                 {s.pressure / kBar, pressure_limit / kBar, s.pressure - pressure_limit,
                  pressure_limit, "bar", t});
      }
    }
    if (clearance) {
      const double distance = clearance->nearest(q.data()).distance;
      book.see("clearance beyond the required distance", "",
               {distance, 0.0, -distance, 1.0, "m", t});
    }
    if (problem.tip_line) {
      Eigen::Vector3d off = tip_position<double>(machine, q) - line_start;
      off -= line_direction * line_direction.dot(off);
      book.see("distance of the tip from its line", "",
               {off.norm(), problem.tip_line->tolerance, off.norm() - problem.tip_line->tolerance,
                problem.tip_line->tolerance, "m", t});
    }
  }
  check_ends(problem, machine, motion, book);
  check_sway(problem, machine, motion, book);
  return book.sorted();
}

}  // namespace

std::vector<LimitCheck> check_jumps(const MotionProblem& problem, const Trajectory& motion) {
  LimitBook book;
  for (Eigen::Index k = 0; k + 1 < motion.size(); ++k) {
    const double dt = motion.t[k + 1] - motion.t[k];
    const Eigen::VectorXd qd = motion.qd.row(k) + dt * motion.qdd.row(k),
                          q = motion.q.row(k) + 0.5 * dt * (motion.qd.row(k) + qd.transpose());
    for (int j = 0; j < problem.machine.joint_count(); ++j) {
      const auto i = static_cast<std::size_t>(j);
      const Joint& joint = problem.machine.joints[i];
      const bool turns = joint.type == JointType::kRevolute;
      const auto see = [&](const char* what, double jump, const Range& r, const char* unit) {
        book.see(what, joint.name,
                 {jump, 0.0, jump, std::max(r.hi - r.lo, 1e-12), unit, motion.t[k + 1]});
      };
      see("jump of joint ", std::abs(motion.q(k + 1, j) - q[j]), problem.limits.position[i],
          turns ? "rad" : "m");
      see("jump of the speed of joint ", std::abs(motion.qd(k + 1, j) - qd[j]),
          problem.limits.velocity[i], turns ? "rad/s" : "m/s");
    }
  }
  return book.sorted();
}

double command_effort(const CraneModel& model, const MotionProblem& problem,
                      const Trajectory& motion, int refine) {
  const std::vector<FullSpeed> full = full_speeds(model.machine, problem.limits);
  double effort = 0.0;
  for (Eigen::Index k = 0; k + 1 < motion.size(); ++k) {
    const double step = (motion.t[k + 1] - motion.t[k]) / refine;
    for (int part = 0; part < refine; ++part) {
      const double dt = (part + 0.5) * step;
      for (int c = 0; c < model.machine.cylinder_count(); ++c) {
        const int j = model.machine.cylinders[static_cast<std::size_t>(c)].joint;
        const double qdd = motion.qdd(k, j), qd = motion.qd(k, j);
        const double q = motion.q(k, j) + dt * (qd + 0.5 * dt * qdd);
        const double speed = linkage_rates(model.machine, c, q).d1 * (qd + dt * qdd);
        const double u = full[static_cast<std::size_t>(c)].command(speed);
        effort += step * u * u;
      }
    }
  }
  return effort;
}

double exact_cost(const CraneModel& model, const MotionProblem& problem, const Trajectory& motion,
                  double energy, int refine) {
  const ObjectiveWeights& w = problem.objective;
  double cost =
      w.energy * (energy + problem.idle_power * motion.duration()) + w.time * motion.duration();
  if (w.commands > 0.0) cost += w.commands * command_effort(model, problem, motion, refine);
  return cost;
}

double worst_excess(const std::vector<LimitCheck>& checks) {
  return checks.empty() ? 0.0 : std::max(0.0, checks.front().excess);
}

}  // namespace sparflow
