#pragma once
/// The work of `evaluate`: a motion of one's own, priced by the exact law and judged by limits.
#include <string>
#include <vector>

#include "apps/report/motion_pages/evaluation.h"
#include "apps/tasks/task.h"
#include "identification/log/log.h"
#include "models/chain/crane_model.h"
#include "problems/problem.h"

namespace sparflow {

/// A motion as somebody gives it.
struct OwnMotion {
  std::string name;                ///< of its file, without folder
  Trajectory motion;               ///< rows with speeds and accelerations
  bool from_positions = false;     ///< speeds were found by smoothing positions
  double payload = 0.0;            ///< median of a log that measures it [kg]
  std::string payload_note;        ///< a sentence where the log's payload changes
  std::vector<std::string> notes;  ///< whole sentences
};

/// A motion whose speeds are known. @throws UsageError where its joints are not the machine's, or it has fewer than two rows
OwnMotion own_motion(const std::string& name, Trajectory motion, const Machine& machine);
/// The longest stretch of a log in which all positions are known. @throws InputError where there is none
OwnMotion own_motion(const Log& log, const Machine& machine);
/// Columns named as in a file: rows as they are where each joint has a speed and an acceleration, else a log.
/// @param mapping path of a mapping file for logs, or empty  @throws InputError
OwnMotion own_motion(const std::string& name, std::vector<LogColumn> columns,
                     const Machine& machine, const std::string& mapping);
/// The same of a file. @throws InputError
OwnMotion load_own_motion(const std::string& path, const Machine& machine,
                          const std::string& mapping, const Listener& listener);

struct EvaluateTask {
  std::string verb = "evaluate";  ///< which sentences begin with
  double payload = -1.0;          ///< [kg] negative: that of the problem or of the log
};

struct Evaluated {
  MotionProblem
      problem;  ///< that is given, or the machine's own limits from the motion's start to its end
  MotionEvaluation evaluation;
  bool by_problem = false;  ///< whether a problem judges it
};

/// @param problem of one move; null: the machine's own limits
/// @throws UsageError for a payload outside its range  @throws InputError for a cycle
Evaluated evaluate_task(const CraneModel& model, const MotionProblem* problem, OwnMotion given,
                        const EvaluateTask& task);

/// The motion with flows, pressures and commands as a motion file. @param rate rows per second [Hz]; 0: as in the motion
std::string evaluated_csv(const CraneModel& model, const Evaluated& evaluated, double rate);

}  // namespace sparflow
