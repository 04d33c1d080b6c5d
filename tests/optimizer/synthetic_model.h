#pragma once
/// A synthetic model of any machine that needs no log: each pressure is force / area plus a constant, with some kernel
/// terms added so that all derivatives of the pressure model differ from zero.
#include <random>

#include "models/chain/crane_model.h"

namespace sparflow::test_support {

inline GaussianProcess synthetic_process(double area, bool extend, double full_flow,
                                         double force_span, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  GpParameters p;
  const int n = 24;
  p.length_flow = 0.4 * full_flow;
  p.length_force = 0.4 * force_span;
  p.signal_std = 10e5;
  p.noise_std = 0.8e5;
  p.mean_constant = 15e5;
  p.mean_slope = (extend ? 1.0 : -1.0) / area;
  p.flow.resize(n);
  p.force.resize(n);
  p.weight.resize(n);
  for (int i = 0; i < n; ++i) {
    p.flow[i] = full_flow * unit(random);
    p.force[i] = force_span * (2.0 * unit(random) - 1.0);
    p.weight[i] = (unit(random) - 0.3) * 4e5 / (p.signal_std * p.signal_std);
  }
  p.variance_core = Eigen::MatrixXd::Zero(n + 2, n + 2);
  p.flow_max = full_flow;
  p.force_min = -force_span;
  p.force_max = force_span;
  p.data_count = n;
  return GaussianProcess(p);
}

inline CraneModel synthetic_model(Machine machine) {
  CraneModel model = CraneModel::untrained(std::move(machine));
  for (int i = 0; i < model.machine.cylinder_count(); ++i) {
    const Cylinder& c = model.machine.cylinders[static_cast<std::size_t>(i)];
    CylinderModel& learned = model.cylinders[static_cast<std::size_t>(i)];
    learned.margin = (6.0 + 2.0 * i) * 1e5;
    if (!c.hydraulic()) continue;
    const double span = 150e5 * c.area_piston();
    const auto seed = static_cast<unsigned>(17 + 2 * i);
    learned.extend = synthetic_process(c.area_piston(), true, 0.15 * c.area_piston(), span, seed);
    learned.retract = synthetic_process(c.area_rod(), false, 0.15 * c.area_rod(), span, seed + 1);
  }
  return model;
}

}  // namespace sparflow::test_support
