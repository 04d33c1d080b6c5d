#pragma once
/// The page of plan: collision-free paths.
#include <string>
#include <vector>

#include "apps/report/page/page.h"
#include "models/machine/trajectory.h"
#include "problems/problem.h"

namespace sparflow {

struct PlannedMotion {
  std::string name;
  Trajectory motion;      ///< the path driven as fast as the limits allow
  double shortest = 0.0;  ///< [s]
};

struct PlannedPaths {
  std::string message;                 ///< of the planner
  std::vector<PlannedMotion> motions;  ///< those that can be driven
  std::vector<std::string> refused;    ///< why others cannot
};

/// Draws the crane along the quickest path, the tip's paths of all, and a table of them.
Page plan_page(const MotionProblem& problem, const PlannedPaths& paths);

}  // namespace sparflow
