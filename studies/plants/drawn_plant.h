#pragma once
/// Plants of a machine, drawn anew by seed, for studies.
#include "simulator/plant/parameters/plant_parameters.h"
#include "simulator/random/random.h"

namespace sparflow::bench {

/// What its makers' data sheets leave open is drawn within a factor of 1.6 both ways; booms are rigid, sensors have no offset
/// and no delay.
plant::PlantParameters drawn_plant(const Machine& machine, simulator::Random& random);

}  // namespace sparflow::bench
