#pragma once
/// The machine's joint space as an OMPL space. Internal to planners/, which alone includes OMPL.
#include <ompl/base/SpaceInformation.h>
#include <ompl/geometric/PathGeometric.h>

#include <Eigen/Dense>

#include "problems/clearance.h"
#include "problems/problem.h"

namespace sparflow {

/// Real vector space whose coordinates are joint coordinates divided by speed_scale(). OMPL's Euclidean distance then is
/// the metric of path_length() [s], so that planners, informed sampling and the path simplifier (which shortens the length
/// whatever the objective) minimise the same quantity. Bounds are the position limits; motions are checked by
/// ClearanceModel::clear_share(), not by sampling at a fixed resolution. Holds a reference to `clearance`; each thread
/// needs its own of both.
class ConfigurationSpace {
 public:
  ConfigurationSpace(const MotionProblem& problem, ClearanceModel& clearance);

  const ompl::base::SpaceInformationPtr& information() const { return information_; }
  void write(const Eigen::VectorXd& q, ompl::base::State* state) const;
  void read(const ompl::base::State* state, double* q) const;
  /// Waypoints x joints, [rad] or [m], within the limits.
  Eigen::MatrixXd rows(const ompl::geometric::PathGeometric& path) const;

 private:
  Eigen::VectorXd scale_;
  std::vector<Range> limits_;
  ompl::base::SpaceInformationPtr information_;
};

}  // namespace sparflow
