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
    const Eigen::Index i = segment(t);
    const double share = std::clamp((t - motion_.t[i]) / width(i), 0.0, 1.0);
    const Eigen::VectorXd at =
        motion_.values.row(i).transpose() + share * width(i) * rate(motion_.t[i]);
    s.end = t > motion_.t[motion_.t.size() - 1];
    s.command = follow(levers_, r, at, rate(t + FollowerOptions{}.lead));
    s.payload = changed_payload(motion_, i, r.payload);
    return s;
  }

 private:
  Eigen::Index segment(double t) const {
    return std::min(row_at(motion_.t, t), motion_.t.size() - 2);
  }
  double width(Eigen::Index i) const { return motion_.t[i + 1] - motion_.t[i]; }
  /// Mean rate of the rows around an instant; behind the last one the motion rests.
  Eigen::VectorXd rate(double t) const {
    if (t > motion_.t[motion_.t.size() - 1]) return Eigen::VectorXd::Zero(motion_.values.cols());
    const Eigen::Index i = segment(t);
    return (motion_.values.row(i + 1) - motion_.values.row(i)).transpose() / width(i);
  }

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
