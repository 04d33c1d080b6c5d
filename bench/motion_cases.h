#pragma once
/// Reaches and models the motion benchmarks are run on.
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "problems/problem.h"

namespace sparflow::bench {

/// Learned from the bundled log of the loader crane, as `sparflow fit` does.
CraneModel bundled_model();

/// Reaches of the loader crane at fixed durations, nothing in the way.
std::vector<MotionProblem> loader_crane_reaches();

/// A reach without obstacles. @param goal tip [m]
MotionProblem reach(const std::string& name, const Machine& machine,
                    const std::vector<double>& start, const Eigen::Vector3d& goal, double payload,
                    double duration);

/// Every joint lifts or sinks a vertical chain of `joints` revolute joints, each with its pinned cylinder, all fed by
/// one load-sensing pump; lengths and masses fall towards the tip. From posture to posture in 14 s.
MotionProblem chain_problem(int joints);

/// Pressures of a machine nobody has measured: load / area, a flow loss and `centres` kernels on top.
CraneModel synthetic_model(const Machine& machine, int centres);

/// The processor's name and how busy the machine is.
std::string processor();
double load_average();

/// Processor time of this program [s], and of the child processes it has waited for.
double cpu_seconds();
double children_cpu_seconds();

double median(std::vector<double> values);

}  // namespace sparflow::bench
