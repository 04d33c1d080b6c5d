#pragma once
/// Parses column names: `pA_boom_bar` is the bore-side pressure of cylinder boom, in bar.
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
  std::string unit;     ///< SI unit after conversion, "" when unknown (candidates)
  double factor = 1.0;  ///< SI = factor * number + offset
  double offset = 0.0;
  std::string error;       ///< sentence that says why the unit cannot be used; "" when it can
  std::string suggestion;  ///< of a candidate: a similar name that has a role, or ""
};

/// @param name of the column; its unit may also follow in brackets: "pA_boom [bar]"
/// @param unit_below from a units row, "" when there is none
ColumnMeaning column_meaning(const std::string& name, const std::string& unit_below,
                             const Machine& machine);

/// @return the standard name of a role's column, e.g. "pA_boom_bar"
std::string usual_name(Role role, int index, const Machine& machine);

/// @return the standard names of all columns that this machine can have
std::vector<std::string> usual_names(const Machine& machine);

}  // namespace sparflow
