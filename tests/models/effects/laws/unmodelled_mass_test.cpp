/// The static torque of a mass whose centre lies beside its link, against the closed form of an arm in a vertical plane.
#include <gtest/gtest.h>

#include <cmath>

#include "models/effects/registry.h"
#include "models/files/machine_file.h"
#include "models/machine/static_force.h"

namespace sparflow {
namespace {

/// An arm that turns about -y, so that positive angles lift it, with an extension along it.
Machine telescopic_arm() {
  return parse_machine(R"(name: telescope
joints:
  - {name: arm, type: revolute, parent: base, axis: [0, -1, 0], position: [-0.4, 1.2], velocity: [-1, 1], acceleration: [-1, 1]}
  - {name: extension, type: prismatic, parent: arm, origin: {xyz: [2, 0, 0]}, axis: [1, 0, 0],
     position: [0, 1], velocity: [-1, 1], acceleration: [-1, 1]}
tip: {joint: extension, xyz: [1, 0, 0]}
links:
  - {name: arm, joint: arm, mass: 400, cog: [1, 0, 0], inertia: 300}
cylinders:
  - name: arm
    joint: arm
    bore: 0.12
    rod: 0.07
    linkage: {type: pins, barrel: {frame: base, xyz: [0.4, 0, -0.4]}, rod: {frame: arm, xyz: [0.7, 0, -0.1]}}
  - {name: extension, joint: extension, bore: 0.08, rod: 0.05, linkage: {type: direct}}
pumps:
  - {name: main, feeds: [arm, extension], max_flow_lpm: 90, max_pressure_bar: 250, standby_bar: 20}
valves:
  - {cylinder: arm, max_flow_lpm: {extend: 60, retract: 40}}
  - {cylinder: extension, max_flow_lpm: {extend: 60, retract: 40}}
)",
                       "telescope.yaml", "");
}

Eigen::VectorXd torque(const Machine& machine, const Eigen::VectorXd& q) {
  StaticForce statics(machine);
  statics.update(q.data(), 0.0, 0);
  return statics.torque();
}

class UnmodelledMassBesideItsLink : public testing::TestWithParam<const char*> {};

TEST_P(UnmodelledMassBesideItsLink, TurnsAndSlidesByTheClosedForm) {
  const Machine machine = telescopic_arm();
  const EffectAt at = parse_effect(GetParam(), machine);
  constexpr double kGravity = 9.81, kMass = 50.0, kAlong = 0.4, kBeside = 0.3;  // no threshold
  for (const bool has_mass : {true, false}) {  // a moment without a mass is the same but for m
    const double mass = has_mass ? kMass : 0.0;
    const double values[] = {mass, kMass * kAlong, kMass * kBeside};
    Machine changed = machine;
    at.effect->change_machine(changed, at.at, values);
    for (const double angle : {-0.3, 0.0, 0.3, 1.1}) {
      const Eigen::VectorXd q = Eigen::Vector2d(angle, 0.7);
      const Eigen::VectorXd added = torque(changed, q) - torque(machine, q);
      const bool slides = at.at == 1;
      const double along = kMass * kAlong + (slides ? mass * (2.0 + q[1]) : 0.0);
      // the height along sin q + beside cos q, times the weight, by q and by the extension
      EXPECT_NEAR(added[0],
                  kGravity * (along * std::cos(angle) - kMass * kBeside * std::sin(angle)),
                  1e-9 * kMass * kGravity);
      EXPECT_NEAR(added[1], slides ? mass * kGravity * std::sin(angle) : 0.0,
                  1e-9 * kMass * kGravity);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EachLink, UnmodelledMassBesideItsLink,
                         testing::Values("unmodelled_mass:arm", "unmodelled_mass:extension"),
                         [](const auto& one) {
                           return std::string(one.param).substr(sizeof "unmodelled_mass:" - 1);
                         });

}  // namespace
}  // namespace sparflow
