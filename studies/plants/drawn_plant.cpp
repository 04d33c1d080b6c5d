#include "studies/plants/drawn_plant.h"

#include <cmath>

#include "simulator/plant/parameters/parameter_table.h"

namespace sparflow::bench {

plant::PlantParameters drawn_plant(const Machine& machine, simulator::Random& random) {
  plant::PlantParameters p = plant::default_parameters(machine);
  p.flex_angle = 0.0;
  p.pressure_offset.assign(machine.cylinders.size(), 0.0);
  p.sensors.delay = p.sensors.drop_out = 0.0;
  for (plant::PumpParameters& pump : p.pumps) pump.flow_sharing = random.chance(0.5) ? 1.0 : 0.0;
  if (random.chance(0.5)) p.pendulum.rope_length = 0.0;
  for (const char* key : {"bulk_modulus_MPa", "air_fraction", "viscosity_40_mm2_s", "tank_drop_bar",
                          "hose_volume_l", "hose_modulus_MPa", "line_drop_bar", "return_drop_bar",
                          "spool_frequency_Hz", "dead_band_extend", "dead_band_retract",
                          "hysteresis", "coulomb_friction_N", "viscous_friction_N_s_m",
                          "leakage_lpm_100bar", "response_s", "line_delay_s", "compensator_bar"}) {
    const plant::ParameterRow& row = *plant::find_parameter(key);
    const std::size_t count = row.place == plant::Place::kPlant      ? 1
                              : row.place == plant::Place::kCylinder ? machine.cylinders.size()
                                                                     : machine.pumps.size();
    for (std::size_t i = 0; i < count; ++i) row.value(p, i) *= std::pow(1.6, random.uniform(-1, 1));
  }
  return p;
}

}  // namespace sparflow::bench
