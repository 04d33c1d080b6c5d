#include "identification/log/segments.h"

#include <cmath>

#include "models/math/error.h"

namespace sparflow {
namespace {

/// Stretches that are too short to count.
struct ShortStretch {
  bool moving = false;       ///< of motion, or of rest
  double shortest = 0.0;     ///< [s] those below it are meant
  bool inside_only = false;  ///< whether stretches at the ends of the run stay
};

/// Inverts every such stretch of the run.
void remove_short(const Eigen::VectorXd& time, SampleRange run, const ShortStretch& which,
                  std::vector<char>* moving) {
  Eigen::Index begin = run.begin;
  for (Eigen::Index i = run.begin + 1; i <= run.end; ++i) {
    const auto at = static_cast<std::size_t>(begin);
    if (i < run.end && (*moving)[static_cast<std::size_t>(i)] == (*moving)[at]) continue;
    const bool at_end = begin == run.begin || i == run.end;
    // A stretch lasts from its first sample to the first sample of the next stretch.
    const double lasts = (i < run.end ? time[i] : time[i - 1]) - time[begin];
    if (((*moving)[at] != 0) == which.moving && lasts < which.shortest &&
        !(which.inside_only && at_end)) {
      for (Eigen::Index k = begin; k < i; ++k)
        (*moving)[static_cast<std::size_t>(k)] = !which.moving;
    }
    begin = i;
  }
}

Segment describe(const Eigen::MatrixXi& direction, SampleRange samples, int run, bool moving) {
  Segment segment;
  segment.samples = samples;
  segment.run = run;
  segment.moving = moving;
  const auto rows = direction.middleRows(samples.begin, samples.size()).array();
  const double count = static_cast<double>(samples.size());
  for (Eigen::Index c = 0; c < direction.cols(); ++c) {
    segment.cylinders.push_back({static_cast<double>((rows.col(c) > 0).count()) / count,
                                 static_cast<double>((rows.col(c) < 0).count()) / count});
  }
  return segment;
}

}  // namespace

Eigen::MatrixXi motion_directions(const Eigen::MatrixXd& velocity, const Eigen::MatrixXd& command,
                                  const SegmentOptions& options) {
  SPARFLOW_CHECK(command.cols() == 0 ||
                     (command.cols() == velocity.cols() && command.rows() == velocity.rows()),
                 "commands and velocities differ in shape");
  Eigen::MatrixXi direction = Eigen::MatrixXi::Zero(velocity.rows(), velocity.cols());
  for (Eigen::Index c = 0; c < velocity.cols(); ++c) {
    const bool commanded = command.cols() > 0 && command.col(c).array().isFinite().any();
    for (Eigen::Index i = 0; i < velocity.rows(); ++i) {
      const double v = velocity(i, c);
      if (!(std::abs(v) > options.speed)) continue;  // true also for NaN
      if (commanded && !(std::abs(command(i, c)) > options.command)) continue;
      direction(i, c) = v > 0.0 ? 1 : -1;
    }
  }
  return direction;
}

std::vector<Segment> find_segments(const Eigen::VectorXd& time, const Eigen::MatrixXd& velocity,
                                   const Eigen::MatrixXd& command,
                                   const std::vector<SampleRange>& runs,
                                   const SegmentOptions& options) {
  SPARFLOW_CHECK(velocity.rows() == time.size(), "velocities and time differ in length");
  const Eigen::MatrixXi direction = motion_directions(velocity, command, options);
  std::vector<char> moving(static_cast<std::size_t>(time.size()));
  for (Eigen::Index i = 0; i < time.size(); ++i) {
    moving[static_cast<std::size_t>(i)] = (direction.row(i).array() != 0).any();
  }
  std::vector<Segment> segments;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const SampleRange run = runs[r];
    remove_short(time, run, {false, options.pause_s, true}, &moving);
    remove_short(time, run, {true, options.shortest_s, false}, &moving);
    Eigen::Index begin = run.begin;
    for (Eigen::Index i = run.begin + 1; i <= run.end; ++i) {
      const bool now = moving[static_cast<std::size_t>(begin)] != 0;
      if (i < run.end && (moving[static_cast<std::size_t>(i)] != 0) == now) continue;
      segments.push_back(describe(direction, {begin, i}, static_cast<int>(r), now));
      begin = i;
    }
  }
  return segments;
}

}  // namespace sparflow
