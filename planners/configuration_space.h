#pragma once
/// OMPL's view of the machine. Internal to this room: the only headers that show OMPL.
#include <ompl/base/SpaceInformation.h>
#include <ompl/geometric/PathGeometric.h>

#include <Eigen/Dense>

#include "problems/clearance.h"
#include "problems/problem.h"

namespace sparflow {

/// Real vector space whose coordinates are joint coordinates divided by speed_scale(): OMPL's Euclidean
/// distance then is the room's metric [s], so planners, informed sampling and the path simplifier (which
/// looks at path length whatever the objective) all shorten the same thing.
/// Bounds are the position limits; motions are judged by ClearanceModel::clear_share(), not by sampling at
/// a fixed resolution. Holds a reference to `clearance`; one a thread, as that is.
class ConfigurationSpace {
 public:
  ConfigurationSpace(const MotionProblem& problem, ClearanceModel& clearance);

  const ompl::base::SpaceInformationPtr& information() const { return information_; }
  /// Product of the ranges is not zero: informed planners need a volume.
  bool has_volume() const { return has_volume_; }
  void write(const Eigen::VectorXd& q, ompl::base::State* state) const;
  void read(const ompl::base::State* state, double* q) const;
  /// Waypoints x joints, [rad] or [m], within the limits.
  Eigen::MatrixXd rows(const ompl::geometric::PathGeometric& path) const;

 private:
  Eigen::VectorXd scale_;
  std::vector<Range> limits_;
  ompl::base::SpaceInformationPtr information_;
  bool has_volume_ = true;
};

}  // namespace sparflow
