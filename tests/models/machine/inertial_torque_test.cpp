/// Inertial torques by other methods: Lagrange's equation on numeric kinetic energy, Orocos KDL, the pendulum by hand,
/// and the balance of energy along a motion.
#include "models/machine/inertial_torque.h"

#include <gtest/gtest.h>

#include <kdl/chaindynparam.hpp>

#include "models/math/taylor.h"
#include "tests/models/effects/effects_support.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;
using test_support::numeric_derivative;
using test_support::numeric_partial;
using test_support::Random;

VectorXd torque_of(const Machine& machine, const VectorXd& x, double payload) {
  const Eigen::Index n = machine.joint_count();
  return inertial_torque<double>(machine, x.head(n), x.segment(n, n), x.tail(n), payload);
}

/// Kinetic energy from numeric velocities of every mass along q + t qd: it has no code in common with Newton-Euler.
double kinetic_energy(const Machine& machine, const VectorXd& q, const VectorXd& qd,
                      double payload) {
  const auto speed2 = [&](const auto& position) {
    return numeric_derivative([&](double t) { return position(VectorXd(q + t * qd)); }, 0.0)
        .squaredNorm();
  };
  double energy = 0.0;
  for (const Link& link : machine.links) {
    energy += 0.5 * link.mass * speed2([&](const VectorXd& at) {
                const auto frames = forward_kinematics<double>(machine, at);
                Eigen::Vector3d p = point_in_base(frames, link.joint, link.cog);
                if (link.slides_with >= 0) {
                  const auto s = static_cast<std::size_t>(link.slides_with);
                  p += link.fraction * at[link.slides_with] *
                       (frames[s].rotation * machine.joints[s].axis);
                }
                return p;
              });
    // rate about the axis of the last revolute joint
    const auto frames = forward_kinematics<double>(machine, q);
    Eigen::Vector3d rate = Eigen::Vector3d::Zero(), axis = Eigen::Vector3d::Zero();
    for (int k = 0; k <= link.joint; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (machine.joints[i].type != JointType::kRevolute) continue;
      axis = frames[i].rotation * machine.joints[i].axis;
      rate += axis * qd[k];
    }
    energy += 0.5 * link.inertia * std::pow(rate.dot(axis), 2);
  }
  energy +=
      0.5 * payload * speed2([&](const VectorXd& at) { return tip_position<double>(machine, at); });
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const int j = machine.cylinders[static_cast<std::size_t>(c)].joint;
    std::vector<LinkageMass<double>> masses;
    append_linkage_masses(machine, c, q[j], masses);
    for (std::size_t m = 0; m < masses.size(); ++m) {
      energy +=
          0.5 * masses[m].mass * speed2([&](const VectorXd& at) {
            std::vector<LinkageMass<double>> moved;
            append_linkage_masses(machine, c, at[j], moved);
            return point_in_base(forward_kinematics<double>(machine, at), j - 1, moved[m].position);
          });
    }
  }
  return energy;
}

/// Link inertias, which the machines of the other tests do not have.
Machine with_inertias(Machine machine) {
  double inertia = 40.0;
  for (Link& link : machine.links) link.inertia = inertia += 25.0;
  return machine;
}

TEST(InertialTorque, SatisfiesLagrangesEquation) {
  for (const Machine& plain : test_support::effect_machines()) {
    SCOPED_TRACE(plain.name);
    Machine machine = with_inertias(plain);
    machine.tip.payload_scale = 0.9;
    Random random(3);
    const Eigen::Index n = machine.joint_count();
    const VectorXd x = test_support::usable_state(machine, random);
    const VectorXd q = x.head(n), qd = x.segment(n, n), qdd = x.tail(n);
    const double payload = 350.0;
    const auto energy = [&](const VectorXd& at, const VectorXd& rate) {
      return kinetic_energy(machine, at, rate, 0.9 * payload);
    };
    const VectorXd torque = torque_of(machine, x, payload);
    // energies of 1e3 J, differentiated three times in a row: 1e-6 of the torque remains
    const double tolerance = 1e-6 * (1.0 + torque.norm());
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto momentum = [&](double t) {
        return numeric_partial(
            [&](const VectorXd& rate) { return energy(q + t * qd + 0.5 * t * t * qdd, rate); },
            VectorXd(qd + t * qdd), k, 0.05);
      };
      const double by_position =
          numeric_partial([&](const VectorXd& at) { return energy(at, qd); }, q, k, 0.02);
      EXPECT_NEAR(torque[k], numeric_derivative(momentum, 0.0, 0.05) - by_position, tolerance);
    }
  }
}

TEST(InertialTorque, AgreesWithKdlOnRigidChains) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    Random random(seed);
    Machine machine;
    machine.gravity.setZero();
    KDL::Chain chain;
    const auto vector = [](const Eigen::Vector3d& v) { return KDL::Vector(v[0], v[1], v[2]); };
    for (int k = 0; k < 4; ++k) {
      const bool slides = k == 2;
      machine.joints.push_back(
          test_support::make_joint("j", slides ? JointType::kPrismatic : JointType::kRevolute,
                                   random.vector(1.5), random.direction(), {-1, 1}));
      machine.links.push_back(
          test_support::make_link("l", k, random.uniform(50, 300), random.vector(0.8)));
      const Joint& joint = machine.joints.back();
      const Link& link = machine.links.back();
      // KDL: fixed offset first, then the joint with its inertia
      chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None),
                                    KDL::Frame(vector(joint.origin.translation()))));
      chain.addSegment(
          KDL::Segment(KDL::Joint(KDL::Vector::Zero(), vector(joint.axis),
                                  slides ? KDL::Joint::TransAxis : KDL::Joint::RotAxis),
                       KDL::Frame::Identity(), KDL::RigidBodyInertia(link.mass, vector(link.cog))));
    }
    machine.tip = {3, {0, 0, 0}};
    KDL::JntArray q(4), qd(4), coriolis(4);
    VectorXd x(12);
    for (int k = 0; k < 4; ++k) {
      q(static_cast<unsigned>(k)) = x[k] = random.uniform(-1, 1);
      qd(static_cast<unsigned>(k)) = x[4 + k] = random.uniform(-1, 1);
      x[8 + k] = random.uniform(-1, 1);
    }
    KDL::ChainDynParam dynamics(chain, KDL::Vector::Zero());
    KDL::JntSpaceInertiaMatrix mass(4);
    ASSERT_EQ(dynamics.JntToMass(q, mass), 0);
    ASSERT_EQ(dynamics.JntToCoriolis(q, qd, coriolis), 0);
    const VectorXd expected = mass.data * x.tail(4) + coriolis.data;
    // same arithmetic in another order
    EXPECT_LT((torque_of(machine, x, 0.0) - expected).norm(), 1e-10 * (1.0 + expected.norm()));
  }
}

TEST(InertialTorque, PendulumByHand) {
  Machine machine;
  machine.joints = {
      test_support::make_joint("boom", JointType::kRevolute, {0, 0, 2}, {0, -1, 0}, {-1, 1})};
  machine.links = {test_support::make_link("boom", 0, 100, {2, 0, 0})};
  machine.links[0].inertia = 30.0;
  machine.tip = {0, {3, 0, 0}};
  const VectorXd x = Eigen::Vector3d(0.4, 0.7, 0.5);
  // (m l^2 + I + m_payload l_tip^2) qdd; turning steadily needs no torque
  EXPECT_NEAR(torque_of(machine, x, 50.0)[0], (400.0 + 30.0 + 450.0) * 0.5, 1e-10);
}

TEST(InertialTorque, PowerIsTheRateOfKineticEnergy) {
  const Machine machine = with_inertias(test_support::swing_crane());
  Random random(8);
  const Eigen::Index n = machine.joint_count();
  for (int i = 0; i < 3; ++i) {
    const VectorXd x = test_support::usable_state(machine, random);
    const VectorXd q = x.head(n), qd = x.segment(n, n), qdd = x.tail(n);
    const double rate = numeric_derivative(
        [&](double t) {
          return kinetic_energy(machine, q + t * qd + 0.5 * t * t * qdd, qd + t * qdd, 200.0);
        },
        0.0, 0.05);
    const double power = torque_of(machine, x, 200.0).dot(qd);
    EXPECT_NEAR(power, rate, 1e-8 * (1.0 + std::abs(power)));  // two numeric derivatives in a row
  }
}

TEST(TaylorSeries, FourthDerivativesOfComposedFunctions) {
  const auto f = [](const auto& x) {
    using std::cos;
    using std::sin;
    using std::sqrt;
    using T = std::decay_t<decltype(x)>;
    return sqrt(T(2.0) + sin(x) * x) / (T(1.5) + cos(x));
  };
  const auto t = f(TaylorSeries<4>::variable(0.7));
  for (int k = 0; k < 4; ++k) {
    const double numeric = numeric_derivative(
        [&](double x) { return f(TaylorSeries<4>::variable(x)).derivative(k); }, 0.7);
    EXPECT_NEAR(t.derivative(k + 1), numeric, 1e-9 * (1.0 + std::abs(numeric)));
  }
  EXPECT_DOUBLE_EQ(t.derivative(0), f(0.7));
}

}  // namespace
}  // namespace sparflow
