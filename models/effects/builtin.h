#pragma once
/// Factories of the built-in effects, one for each file of laws/; registry.cpp lists them.
#include <memory>

#include "models/effects/effect.h"

namespace sparflow {

std::unique_ptr<Effect> make_unmodelled_mass();
std::unique_ptr<Effect> make_payload_error();
std::unique_ptr<Effect> make_base_tilt();
std::unique_ptr<Effect> make_angle_offset();
std::unique_ptr<Effect> make_structural_flex();
std::unique_ptr<Effect> make_inertia();
std::unique_ptr<Effect> make_payload_sway();
std::unique_ptr<Effect> make_coulomb_friction();
std::unique_ptr<Effect> make_viscous_friction();
std::unique_ptr<Effect> make_stribeck_friction();
std::unique_ptr<Effect> make_load_friction();
std::unique_ptr<Effect> make_pad_friction();
std::unique_ptr<Effect> make_end_cushion();
std::unique_ptr<Effect> make_presliding();
std::unique_ptr<Effect> make_force_offset();
std::unique_ptr<Effect> make_pressure_offset();
std::unique_ptr<Effect> make_sensor_delay();
std::unique_ptr<Effect> make_pump_lag();
std::unique_ptr<Effect> make_valve_deadband();
std::unique_ptr<Effect> make_valve_lag();
std::unique_ptr<Effect> make_valve_pressure_drop();
std::unique_ptr<Effect> make_flow_saturation();
std::unique_ptr<Effect> make_leakage();
std::unique_ptr<Effect> make_compressibility();
std::unique_ptr<Effect> make_return_back_pressure();
std::unique_ptr<Effect> make_counterbalance();
std::unique_ptr<Effect> make_oil_temperature();
std::unique_ptr<Effect> make_line_loss();
std::unique_ptr<Effect> make_flow_dependent_margin();
std::unique_ptr<Effect> make_torque_limit();

/// First joint whose axis is nearly horizontal with all joints at zero (it luffs the arm); -1 = none.
int first_luffing_joint(const Machine& machine);

/// Unit vector along the link, from a joint towards the next one or the tip, in the joint's frame.
Eigen::Vector3d link_direction(const Machine& machine, int joint);

/// Unit vector across the link in the plane of its motion, towards which a positive rate of the joint turns the link, in
/// the joint's frame; of a sliding link, of the joint that turns it. Zero where nothing turns it or it lies along the axis.
Eigen::Vector3d link_normal(const Machine& machine, int joint);

}  // namespace sparflow
