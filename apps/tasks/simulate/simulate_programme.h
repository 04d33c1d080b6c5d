#pragma once
/// What the plant is asked to do in a run of `simulate`: programmes, files, a controller.
#include <memory>

#include "apps/tasks/simulate/simulate_task.h"
#include "identification/log/log.h"
#include "simulator/programmes/programme.h"

namespace sparflow {

/// Joint positions of a log or motion, from strokes where it has those. NaN: not known.
Eigen::MatrixXd simulated_positions(const Log& log, const Machine& machine);

/// Machine, parameters and task must outlive it. Doubts about a file go to the listener. @throws UsageError  @throws InputError
std::unique_ptr<plant::Programme> simulate_programme(const SimulateTask& task,
                                                     const Machine& machine,
                                                     const plant::PlantParameters& parameters,
                                                     const Listener& listener);

}  // namespace sparflow
