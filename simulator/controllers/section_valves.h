#pragma once
/// Valve sections by full speed and dead band in each direction, as learned or as the machine file tells them.
#include "simulator/controllers/controller.h"

namespace sparflow::control {

struct ValveSection {
  double full_extend = 0.1, full_retract = 0.1;  ///< [m/s] rod speed at full lever
  double dead_extend = 0.0, dead_retract = 0.0;  ///< [-] lever at which flow begins
};

/// Of the machine file: full flows of the valves, of the pump where none is told; of drives without hydraulics the speed
/// limit of the joint. Dead bands are not in a machine file and are 0.
std::vector<ValveSection> sections_of(const Machine& machine);

class SectionValves : public ValveModel {
 public:
  explicit SectionValves(std::vector<ValveSection> sections) : sections_(std::move(sections)) {}
  double lever(int cylinder, double speed) const override;
  double full_speed(int cylinder, bool extend) const override;

 private:
  std::vector<ValveSection> sections_;
};

}  // namespace sparflow::control
