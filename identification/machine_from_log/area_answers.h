#pragma once
/// Bores and rods from areas, and questions where areas are not determined.
#include <string>
#include <vector>

#include "identification/machine_from_log/load_fit.h"

namespace sparflow::from_log {

struct AreaAnswers {
  struct Diameter {
    OpenKind kind = OpenKind::kBore;
    int cylinder = 0;
    double value = 0.0;  ///< [m]
    std::string remark;
  };
  std::vector<Diameter> diameters;
  std::vector<FoundValue> values;
  std::vector<MachineQuestion> questions;
};

/// @param obstacle why no force could be used at all; empty: none
AreaAnswers answer_areas(const Known& known, const std::vector<LoadRows>& loads, const LoadFit& fit,
                         const std::string& obstacle);

}  // namespace sparflow::from_log
