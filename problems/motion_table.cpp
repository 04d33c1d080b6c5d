#include "problems/motion_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <vector>

#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

std::string joint_column(const Joint& joint, const char* kind, const char* per) {
  return fmt::format("{}_{}_{}{}", kind, joint.name,
                     joint.type == JointType::kRevolute ? "rad" : "m", per);
}

/// Columns of a motion: time, positions, speeds, accelerations.
std::vector<std::string> motion_columns(const Machine& machine) {
  std::vector<std::string> names = {"t_s"};
  for (const char* kind : {"q", "qd", "qdd"}) {
    const char* per = kind[1] == '\0' ? "" : kind[2] == '\0' ? "_s" : "_s2";
    for (const Joint& joint : machine.joints) names.push_back(joint_column(joint, kind, per));
  }
  return names;
}

/// @param values columns as motion_columns names them
Trajectory motion_of(const Eigen::MatrixXd& values) {
  const Eigen::Index n = (values.cols() - 1) / 3;
  return {values.col(0), values.middleCols(1, n), values.middleCols(1 + n, n),
          values.middleCols(1 + 2 * n, n)};
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return fields;
}

/// Flow at full command, as learned or, failing that, of the machine file; 0 = not known. [m^3/s]
double full_command_flow(const CraneModel& model, std::size_t cylinder, bool extend) {
  const CylinderModel& learned = model.cylinders[cylinder];
  const double gain = extend ? learned.valve_gain_extend : learned.valve_gain_retract;
  const Valve* valve = model.machine.valve_of_cylinder(static_cast<int>(cylinder));
  if (gain > 0.0 || valve == nullptr) return gain;
  return extend ? valve->max_flow_extend : valve->max_flow_retract;
}

/// Cylinders whose command can be told in both directions.
std::vector<std::size_t> commanded_cylinders(const CraneModel& model) {
  std::vector<std::size_t> cylinders;
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    if (!model.machine.cylinders[i].hydraulic()) continue;
    if (full_command_flow(model, i, true) > 0.0 && full_command_flow(model, i, false) > 0.0)
      cylinders.push_back(i);
  }
  return cylinders;
}

std::string motion_header(const CraneModel& model) {
  const Machine& machine = model.machine;
  std::string text = fmt::format("{}", fmt::join(motion_columns(machine), ","));
  for (const Cylinder& c : machine.cylinders) text += fmt::format(",Q_{}_lpm", c.name);
  for (const Cylinder& c : machine.cylinders) text += fmt::format(",P_{}_bar", c.name);
  for (const Pump& p : machine.pumps) text += fmt::format(",p_{}_bar", p.name);
  text += ",power_W";
  for (const Cylinder& c : machine.cylinders) text += fmt::format(",x_{}_m", c.name);
  for (const std::size_t i : commanded_cylinders(model))
    text += fmt::format(",u_{}", machine.cylinders[i].name);
  return text + ",payload_kg\n";
}

}  // namespace

namespace {

std::string motion_rows(const CraneModel& model, const Trajectory& motion,
                        const std::function<double(double)>& payload_of, const LeastFlows& least) {
  std::string text = motion_header(model);
  const auto out = std::back_inserter(text);
  const std::vector<std::size_t> with_command = commanded_cylinders(model);
  Chain chain(model);
  Eigen::VectorXd q(motion.q.cols()), qd(motion.q.cols()), qdd(motion.q.cols());
  for (Eigen::Index k = 0; k < motion.size(); ++k) {
    q = motion.q.row(k);
    qd = motion.qd.row(k);
    qdd = motion.qdd.row(k);
    fmt::format_to(out, "{:.6f}", motion.t[k]);
    for (const Eigen::MatrixXd* m : {&motion.q, &motion.qd, &motion.qdd}) {
      for (Eigen::Index j = 0; j < m->cols(); ++j) fmt::format_to(out, ",{:.12g}", (*m)(k, j));
    }
    const double payload = payload_of(motion.t[k]);
    const MachineState& state = chain.evaluate({q.data(), qd.data(), qdd.data()}, payload);
    const auto moves = [&](std::size_t i) {
      return firmly_moving(least, i, state.cylinders[i].flow, state.cylinders[i].speed);
    };
    for (const CylinderState& c : state.cylinders)
      fmt::format_to(out, ",{:.6g}", c.flow / units::kLitrePerMinute);
    for (const CylinderState& c : state.cylinders)
      fmt::format_to(out, ",{:.6g}", c.pressure / units::kBar);
    for (const PumpState& p : state.pumps) fmt::format_to(out, ",{:.6g}", p.pressure / units::kBar);
    fmt::format_to(out, ",{:.6g}", state.power);
    for (std::size_t i = 0; i < state.cylinders.size(); ++i) {
      fmt::format_to(
          out, ",{:.9g}",
          stroke_at(model.machine, static_cast<int>(i), q[model.machine.cylinders[i].joint]));
    }
    for (const std::size_t i : with_command) {
      const CylinderState& c = state.cylinders[i];
      const bool extend = c.speed > 0.0;
      const double u = moves(i) ? c.flow / full_command_flow(model, i, extend) : 0.0;
      fmt::format_to(out, ",{:.6g}", extend || u == 0.0 ? u : -u);
    }
    fmt::format_to(out, ",{:.6g}\n", payload);
  }
  return text;
}

}  // namespace

std::string motion_csv(const CraneModel& model, const Trajectory& motion, double payload,
                       const LeastFlows& least) {
  return motion_rows(
      model, motion, [payload](double) { return payload; }, least);
}

double payload_at(const MotionProblem& problem, const Trajectory& motion, double t) {
  /// Time before a stop's instant that counts as the stop, because rows of a file are rounded.
  /// @threshold [s] 0..1e-3; numerical: the last digit of t_s
  constexpr double kSameInstant = 1e-7;
  std::size_t leg = 0;
  while (leg < motion.stops.size() && motion.stops[leg] <= t + kSameInstant) ++leg;
  return payload_on(problem, leg);
}

std::string motion_csv(const CraneModel& model, const MotionProblem& problem,
                       const Trajectory& motion) {
  return motion_rows(
      model, motion, [&](double t) { return payload_at(problem, motion, t); },
      least_flows(model.machine, problem.limits));
}

Trajectory at_rate(const Trajectory& motion, double rate) {
  SPARFLOW_CHECK(rate > 0.0 && motion.size() > 1, "a rate and a motion");
  /// Part of a step below which the last instant and the end of the motion are one.
  /// @threshold [1] 1e-9..0.1; numerical: rounding of a duration times a rate
  constexpr double kSameInstant = 1e-6;
  const double whole = motion.duration() * rate;
  const auto steps = static_cast<Eigen::Index>(std::ceil(whole - kSameInstant));
  const Eigen::Index n = motion.q.cols();
  Trajectory out;
  out.stops = motion.stops;
  out.t.resize(steps + 1);
  for (Eigen::MatrixXd* m : {&out.q, &out.qd, &out.qdd}) m->resize(steps + 1, n);
  Eigen::Index interval = 0;
  for (Eigen::Index k = 0; k <= steps; ++k) {
    const double t = motion.t[0] + std::min(static_cast<double>(k) / rate, motion.duration());
    while (interval + 2 < motion.size() && motion.t[interval + 1] <= t) ++interval;
    const double dt = t - motion.t[interval];
    out.t[k] = t;
    out.q.row(k) = motion.q.row(interval) + dt * motion.qd.row(interval) +
                   0.5 * dt * dt * motion.qdd.row(interval);
    out.qd.row(k) = motion.qd.row(interval) + dt * motion.qdd.row(interval);
  }
  // The end is exactly that of the motion, whose rounding the sum above would carry on.
  out.q.row(steps) = motion.q.row(motion.size() - 1);
  out.qd.row(steps) = motion.qd.row(motion.size() - 1);
  for (Eigen::Index k = 0; k < steps; ++k)
    out.qdd.row(k) = (out.qd.row(k + 1) - out.qd.row(k)) / (out.t[k + 1] - out.t[k]);
  out.qdd.row(steps) = out.qdd.row(steps - 1);
  return out;
}

Trajectory load_motion(const std::string& path, const Machine& machine) {
  const std::string text = read_file(path);
  std::vector<std::string> lines(1);
  for (const char c : text) {
    if (c == '\n') {
      lines.emplace_back();
    } else {
      lines.back() += c;
    }
  }
  while (!lines.empty() && lines.back().empty()) lines.pop_back();
  if (lines.size() < 3)
    throw InputError({path, 0, 0}, "", "a motion needs a header and at least two rows");
  const std::vector<std::string> header = split(lines[0]);
  const auto column = [&](const std::string& name) {
    const auto it = std::find(header.begin(), header.end(), name);
    if (it != header.end()) return static_cast<std::size_t>(it - header.begin());
    const std::string near = nearest_word(name, header);
    throw InputError(
        {path, 1, 0}, name,
        "column is missing" + (near.empty() ? std::string() : "; did you mean \"" + near + "\"?"));
  };
  std::vector<std::size_t> columns;
  for (const std::string& name : motion_columns(machine)) columns.push_back(column(name));
  const auto rows = static_cast<Eigen::Index>(lines.size() - 1);
  Eigen::MatrixXd values(rows, static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index r = 0; r < rows; ++r) {
    const std::vector<std::string> fields = split(lines[static_cast<std::size_t>(r) + 1]);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const int line = static_cast<int>(r) + 2;
      if (columns[c] >= fields.size())
        throw InputError({path, line, 0}, header[columns[c]], "value is missing");
      const std::string& f = fields[columns[c]];
      double value = 0.0;
      const auto [end, error] = std::from_chars(f.data(), f.data() + f.size(), value);
      if (error != std::errc() || end != f.data() + f.size() || !std::isfinite(value)) {
        throw InputError({path, line, 0}, header[columns[c]],
                         fmt::format("got \"{}\", expected a number", f));
      }
      values(r, static_cast<Eigen::Index>(c)) = value;
    }
    if (r > 0 && values(r, 0) <= values(r - 1, 0)) {
      throw InputError({path, static_cast<int>(r) + 2, 0}, "t_s",
                       "time must increase from row to row");
    }
  }
  return motion_of(values);
}

Trajectory motion_from_columns(const std::string& name,
                               const std::map<std::string, std::vector<double>>& columns,
                               const Machine& machine) {
  const std::vector<std::string> wanted = motion_columns(machine);
  const auto found = [&](const std::string& column) -> const std::vector<double>& {
    const auto it = columns.find(column);
    if (it == columns.end()) throw InputError({name, 0, 0}, column, "column is missing");
    return it->second;
  };
  const std::size_t rows = found("t_s").size();
  if (rows < 2) throw InputError({name, 0, 0}, "t_s", "a motion needs at least two rows");
  Eigen::MatrixXd values(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(wanted.size()));
  for (std::size_t c = 0; c < wanted.size(); ++c) {
    const std::vector<double>& column = found(wanted[c]);
    if (column.size() != rows) {
      throw InputError({name, 0, 0}, wanted[c],
                       fmt::format("{} values, but t_s has {}", column.size(), rows));
    }
    for (std::size_t r = 0; r < rows; ++r) {
      if (!std::isfinite(column[r])) {
        throw InputError({name, 0, 0}, wanted[c],
                         fmt::format("got {} in row {}, expected a number", column[r], r + 1));
      }
      if (c == 0 && r > 0 && column[r] <= column[r - 1]) {
        throw InputError({name, 0, 0}, "t_s",
                         fmt::format("time must increase from row to row; it goes from {} to {} s "
                                     "in row {}",
                                     column[r - 1], column[r], r + 1));
      }
      values(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = column[r];
    }
  }
  return motion_of(values);
}

bool names_speeds(const std::string& header, const Machine& machine) {
  return std::all_of(machine.joints.begin(), machine.joints.end(), [&](const Joint& j) {
    return header.find(joint_column(j, "qd", "_s")) != std::string::npos &&
           header.find(joint_column(j, "qdd", "_s2")) != std::string::npos;
  });
}

}  // namespace sparflow
