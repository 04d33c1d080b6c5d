#include "models/machine/trajectory.h"

#include "models/math/error.h"

namespace sparflow {

Trajectory Trajectory::refined(int factor) const {
  SPARFLOW_CHECK(factor >= 1, "a motion is refined by a whole factor");
  if (size() < 2) return *this;
  const Eigen::Index intervals = size() - 1;
  Trajectory fine;
  fine.stops = stops;
  const Eigen::Index rows = intervals * factor + 1;
  fine.t.resize(rows);
  fine.q.resize(rows, q.cols());
  fine.qd.resize(rows, q.cols());
  fine.qdd.resize(rows, q.cols());
  for (Eigen::Index k = 0; k < intervals; ++k) {
    for (int part = 0; part < factor; ++part) {
      const Eigen::Index row = k * factor + part;
      const double dt = (t[k + 1] - t[k]) * part / factor;
      fine.t[row] = t[k] + dt;
      fine.qdd.row(row) = qdd.row(k);
      fine.qd.row(row) = qd.row(k) + dt * qdd.row(k);
      fine.q.row(row) = q.row(k) + dt * qd.row(k) + 0.5 * dt * dt * qdd.row(k);
    }
  }
  fine.t[rows - 1] = t[intervals];
  fine.q.row(rows - 1) = q.row(intervals);
  fine.qd.row(rows - 1) = qd.row(intervals);
  fine.qdd.row(rows - 1) = qdd.row(intervals);
  return fine;
}

}  // namespace sparflow
