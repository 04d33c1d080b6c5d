/// Programmes that are tables over time.
#include <algorithm>
#include <cmath>

#include "simulator/programmes/programmes.h"

namespace sparflow::plant {
namespace {

/// Index of the last row at or before t.
Eigen::Index row_at(const Eigen::VectorXd& times, double t) {
  const double* begin = times.data();
  const double* after = std::upper_bound(begin, begin + times.size(), t + 1e-9);
  return std::max<Eigen::Index>(0, after - begin - 1);
}

std::optional<double> changed_payload(const TimeTable& table, Eigen::Index row, double now) {
  if (table.payload.size() == 0 || !std::isfinite(table.payload[row])) return std::nullopt;
  if (std::abs(table.payload[row] - now) < 0.5) return std::nullopt;
  return table.payload[row];
}

class TrackedMotion : public Programme {
 public:
  TrackedMotion(const Machine& machine, const PlantParameters& parameters, TimeTable motion)
      : levers_(machine, parameters), motion_(std::move(motion)) {}
  std::vector<double> start() const override { return motion_.start; }
  double start_payload() const override { return motion_.start_payload; }

  ProgrammeStep step(const Record& r) override {
    ProgrammeStep s;
    const double t = r.t + motion_.t[0];
    const Eigen::Index rows = motion_.t.size(), i = std::min(row_at(motion_.t, t), rows - 2);
    const double width = motion_.t[i + 1] - motion_.t[i];
    const double share = std::clamp((t - motion_.t[i]) / width, 0.0, 1.0);
    const Eigen::VectorXd rate = (motion_.values.row(i + 1) - motion_.values.row(i)) / width;
    const Eigen::VectorXd at = motion_.values.row(i).transpose() + share * width * rate;
    s.end = t > motion_.t[rows - 1];
    s.command = follow(levers_, r, at, s.end ? Eigen::VectorXd::Zero(at.size()) : rate);
    s.payload = changed_payload(motion_, i, r.payload);
    return s;
  }

 private:
  LeverMap levers_;
  TimeTable motion_;
};

class ReplayedCommands : public Programme {
 public:
  explicit ReplayedCommands(TimeTable commands) : commands_(std::move(commands)) {}
  std::vector<double> start() const override { return commands_.start; }
  double start_payload() const override { return commands_.start_payload; }

  ProgrammeStep step(const Record& r) override {
    ProgrammeStep s;
    const double t = r.t + commands_.t[0];
    const Eigen::Index i = row_at(commands_.t, t);
    for (Eigen::Index c = 0; c < commands_.values.cols(); ++c)
      s.command.push_back(std::clamp(commands_.values(i, c), -1.0, 1.0));
    s.payload = changed_payload(commands_, i, r.payload);
    s.end = t > commands_.t[commands_.t.size() - 1];
    return s;
  }

 private:
  TimeTable commands_;
};

}  // namespace

std::unique_ptr<Programme> tracked_motion(const Machine& machine, const PlantParameters& parameters,
                                          TimeTable motion) {
  SPARFLOW_CHECK(motion.t.size() >= 2, "a motion has two rows or more");
  return std::make_unique<TrackedMotion>(machine, parameters, std::move(motion));
}

std::unique_ptr<Programme> replayed_commands(TimeTable commands) {
  SPARFLOW_CHECK(commands.t.size() >= 1, "a table of commands has a row");
  return std::make_unique<ReplayedCommands>(std::move(commands));
}

}  // namespace sparflow::plant
