#include "simulator/benchmark/closed_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <set>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "simulator/sensors/sensors.h"

namespace sparflow::benchmark {
namespace {

using control::Measurement;

/// What the sensors tell, as controllers see it: gaps keep the last value, speeds are filtered differences.
class Feedback {
 public:
  Feedback(const Scenario& s, std::uint64_t seed, const LoopOptions& o)
      : machine_(s.machine), sensors_(s.machine, s.plant, seed), options_(o) {}

  const Measurement& look(const plant::Record& record) {
    std::vector<double> told = sensors_.sense(record);
    for (std::size_t c = 0; c < told.size(); ++c)
      if (std::isnan(told[c])) told[c] = last_.empty() ? 0.0 : last_[c];
    last_ = told;
    std::size_t at = 0;
    const auto n = static_cast<Eigen::Index>(machine_.joints.size());
    Eigen::VectorXd q(n);
    for (Eigen::Index j = 0; j < n; ++j) q[j] = told[at++];
    const double step = record.t - m_.t;
    if (m_.q.size() == 0) {
      m_.qd = Eigen::VectorXd::Zero(n);
    } else if (step > 0.0) {
      const double share = step / (options_.speed_filter + step);
      m_.qd += share * ((q - m_.q) / step - m_.qd);
    }
    m_.q = q;
    m_.t = record.t;
    at += machine_.cylinders.size();  // commands
    m_.pressure_bore.assign(machine_.cylinders.size(), 0.0);
    m_.pressure_rod = m_.pressure_bore;
    for (std::size_t c = 0; c < machine_.cylinders.size(); ++c) {
      if (!machine_.cylinders[c].hydraulic()) {
        ++at;
        continue;
      }
      m_.pressure_bore[c] = told[at++];
      m_.pressure_rod[c] = told[at++];
    }
    m_.pump_pressure.clear();
    for (std::size_t p = 0; p < machine_.pumps.size(); ++p) m_.pump_pressure.push_back(told[at++]);
    if (!machine_.pumps.empty()) ++at;  // return line
    m_.payload = told[at++];
    if (!machine_.pumps.empty()) m_.oil = told[at];
    return m_;
  }

 private:
  const Machine& machine_;
  plant::Sensors sensors_;
  LoopOptions options_;
  Measurement m_;
  std::vector<double> last_;
};

/// Collects what a row tells.
class Scores {
 public:
  Scores(const Scenario& s, const LoopOptions& o)
      : s_(s), o_(o), cut_off_(s.machine.pumps.size(), 0.0) {}

  void add(const plant::Record& r, const plant::EnergyLedger& ledger,
           const std::vector<double>& command, double step_seconds) {
    steps_.push_back(step_seconds);
    for (std::size_t c = 0; c < command.size() && !last_command_.empty(); ++c) {
      const double rate = (command[c] - last_command_[c]) / o_.sample_time;
      rates_ += rate * rate;
      ++rate_count_;
    }
    last_command_ = command;
    for (const auto* pressures : {&r.pressure_a, &r.pressure_b, &r.pump_pressure})
      for (const double p : *pressures) peak_ = std::max(peak_, p);
    limits(r);
    if (r.t + 1e-9 < next_trace_) return;
    next_trace_ = r.t + o_.trace_step;
    double power = 0.0;
    for (std::size_t p = 0; p < r.pump_pressure.size(); ++p)
      power += r.pump_pressure[p] * r.pump_flow[p];
    const double lost = ledger.total_loss();
    trace_.loss.push_back(
        trace_.t.empty() ? 0.0 : (lost - lost_) / std::max(r.t - trace_.t.back(), 1e-6));
    lost_ = lost;
    trace_.t.push_back(r.t);
    trace_.q.push_back(r.q);
    trace_.power.push_back(power);
  }

  void path_error(const std::optional<Eigen::Vector3d>& intended, const Eigen::Vector3d& tip) {
    if (!intended) return;
    path_ += (*intended - tip).squaredNorm();
    ++path_count_;
  }

  void write(Row& row) {
    row.peak_pressure = peak_;
    row.limits.assign(broken_.begin(), broken_.end());
    if (rate_count_ > 0) row.roughness = std::sqrt(rates_ / static_cast<double>(rate_count_));
    if (path_count_ > 0) row.tip_error_path = std::sqrt(path_ / static_cast<double>(path_count_));
    if (!steps_.empty()) {
      row.step_worst = *std::max_element(steps_.begin(), steps_.end());
      const auto middle = steps_.begin() + static_cast<std::ptrdiff_t>(steps_.size() / 2);
      std::nth_element(steps_.begin(), middle, steps_.end());
      row.step_median = *middle;
    }
    row.trace = std::move(trace_);
  }

 private:
  void limits(const plant::Record& r) {
    const Machine& m = s_.machine;
    for (std::size_t j = 0; j < m.joints.size(); ++j) {
      const Range p = m.joints[j].position, v = m.joints[j].velocity;
      const double slack = o_.slack * (p.hi - p.lo);
      if (r.q[j] < p.lo - slack || r.q[j] > p.hi + slack)
        broken_.insert("range of " + m.joints[j].name);
      if (r.qd[j] < v.lo * (1.0 + o_.slack) || r.qd[j] > v.hi * (1.0 + o_.slack))
        broken_.insert("speed of " + m.joints[j].name);
    }
    for (std::size_t p = 0; p < m.pumps.size(); ++p) {
      const bool at_end = m.pumps[p].type == PumpType::kLoadSensing &&
                          r.pump_pressure[p] > (1.0 - o_.slack) * s_.plant.pumps[p].cut_off;
      cut_off_[p] = at_end ? cut_off_[p] + o_.sample_time : 0.0;
      if (cut_off_[p] > o_.cut_off_time) broken_.insert("cut-off of pump " + m.pumps[p].name);
    }
  }

  const Scenario& s_;
  const LoopOptions& o_;
  std::vector<double> steps_, last_command_, cut_off_;
  std::set<std::string> broken_;
  double rates_ = 0.0, path_ = 0.0, peak_ = 0.0, next_trace_ = 0.0, lost_ = 0.0;
  long rate_count_ = 0, path_count_ = 0;
  Trace trace_;
};

class Loop {
 public:
  Loop(const Scenario& s, std::uint64_t seed, const LoopOptions& o, Row& row)
      : s_(s), o_(o), row_(row), scores_(s, o), feedback_(s, seed, o) {
    plant::RunOptions run;
    run.sample_time = o.sample_time;
    plant_.emplace(s.machine, s.plant, std::vector<double>(s.start.begin(), s.start.end()),
                   s.payload, run);
  }

  void run(control::Controller& controller) {
    row_.time = 0.0;
    row_.tip_error_end = row_.sway = 0.0;
    for (std::size_t g = 0; g < s_.goals.size(); ++g) {
      if (!reach(controller, static_cast<int>(g))) return;
      if (s_.goals[g].payload) plant_->set_payload(*s_.goals[g].payload);
    }
    row_.done = true;
  }

  void finish() {
    scores_.write(row_);
    if (!row_.done) row_.time = kNotKnown;
    if (!plant_) return;
    const plant::EnergyLedger& l = plant_->ledger();
    row_.ran = plant_->time();
    row_.energy = std::accumulate(l.delivered.begin(), l.delivered.end(), l.drive_work);
    row_.pump_work = std::accumulate(l.pump_work.begin(), l.pump_work.end(), 0.0);
    row_.useful = l.stored - l.payload_exchange;
    for (const auto& c : l.cylinder_loss)
      for (std::size_t k = 0; k < c.size(); ++k) row_.loss[k] += c[k];
    row_.pump_loss = std::accumulate(l.pump_loss.begin(), l.pump_loss.end(), 0.0);
    row_.tank_loss = l.tank_loss;
    row_.swing_loss = l.swing_loss;
  }

 private:
  Eigen::VectorXd posture() const {
    const std::vector<double>& q = plant_->record().q;
    return Eigen::Map<const Eigen::VectorXd>(q.data(), static_cast<Eigen::Index>(q.size()));
  }
  Eigen::Vector3d tip() const { return tip_position<double>(s_.machine, posture()); }

  /// Largest distance of a rod from that of the posture that a goal asks for; 0 where it asks for none. [m]
  double rods_away(const ScenarioGoal& goal) const {
    if (!goal.q) return 0.0;
    const Eigen::VectorXd now = posture();
    double most = 0.0;
    for (int c = 0; c < s_.machine.cylinder_count(); ++c) {
      const int j = s_.machine.cylinders[static_cast<std::size_t>(c)].joint;
      most = std::max(most, std::abs(cylinder_length(s_.machine, c, now[j]) -
                                     cylinder_length(s_.machine, c, (*goal.q)[j])));
    }
    return most;
  }

  /// One goal. @return whether it was reached and held
  bool reach(control::Controller& controller, int g) {
    const ScenarioGoal& goal = s_.goals[static_cast<std::size_t>(g)];
    control::Task task{g, goal.tip, goal.q, plant_->time(), goal.duration, s_.tolerance};
    const double limit =
        std::min(s_.time_limit, task.begin + o_.patience * goal.duration + o_.hold);
    bool first = true;
    double since = kNotKnown, sway = 0.0;
    Eigen::Vector3d before = tip();
    while (true) {
      const plant::Record& record = plant_->record();
      const Measurement& seen = feedback_.look(record);
      const Eigen::Vector3d at = tip();
      const double speed = (at - before).norm() / o_.sample_time;
      before = at;
      if (o_.watch) o_.watch(record, plant_->ledger());
      row_.sway_path =
          std::max(row_.sway_path, std::acos(std::cos(record.swing_1) * std::cos(record.swing_2)));
      const bool there = (at - goal.tip).norm() <= s_.tolerance &&
                         rods_away(goal) <= s_.tolerance && speed <= o_.rest_speed;
      if (!there) {
        since = kNotKnown;
        sway = 0.0;
      } else if (std::isnan(since)) {
        since = record.t;
      }
      if (there) sway = std::max(sway, std::hypot(record.swing_1, record.swing_2));
      // All that arrive in time run to the same instant, so that energies and tip errors are compared at equal time.
      if (there && record.t >= task.begin + task.duration + o_.hold &&
          record.t - since >= o_.hold) {
        row_.time += since - task.begin;
        row_.tip_error_end = std::max(row_.tip_error_end, (at - goal.tip).norm());
        row_.sway = std::max(row_.sway, sway);
        return true;
      }
      if (record.t > limit) {
        row_.tip_error_end = std::max(row_.tip_error_end, (at - goal.tip).norm());
        row_.reason = fmt::format("goal {} was not reached in {:.0f} s: the tip is {:.3f} m away",
                                  g + 1, record.t - task.begin, (at - goal.tip).norm());
        if (rods_away(goal) > s_.tolerance)
          row_.reason += fmt::format(", a rod {:.3f} m from the posture", rods_away(goal));
        return false;
      }
      if (o_.stop && o_.stop()) {
        row_.reason = "interrupted";
        return false;
      }
      const auto begin = std::chrono::steady_clock::now();
      if (first) controller.begin(task, seen);
      first = false;
      std::vector<double> command = controller.step(seen);
      const double seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      if (!usable(command)) return false;
      scores_.path_error(controller.intended_tip(), at);
      scores_.add(record, plant_->ledger(), command, seconds);
      if (plant_->advance(command) != plant::RunStatus::kRunning) {
        row_.reason = plant_->status() == plant::RunStatus::kKinematicsEnd
                          ? "the machine left its kinematics: " + plant_->message()
                          : "the plant could not be integrated: " + plant_->message();
        return false;
      }
    }
  }

  bool usable(std::vector<double>& command) {
    if (command.size() != s_.machine.cylinders.size()) {
      row_.reason = fmt::format("the controller gave {} commands for {} cylinders", command.size(),
                                s_.machine.cylinders.size());
      return false;
    }
    for (double& u : command) {
      if (!std::isfinite(u)) {
        row_.reason = "the controller gave a command that is not a number";
        return false;
      }
      u = std::clamp(u, -1.0, 1.0);
    }
    return true;
  }

  const Scenario& s_;
  const LoopOptions& o_;
  Row& row_;
  Scores scores_;
  Feedback feedback_;
  std::optional<plant::PlantRun> plant_;
};

}  // namespace

Row run_closed_loop(const Scenario& scenario, const std::string& name, const MakeController& make,
                    std::uint64_t seed, const LoopOptions& options) {
  Row row;
  row.scenario = scenario.id;
  row.controller = name;
  row.seed = seed;
  std::optional<Loop> loop;
  try {
    loop.emplace(scenario, seed, options, row);
    loop->run(*make());
  } catch (const control::ControllerFailure& e) {
    row.reason = e.what();
  } catch (const std::domain_error& e) {
    row.reason = std::string("the machine left its kinematics: ") + e.what();
  }
  if (loop) loop->finish();
  return row;
}

}  // namespace sparflow::benchmark
