#pragma once
/// A machine file to look at: text, JSON and page of `machine`.
#include <string>
#include <vector>

#include "apps/report/page/page.h"
#include "models/machine/linkage_review.h"

namespace sparflow {

struct MachineReview {
  Machine machine;
  std::string file;
  double payload = 0.0;     ///< [kg] of the second column of forces
  int rows = 9;             ///< of each table
  Eigen::VectorXd posture;  ///< of the joints that stand still [rad] or [m]
  std::vector<std::string> warnings;
};

/// Draws the machine while each joint moves over its range in turn; curves and table of every cylinder.
Page machine_page(const MachineReview& review);

/// Returns the same numbers as JSON (keys: docs/commands.md).
std::string machine_json(const MachineReview& review);

/// Returns one table for each cylinder.
std::string machine_table(const MachineReview& review);

}  // namespace sparflow
