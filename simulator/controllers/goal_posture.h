#pragma once
/// The posture in which a controller ends a task that does not ask for one.
#include "simulator/controllers/controller.h"

namespace sparflow::control {

/// The task's own posture, or that with the tip at its goal nearest to `from`.
/// @throws ControllerFailure where none is found within the joints' ranges
Eigen::VectorXd goal_posture(const Machine& machine, const Task& task, const Eigen::VectorXd& from);

/// Time that the rods' ways between two postures take at full levers, within the flow of their pumps. [s]
/// @param together whether all move at once, else one after another
double least_time(const Knowledge& knowledge, const Eigen::VectorXd& from,
                  const Eigen::VectorXd& to, bool together);

}  // namespace sparflow::control
