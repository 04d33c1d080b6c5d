#pragma once
/// The posture nearest to a given one whose tip is at a point, by damped least squares within the joints' ranges.
/// Source: Nakamura, Hanafusa (1986), J. Dynamic Systems, Measurement, and Control 108(3).
#include <Eigen/Dense>
#include <optional>

#include "models/machine/machine.h"

namespace sparflow::control {

/// Joint movements are weighed by their ranges, so that joints in rad and in m compare.
/// @return nothing where the search does not get within `within` [m] of the tip
std::optional<Eigen::VectorXd> posture_with_tip(const Machine& machine, const Eigen::VectorXd& near,
                                                const Eigen::Vector3d& tip, double within);

/// The weighted pseudo-inverse of a tip Jacobian at these weights of the joints' rates: rates of least weighted squares
/// that give the tip speed `v`.
/// @param damping [m/s per weight] of nearly singular postures
Eigen::VectorXd weighted_rates(const Eigen::Matrix3Xd& jacobian, const Eigen::VectorXd& weights,
                               const Eigen::Vector3d& v, double damping);

/// Ranges of the joints [rad] or [m], 0 for joints without a drive.
Eigen::VectorXd driven_ranges(const Machine& machine);

}  // namespace sparflow::control
