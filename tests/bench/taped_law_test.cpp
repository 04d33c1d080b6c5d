/// The law that ADOL-C tapes for the comparison of speeds, written a second time, against the one of the program: pressure
/// models with a corner and beyond the learned loads, demands and the smooth law of the pump.
#include <gtest/gtest.h>

#include "bench/motion_speed_derivatives.h"
#include "models/files/machine_file.h"
#include "models/hydraulics/gaussian_process.h"
#include "problems/bundled.h"
#include "tests/optimizer/knot_support.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow::bench {
namespace {

/// The synthetic process with a slope of its mean over the flow and a corner inside the learned loads, which are so few that many samples lie beyond them.
GaussianProcess with_corner_and_border(const GaussianProcess& process, int side, double area) {
  GpParameters p = process.parameters();
  p.corner = {2e5, 1e8, 0.3 * side / area};
  p.mean_flow_slope = 4e8;  // 4 bar at a litre a second
  p.force_min *= 0.2;
  p.force_max *= 0.2;
  p.beyond = {side, 1.0 / area, 5e5, 0.8 / area, 0.6 / area, 1e5};
  return GaussianProcess(p);
}

TEST(TapedLaw, HasTheDerivativesOfTheProgramsLaw) {
  const MotionProblem problem =
      test_support::problem_for(load_machine(bundled_file("machines/loader_crane.yaml")), 3);
  CraneModel model = test_support::synthetic_model(problem.machine);
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    const Cylinder& c = model.machine.cylinders[i];
    CylinderModel& learned = model.cylinders[i];
    learned.extend = with_corner_and_border(learned.extend, 1, c.area_piston());
    learned.retract = with_corner_and_border(learned.retract, -1, c.area_rod());
  }
  CraneKnotOptions options;
  options.smoothing.pressure = 0.3e5;
  options.modes.resize(3, 3);
  options.modes << CylinderMode::kExtend, CylinderMode::kExtend, CylinderMode::kExtend,  //
      CylinderMode::kRetract, CylinderMode::kExtend, CylinderMode::kRetract,             //
      CylinderMode::kRest, CylinderMode::kRetract, CylinderMode::kExtend;
  const auto ours = std::make_shared<CraneKnotModel>(model, problem, options);
  const auto inner = std::make_shared<CraneKnotModel>(model, problem, options);
  const std::shared_ptr<KnotModel> taped = with_adolc(model, problem, options, inner);
  if (taped == nullptr) GTEST_SKIP() << "built without ADOL-C";
  // Two ways of the same formulas: rounding of sums of kernels, as in bench/motion_speed, which stops at the same limit.
  EXPECT_LT(largest_difference(*ours, *taped, problem, options.modes, 300), 1e-9);
}

}  // namespace
}  // namespace sparflow::bench
