#pragma once
#include <Eigen/Dense>

#include "models/hydraulics/gaussian_process.h"
#include "models/math/units.h"

namespace sparflow::test_support {

/// A process of three centres around (1e-3 m^3/s, 50 kN), small enough to be summed by hand.
inline GpParameters small_process(double constant, double slope) {
  GpParameters p;
  p.length_flow = 6e-4;
  p.length_force = 8e4;
  p.signal_std = 12 * units::kBar;
  p.noise_std = 1 * units::kBar;
  p.mean_constant = constant;
  p.mean_slope = slope;
  p.flow = Eigen::Array3d(3e-4, 1e-3, 1.6e-3);
  p.force = Eigen::Array3d(1e4, 6e4, 1.2e5);
  p.weight = Eigen::Array3d(4e-7, -2e-7, 5e-7);
  return p;
}

}  // namespace sparflow::test_support
