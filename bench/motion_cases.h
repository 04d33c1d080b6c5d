#pragma once
/// Reaches and models of the motion benchmarks.
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "problems/problem.h"

namespace sparflow::bench {

/// Identifies a model from the bundled log of the loader crane, as `sparflow fit` does.
CraneModel bundled_model();

/// Reaches of the loader crane at fixed durations, without obstacles.
std::vector<MotionProblem> loader_crane_reaches();

/// Makes a reach of a planar chain of `joints` revolute joints with horizontal axes, each with a pinned cylinder, all fed
/// by one load-sensing pump; lengths and masses decrease towards the tip. It goes from posture to posture in 14 s.
MotionProblem chain_problem(int joints);

/// Makes a model with synthetic pressures: force / area, a flow loss, and `centres` kernels in addition.
CraneModel synthetic_model(const Machine& machine, int centres);

/// Name of the processor, and load average of the machine.
std::string processor();
double load_average();

/// Processor time [s] of this program, and of the child processes for which it has waited.
double cpu_seconds();
double children_cpu_seconds();

double median(std::vector<double> values);

}  // namespace sparflow::bench
