#pragma once
/// What a column's name says: `pA_boom_bar` is the piston-side pressure of cylinder boom, in bar.
#include <string>
#include <string_view>
#include <vector>

#include "identification/log/log.h"

namespace sparflow {

struct ColumnMeaning {
  bool is_time = false;
  Role role = Role::kCandidate;
  int index = -1;
  std::string signal;   ///< name without unit
  std::string unit;     ///< SI unit behind the door, "" when unknown (candidates)
  double factor = 1.0;  ///< SI = factor * number + offset
  double offset = 0.0;
  std::string error;       ///< the name has a role but its unit cannot be used: a sentence
  std::string suggestion;  ///< a candidate whose name is near one with a role: that name
};

/// @param name of the column; a unit may also stand in brackets behind it: "pA_boom [bar]"
/// @param unit_below from a units row, "" when there is none
ColumnMeaning column_meaning(const std::string& name, const std::string& unit_below,
                             const Machine& machine);

/// The name a role's column usually has, e.g. "pA_boom_bar".
std::string usual_name(Role role, int index, const Machine& machine);

/// All names the program gives a meaning to on this machine.
std::vector<std::string> usual_names(const Machine& machine);

}  // namespace sparflow
