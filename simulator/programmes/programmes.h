#pragma once
/// The programmes of `sparflow simulate`.
#include <memory>

#include "models/math/error.h"
#include "simulator/programmes/programme.h"

namespace sparflow::plant {

/// Random work as an operator does it: single and simultaneous moves, pauses, a payload changed in some pauses.
/// @param payload [kg]; absent: drawn, several in a run @param seconds of the run, for the changes of payload
struct WorkRequest {
  std::uint64_t seed = 1;
  double seconds = 60.0;
  double sample_time = 0.02;
  std::optional<double> payload;
};
std::unique_ptr<Programme> operator_work(const Machine& machine, const PlantParameters& parameters,
                                         const WorkRequest& request);

/// Work cycles: to the load, take it, lift, slew or swing, place, put down, return. Machine and parameters must outlive it.
std::unique_ptr<Programme> work_cycles(const Machine& machine, const PlantParameters& parameters,
                                       const WorkRequest& request);

/// A table over time. Rows are instants, NaN in `payload` where it does not change.
struct TimeTable {
  Eigen::VectorXd t;          ///< [s]
  Eigen::MatrixXd values;     ///< one column for each joint or cylinder
  Eigen::VectorXd payload;    ///< [kg], empty: `start_payload` throughout
  std::vector<double> start;  ///< joint positions at the begin
  double start_payload = 0.0;
};

/// Joint positions over time, tracked.
std::unique_ptr<Programme> tracked_motion(const Machine& machine, const PlantParameters& parameters,
                                          TimeTable motion);
/// Commands over time, replayed as they are.
std::unique_ptr<Programme> replayed_commands(TimeTable commands);

/// A payload that the machine carries in most of its postures, at most 4 t. [kg]
double usual_payload(const Machine& machine);

}  // namespace sparflow::plant
