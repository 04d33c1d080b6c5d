#pragma once
/// Masses and centres that give the static forces which the logs determine.
///
/// Forces depend on combinations of masses alone (the base parameters; Gautier, Khalil 1990). By convention the centres of
/// links of which nothing else is known lie on the line from their joint to the next, and half way along it, so that outer
/// links get the mass that their moment asks for, inner links the rest.
#include <vector>

#include "identification/machine_from_log/load_fit.h"

namespace sparflow::from_log {

struct RealisedMasses {
  std::vector<LinkMoments>
      links;                 ///< by link of the machine; those without open values as they are
  bool possible = false;     ///< masses that are not negative, with centres near their links
  Eigen::VectorXd solution;  ///< by unknown, the same
  std::vector<FoundValue> combinations;
  std::vector<MachineQuestion> questions;
  std::vector<std::string> notes;
};

/// @param obstacle why no force could be used at all, a sentence's part; empty: none
RealisedMasses realise_masses(const Known& known, const std::vector<LoadRows>& loads,
                              const LoadFit& fit, const std::string& obstacle);

}  // namespace sparflow::from_log
