#include "problems/motion_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "models/math/error.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

std::string joint_column(const Joint& joint, const char* kind, const char* per) {
  return fmt::format("{}_{}_{}{}", kind, joint.name,
                     joint.type == JointType::kRevolute ? "rad" : "m", per);
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

}  // namespace

std::string motion_csv(const CraneModel& model, const Trajectory& motion, double payload) {
  const Machine& machine = model.machine;
  std::string text = "t_s";
  for (const char* kind : {"q", "qd", "qdd"}) {
    const char* per = kind[1] == '\0' ? "" : kind[2] == '\0' ? "_s" : "_s2";
    for (const Joint& joint : machine.joints) text += "," + joint_column(joint, kind, per);
  }
  for (const Cylinder& c : machine.cylinders) text += fmt::format(",Q_{}_lpm", c.name);
  for (const Cylinder& c : machine.cylinders) text += fmt::format(",P_{}_bar", c.name);
  for (const Pump& p : machine.pumps) text += fmt::format(",p_{}_bar", p.name);
  text += ",power_W\n";
  Chain chain(model);
  Eigen::VectorXd q(motion.q.cols()), qd(motion.q.cols()), qdd(motion.q.cols());
  for (Eigen::Index k = 0; k < motion.size(); ++k) {
    q = motion.q.row(k);
    qd = motion.qd.row(k);
    qdd = motion.qdd.row(k);
    fmt::format_to(std::back_inserter(text), "{:.6f}", motion.t[k]);
    for (const Eigen::MatrixXd* m : {&motion.q, &motion.qd, &motion.qdd}) {
      for (Eigen::Index j = 0; j < m->cols(); ++j)
        fmt::format_to(std::back_inserter(text), ",{:.12g}", (*m)(k, j));
    }
    const MachineState& state = chain.evaluate({q.data(), qd.data(), qdd.data()}, payload);
    for (const CylinderState& c : state.cylinders) {
      fmt::format_to(std::back_inserter(text), ",{:.6g}", c.flow / units::kLitrePerMinute);
    }
    for (const CylinderState& c : state.cylinders) {
      fmt::format_to(std::back_inserter(text), ",{:.6g}", c.pressure / units::kBar);
    }
    for (const PumpState& p : state.pumps)
      fmt::format_to(std::back_inserter(text), ",{:.6g}", p.pressure / units::kBar);
    fmt::format_to(std::back_inserter(text), ",{:.6g}\n", state.power);
  }
  return text;
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
  std::vector<std::size_t> columns = {column("t_s")};
  for (const char* kind : {"q", "qd", "qdd"}) {
    const char* per = kind[1] == '\0' ? "" : kind[2] == '\0' ? "_s" : "_s2";
    for (const Joint& joint : machine.joints)
      columns.push_back(column(joint_column(joint, kind, per)));
  }
  const auto rows = static_cast<Eigen::Index>(lines.size() - 1),
             n = static_cast<Eigen::Index>(machine.joints.size());
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
  return {values.col(0), values.middleCols(1, n), values.middleCols(1 + n, n),
          values.middleCols(1 + 2 * n, n)};
}

}  // namespace sparflow
