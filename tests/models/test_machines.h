#pragma once
/// Machines built in code, so that tests of the mathematics do not depend on the reader of machine files.
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "models/machine/machine.h"
#include "models/math/units.h"
#include "tests/models/numeric.h"

namespace sparflow::test_support {

inline Joint make_joint(std::string name, JointType type, Eigen::Vector3d xyz, Eigen::Vector3d axis,
                        Range position) {
  Joint joint;
  joint.name = std::move(name);
  joint.type = type;
  joint.origin.translation() = xyz;
  joint.axis = axis.normalized();
  joint.position = position;
  joint.velocity = {-0.2, 0.2};
  joint.acceleration = {-0.5, 0.5};
  return joint;
}

inline Link make_link(std::string name, int joint, double mass, Eigen::Vector3d cog) {
  Link link;
  link.name = std::move(name);
  link.joint = joint;
  link.mass = mass;
  link.cog = cog;
  return link;
}

inline Cylinder make_cylinder(std::string name, int joint, double bore, double rod,
                              Linkage linkage) {
  Cylinder cylinder;
  cylinder.name = std::move(name);
  cylinder.joint = joint;
  cylinder.bore = bore;
  cylinder.rod = rod;
  cylinder.linkage = linkage;
  return cylinder;
}

/// The bundled 21 t m loader crane: boom (pins), jib (knuckle), four telescope stages (direct), one pump.
inline Machine loader_crane() {
  Machine m;
  m.name = "loader-crane";
  m.joints = {make_joint("boom", JointType::kRevolute, {0, 0, 2.0}, {0, -1, 0}, {-0.20, 1.35}),
              make_joint("jib", JointType::kRevolute, {3.4, 0, 0}, {0, -1, 0}, {-2.30, 0.05}),
              make_joint("extension", JointType::kPrismatic, {3.0, 0, 0}, {1, 0, 0}, {0.0, 6.0})};
  m.tip = {2, {0, 0, 0}};
  m.links = {make_link("inner-boom", 0, 780, {1.55, 0, 0.10}),
             make_link("outer-boom", 1, 560, {1.25, 0, 0.05})};
  const double masses[] = {150, 125, 100, 85};
  const double cogs[] = {1.60, 1.65, 1.70, 1.75};
  for (int stage = 0; stage < 4; ++stage) {
    Link link =
        make_link("stage-" + std::to_string(stage + 1), 1, masses[stage], {cogs[stage], 0, 0});
    link.slides_with = 2;
    link.fraction = 0.25 * (stage + 1);
    m.links.push_back(link);
  }
  FourBarLinkage knuckle;
  knuckle.barrel = {1.20, 0, -0.35};
  knuckle.rocker = {3.20, 0, 0.0};
  knuckle.coupler = {0.30, 0, 0.0};
  knuckle.rocker_length = 0.60;
  knuckle.coupler_length = 0.50;
  knuckle.branch = -1;
  m.cylinders = {
      make_cylinder("boom", 0, 0.180, 0.115, PinsLinkage{{0.40, 0, 0.50}, {0.65, 0, -0.20}, true}),
      make_cylinder("jib", 1, 0.150, 0.100, knuckle),
      make_cylinder("extension", 2, 0.070, 0.050, DirectLinkage{})};
  m.cylinders[2].stages = 4;
  m.pumps = {{"main",
              PumpType::kLoadSensing,
              {0, 1, 2},
              120 * units::kLitrePerMinute,
              310 * units::kBar,
              22 * units::kBar}};
  return m;
}

/// A crane with two knuckles whose rockers, couplers, barrels and rods have masses; constant pressure.
inline Machine knuckle_crane() {
  Machine m;
  m.name = "knuckle-crane";
  m.joints = {
      make_joint("main", JointType::kRevolute, {-0.25, 0, 1.5655}, {0, -1, 0}, {-0.75, 1.45}),
      make_joint("jib", JointType::kRevolute, {2.4, 0, 0.07}, {0, -1, 0}, {-2.55, 0.20})};
  m.tip = {1, {2.429, 0, 0}};
  m.links = {make_link("main-boom", 0, 216.5, {1.134, 0, 0.1674}),
             make_link("jib", 1, 842.2, {0.9806, 0, 0.1814}),
             make_link("winch", 1, 54, {0.28722, 0, -0.29926})};
  FourBarLinkage main;
  main.barrel = {0.200, 0, 0.1195};
  main.rocker = {-0.365, 0, 1.4805};
  main.coupler = {0.340, 0, 0.010};
  main.rocker_length = 0.490;
  main.rocker_mass = 12.852;
  main.rocker_cog = 0.245;
  main.coupler_length = 0.170;
  main.coupler_mass = 14.152;
  main.coupler_cog = 0.0817;
  main.branch = -1;
  FourBarLinkage jib;
  jib.barrel = {0.750, 0, 0.045};
  jib.rocker = {2.365, 0, 0.235};
  jib.coupler = {0.280, 0, 0.005};
  jib.rocker_length = 0.490;
  jib.rocker_mass = 12.852;
  jib.rocker_cog = 0.245;
  jib.coupler_length = 0.220;
  jib.coupler_mass = 22.05;
  jib.coupler_cog = 0.110;
  jib.branch = -1;
  m.cylinders = {make_cylinder("main", 0, 0.160, 0.100, main),
                 make_cylinder("jib", 1, 0.150, 0.100, jib)};
  const double zero[] = {1.043, 1.1545}, barrel[] = {57.956, 55.774},
               barrel_cog[] = {0.4125, 0.4468};
  const double rod[] = {43.93, 45.885}, rod_cog[] = {0.429, 0.4694};
  for (std::size_t i = 0; i < 2; ++i) {
    m.cylinders[i].length_at_zero_stroke = zero[i];
    m.cylinders[i].barrel_mass = barrel[i];
    m.cylinders[i].barrel_cog = barrel_cog[i];
    m.cylinders[i].rod_mass = rod[i];
    m.cylinders[i].rod_cog = rod_cog[i];
  }
  m.pumps = {{"supply",
              PumpType::kConstantPressure,
              {0, 1},
              40 * units::kLitrePerMinute,
              250 * units::kBar,
              20 * units::kBar}};
  return m;
}

/// Four joints, spatial: a swing column on a slope (rack mounted the other way round), a boom lifted from
/// below by a pair of cylinders with masses, a jib whose cylinder lies on top and shortens as the jib
/// rises (dx/dq < 0), a telescope; two load-sensing pumps.
inline Machine swing_crane() {
  Machine m;
  m.name = "swing-crane";
  const Eigen::Matrix3d slope =
      Eigen::AngleAxisd(0.06, Eigen::Vector3d(1.0, 0.4, 0.0).normalized()).toRotationMatrix();
  m.joints = {make_joint("swing", JointType::kRevolute, {0.1, -0.2, 0.8}, {0, 0, 1}, {-2.0, 2.0}),
              make_joint("boom", JointType::kRevolute, {0.25, 0.05, 1.3}, {0, -1, 0}, {0.0, 1.2}),
              make_joint("jib", JointType::kRevolute, {2.8, 0, 0.1}, {0, -1, 0}, {-1.6, -0.1}),
              make_joint("extension", JointType::kPrismatic, {1.9, 0, 0}, {1, 0, 0}, {0.0, 2.5})};
  m.joints[0].origin.linear() = slope;
  m.tip = {3, {0.2, 0.05, -0.15}};
  m.links = {
      make_link("column", 0, 450, {0.05, 0.02, 0.6}), make_link("boom", 1, 520, {1.3, 0.03, 0.12}),
      make_link("jib", 2, 330, {0.9, -0.02, 0.06}), make_link("grab", 3, 120, {0.2, 0.0, -0.4})};
  Link stage = make_link("stage", 2, 140, {1.1, 0, 0});
  stage.slides_with = 3;
  stage.fraction = 0.5;
  m.links.push_back(stage);
  m.cylinders = {
      make_cylinder("swing", 0, 0.120, 0.060, RackLinkage{-0.16}),
      make_cylinder("boom", 1, 0.110, 0.070,
                    PinsLinkage{{0.45, 0.05, 0.35}, {0.75, 0.02, -0.10}, true}),
      make_cylinder("jib", 2, 0.100, 0.063, PinsLinkage{{1.2, 0, 0.45}, {0.05, 0, 0.38}, false}),
      make_cylinder("extension", 3, 0.060, 0.040, DirectLinkage{})};
  m.cylinders[1].parallel = 2;
  m.cylinders[1].barrel_mass = 38;
  m.cylinders[1].barrel_cog = 0.35;
  m.cylinders[1].rod_mass = 27;
  m.cylinders[1].rod_cog = 0.40;
  m.cylinders[2].barrel_mass = 30;
  m.cylinders[2].barrel_cog = 0.3;
  m.cylinders[3].barrel_mass = 12;
  m.cylinders[3].barrel_cog = 0.5;
  m.cylinders[3].rod_mass = 9;
  m.cylinders[3].rod_cog = 0.4;
  m.pumps = {{"front",
              PumpType::kLoadSensing,
              {0, 2},
              70 * units::kLitrePerMinute,
              260 * units::kBar,
              18 * units::kBar},
             {"rear",
              PumpType::kLoadSensing,
              {1, 3},
              110 * units::kLitrePerMinute,
              300 * units::kBar,
              24 * units::kBar}};
  return m;
}

/// A chain of `joints` joints with random types, axes, frames and masses, gravity in a random direction.
/// Every joint has a cylinder of a type that fits it, with pins well away from the axis.
inline Machine random_machine(int joints, unsigned seed, bool linkage_masses = true) {
  Random random(seed);
  Machine m;
  m.name = "random-" + std::to_string(joints) + "-" + std::to_string(seed);
  m.gravity = 9.81 * random.direction();
  for (int k = 0; k < joints; ++k) {
    const bool prismatic = random.integer(0, 2) == 0;
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(random.uniform(-3.0, 3.0), random.direction()).toRotationMatrix();
    m.joints.push_back(make_joint("joint-" + std::to_string(k),
                                  prismatic ? JointType::kPrismatic : JointType::kRevolute,
                                  random.vector(2.0), random.direction(), {-1.2, 1.2}));
    m.joints.back().origin.linear() = turn;
    const Joint& joint = m.joints.back();
    for (int i = random.integer(1, 2); i > 0; --i) {
      m.links.push_back(make_link("link", k, random.uniform(20, 400), random.vector(1.0)));
    }
    if (prismatic && k > 0) {
      Link stage = make_link("stage", k - 1, random.uniform(20, 200), random.vector(1.0));
      stage.slides_with = k;
      stage.fraction = random.uniform(0.1, 0.9);
      m.links.push_back(stage);
    }
    // two unit vectors that span the plane of rotation, in the joint's frame
    const Eigen::Vector3d u = joint.axis.unitOrthogonal(), v = joint.axis.cross(u);
    Linkage linkage = DirectLinkage{};
    const int kind = random.integer(0, 2);
    if (!prismatic && kind == 0) linkage = RackLinkage{random.uniform(0.1, 0.4)};
    if (!prismatic && kind == 1) {
      // pins near the plane, a quarter turn apart at q = 0, so that |q| < 1.2 stays away from the dead centre
      const Eigen::Vector3d fixed = 1.3 * v + 0.2 * random.uniform(-1, 1) * joint.axis;
      linkage = PinsLinkage{joint.origin * fixed, 0.5 * u + 0.1 * random.vector(1.0),
                            random.integer(0, 1) == 0};
    }
    if (!prismatic && kind == 2) {
      // rocker pin 0.25 from the joint, coupler pin 0.45: their distance stays in [0.2, 0.7], inside
      // what links of 0.55 and 0.5 can close
      FourBarLinkage f;
      f.rocker = joint.origin * (-0.25 * u);
      f.coupler = 0.45 * u + 0.05 * random.uniform(-1, 1) * joint.axis;
      f.barrel = joint.origin * (-1.5 * u + 0.6 * v + 0.1 * joint.axis);
      f.rocker_length = 0.55;
      f.coupler_length = 0.5;
      f.branch = random.integer(0, 1) == 0 ? 1 : -1;
      if (linkage_masses) {
        f.rocker_mass = random.uniform(5, 40);
        f.rocker_cog = 0.3;
        f.coupler_mass = random.uniform(5, 40);
        f.coupler_cog = 0.2;
      }
      linkage = f;
    }
    Cylinder cylinder = make_cylinder("cylinder-" + std::to_string(k), k, 0.1, 0.06, linkage);
    if (linkage_masses) {
      cylinder.barrel_mass = random.uniform(5, 60);
      cylinder.barrel_cog = random.uniform(0.1, 0.5);
      cylinder.rod_mass = random.uniform(5, 60);
      cylinder.rod_cog = random.uniform(0.1, 0.5);
    }
    m.cylinders.push_back(cylinder);
  }
  m.tip = {joints - 1, random.vector(1.0)};
  return m;
}

/// A configuration inside the joint ranges, a twentieth of the range away from their ends.
inline Eigen::VectorXd random_configuration(const Machine& machine, Random& random) {
  Eigen::VectorXd q(machine.joint_count());
  for (int j = 0; j < machine.joint_count(); ++j) {
    const Range& range = machine.joints[static_cast<std::size_t>(j)].position;
    const double margin = 0.05 * (range.hi - range.lo);
    q[j] = random.uniform(range.lo + margin, range.hi - margin);
  }
  return q;
}

/// The named cranes and a set of random chains of one to seven joints.
inline std::vector<Machine> all_test_machines() {
  std::vector<Machine> machines = {loader_crane(), knuckle_crane(), swing_crane()};
  for (int joints = 1; joints <= 7; ++joints) {
    for (unsigned seed = 0; seed < 3; ++seed) {
      machines.push_back(random_machine(joints, 100 * static_cast<unsigned>(joints) + seed));
    }
  }
  return machines;
}

}  // namespace sparflow::test_support
