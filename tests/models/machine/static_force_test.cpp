/// Static torques and cylinder forces, each recomputed by another code path: numeric gradients of the
/// potential energy, Jets through the templated form, and Orocos KDL.
#include "models/machine/static_force.h"

#include <gtest/gtest.h>

#include <kdl/chaindynparam.hpp>

#include "models/math/jet.h"
#include "tests/models/test_machines.h"

namespace sparflow {
namespace {

using test_support::kDerivativeTolerance;
using test_support::numeric_partial;
using test_support::Random;
using test_support::random_configuration;

using JetVector = Eigen::Matrix<Jet, Eigen::Dynamic, 1>;

/// Two hand-derived or Jet results differ by rounding only; sums over a dozen masses and quotients with
/// small dx/dq amplify it to some 1e3 roundings.
constexpr double kSamePathTolerance = 1e-11;

/// Seeds coordinates i and k (second slot unused when they are the same).
JetVector seeded(const Eigen::VectorXd& q, Eigen::Index i, Eigen::Index k) {
  JetVector jet(q.size());
  for (Eigen::Index j = 0; j < q.size(); ++j) jet[j] = Jet(q[j]);
  jet[k] = Jet::variable(q[k], 1, 2);
  jet[i] = Jet::variable(q[i], 0, 2);
  return jet;
}

/// Away from dead centres: near dx/dq = 0 a force grows without bound and so do its derivatives. (A machine
/// file with a dead centre in a joint's range is refused; random linkages may have one.)
Eigen::VectorXd usable_configuration(const Machine& machine, Random& random) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const Eigen::VectorXd q = random_configuration(machine, random);
    bool usable = true;
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const int joint = machine.cylinders[static_cast<std::size_t>(c)].joint;
      usable = usable && std::abs(linkage_rates(machine, c, q[joint]).d1) > 0.08;
    }
    if (usable) return q;
  }
  throw std::logic_error("no usable configuration of " + machine.name);
}

/// Calls `check(machine, q, payload)` for every test machine at several random configurations.
template <class Check>
void for_random_states(const Check& check) {
  for (Machine machine : test_support::all_test_machines()) {
    SCOPED_TRACE(machine.name);
    Random random(11);
    for (int i = 0; i < 4; ++i) {
      machine.tip.payload_scale = i == 1 ? 1.0 : 0.9;
      check(machine, usable_configuration(machine, random), i == 0 ? 0.0 : random.uniform(0, 2000));
    }
  }
}

TEST(StaticForce, TorqueIsTheGradientOfThePotentialEnergy) {
  for_random_states([](const Machine& machine, const Eigen::VectorXd& q, double payload) {
    StaticForce statics(machine);
    statics.update(q.data(), payload, 0);
    const auto energy = [&](const Eigen::VectorXd& at) {
      return potential_energy(machine, at, payload);
    };
    // Numeric differences round at 1e-13 of the energy over the step; knuckles need a small one.
    const double scale = 1.0 + std::abs(energy(q)) + statics.torque().norm();
    for (Eigen::Index k = 0; k < q.size(); ++k) {
      EXPECT_NEAR(statics.torque()[k], numeric_partial(energy, q, k, 4e-3),
                  kDerivativeTolerance * scale);
    }
  });
}

/// Lower orders carry fewer derivatives of the linkages' masses through the same operations.
TEST(StaticForce, LowerOrdersGiveTheSameValuesAndGradients) {
  for_random_states([](const Machine& machine, const Eigen::VectorXd& q, double payload) {
    StaticForce values(machine), gradients(machine), all(machine);
    values.update(q.data(), payload, 0);
    gradients.update(q.data(), payload, 1);
    all.update(q.data(), payload, 2);
    const double force = 1.0 + all.force().norm(), slope = 1.0 + all.force_jacobian().norm();
    EXPECT_LE((values.force() - all.force()).norm(), kSamePathTolerance * force);
    EXPECT_LE((gradients.force() - all.force()).norm(), kSamePathTolerance * force);
    EXPECT_LE((gradients.force_jacobian() - all.force_jacobian()).norm(),
              kSamePathTolerance * slope);
  });
}

TEST(StaticForce, EnergyOfOneMassByHand) {
  Machine m;
  m.joints = {
      test_support::make_joint("boom", JointType::kRevolute, {0, 0, 2}, {0, -1, 0}, {-1, 1})};
  m.links = {test_support::make_link("boom", 0, 100, {3, 0, 0})};
  m.cylinders = {test_support::make_cylinder("boom", 0, 0.1, 0.05,
                                             PinsLinkage{{0.5, 0, -1}, {0.5, 0, 0}, true})};
  m.tip = {0, {4, 0, 0}};
  const double q = 0.3, g = 9.81;
  EXPECT_NEAR(potential_energy(m, Eigen::VectorXd::Constant(1, q), 50),
              g * (100 * (2 + 3 * std::sin(q)) + 50 * (2 + 4 * std::sin(q))), 1e-9);
  StaticForce statics(m);
  statics.update(&q, 50, 1);
  const double torque = g * (100 * 3 + 50 * 4) * std::cos(q);
  EXPECT_NEAR(statics.torque()[0], torque, 1e-10 * torque);
  EXPECT_NEAR(statics.force()[0], torque / linkage_rates(m, 0, q).d1, 1e-10 * torque);
  EXPECT_GT(statics.force()[0], 0.0);  // the load pushes the rod of a lifting cylinder in
}

TEST(StaticForce, ACylinderThatShortensWhenTheJointRisesIsPulled) {
  const Machine machine = test_support::swing_crane();
  StaticForce statics(machine);
  Random random(12);
  for (int i = 0; i < 50; ++i) {
    const Eigen::VectorXd q = random_configuration(machine, random);
    statics.update(q.data(), 0.0, 0);
    ASSERT_LT(statics.length(2).d1, 0.0);
    EXPECT_EQ(statics.force()[2]<0.0, statics.torque()[2]> 0.0);
  }
}

/// Gravity torques of rigid links and payload by KDL's inverse dynamics.
TEST(StaticForce, TorqueOfRigidLinksAgreesWithKdl) {
  const auto kdl = [](const Eigen::Vector3d& v) { return KDL::Vector(v.x(), v.y(), v.z()); };
  for (unsigned seed = 0; seed < 20; ++seed) {
    Machine machine =
        test_support::random_machine(1 + static_cast<int>(seed % 7), 2000 + seed, false);
    std::erase_if(machine.links, [](const Link& link) { return link.slides_with >= 0; });
    SCOPED_TRACE(machine.name);
    const double payload = 350.0;
    KDL::Chain chain;
    for (int k = 0; k < machine.joint_count(); ++k) {
      const Joint& joint = machine.joints[static_cast<std::size_t>(k)];
      const Eigen::Matrix3d r = joint.origin.linear();
      const KDL::Frame origin(KDL::Rotation(r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2),
                                            r(2, 0), r(2, 1), r(2, 2)),
                              kdl(joint.origin.translation()));
      KDL::RigidBodyInertia inertia;
      for (const Link& link : machine.links) {
        if (link.joint == k) inertia = inertia + KDL::RigidBodyInertia(link.mass, kdl(link.cog));
      }
      if (machine.tip.joint == k) {
        inertia = inertia + KDL::RigidBodyInertia(payload, kdl(machine.tip.xyz));
      }
      const auto type =
          joint.type == JointType::kRevolute ? KDL::Joint::RotAxis : KDL::Joint::TransAxis;
      chain.addSegment(KDL::Segment(
          joint.name, KDL::Joint(joint.name, origin.p, origin.M * kdl(joint.axis), type), origin,
          inertia));
    }
    KDL::ChainDynParam dynamics(chain, kdl(machine.gravity));
    Random random(seed);
    KDL::JntArray q(chain.getNrOfJoints()), expected(chain.getNrOfJoints());
    q.data = random_configuration(machine, random);
    ASSERT_EQ(dynamics.JntToGravity(q, expected), 0);
    StaticForce statics(machine);
    statics.update(q.data.data(), payload, 0);
    EXPECT_LT((statics.torque() - expected.data).norm(),
              kSamePathTolerance * (1.0 + expected.data.norm()));
  }
}

TEST(StaticForce, TemplatedFormWithDoublesIsTheSame) {
  for_random_states([](const Machine& machine, const Eigen::VectorXd& q, double payload) {
    StaticForce statics(machine);
    statics.update(q.data(), payload, 0);
    const Eigen::VectorXd torque = static_torque<double>(machine, q, payload);
    const Eigen::VectorXd force = static_force<double>(machine, q, payload);
    EXPECT_LT((statics.torque() - torque).norm(), kSamePathTolerance * (1 + torque.norm()));
    EXPECT_LT((statics.force() - force).norm(), kSamePathTolerance * (1 + force.norm()));
  });
}

TEST(StaticForce, JacobianAndHessianAgreeWithJets) {
  for_random_states([](const Machine& machine, const Eigen::VectorXd& q, double payload) {
    StaticForce statics(machine);
    statics.update(q.data(), payload, 2);
    const Eigen::Index n = q.size();
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index k = 0; k <= i; ++k) {
        const JetVector force = static_force<Jet>(machine, seeded(q, i, k), payload);
        const JetVector torque = static_torque<Jet>(machine, seeded(q, i, k), payload);
        for (int c = 0; c < machine.cylinder_count(); ++c) {
          const Eigen::MatrixXd& hessian = statics.force_hessian(c);
          const double expected = i == k ? force[c].hessian(0, 0) : force[c].hessian(1, 0);
          const double scale =
              1 + statics.force().norm() + statics.force_jacobian().norm() + hessian.norm();
          EXPECT_NEAR(statics.force()[c], force[c].value, kSamePathTolerance * scale);
          EXPECT_NEAR(statics.force_jacobian()(c, i), force[c].gradient(0),
                      kSamePathTolerance * scale);
          EXPECT_NEAR(hessian(i, k), expected, kSamePathTolerance * scale);
          EXPECT_EQ(hessian(i, k), hessian(k, i));
        }
        for (Eigen::Index j = 0; j < n; ++j) {
          EXPECT_NEAR(statics.torque_jacobian()(j, i), torque[j].gradient(0),
                      kSamePathTolerance * (1 + statics.torque_jacobian().norm()));
        }
      }
    }
  });
}

TEST(StaticForce, JacobianAndHessianAgreeWithNumericDerivatives) {
  for_random_states([](const Machine& machine, const Eigen::VectorXd& q, double payload) {
    StaticForce statics(machine), moved(machine);
    statics.update(q.data(), payload, 2);
    const auto force = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
      moved.update(at.data(), payload, 1);
      return moved.force();
    };
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const auto gradient = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
        moved.update(at.data(), payload, 1);
        return moved.force_jacobian().row(c).transpose();
      };
      const Eigen::MatrixXd& hessian = statics.force_hessian(c);
      const double scale =
          1 + statics.force().norm() + statics.force_jacobian().norm() + hessian.norm();
      for (Eigen::Index k = 0; k < q.size(); ++k) {
        // the step suits knuckles, whose rates vary over centimetres; ten times the usual tolerance
        // because rounding grows with 1/step
        const Eigen::VectorXd first = numeric_partial(force, q, k, 2e-3);
        const Eigen::VectorXd second = numeric_partial(gradient, q, k, 2e-3);
        EXPECT_NEAR(statics.force_jacobian()(c, k), first[c], 10 * kDerivativeTolerance * scale);
        EXPECT_LT((hessian.col(k) - second).norm(), 10 * kDerivativeTolerance * scale);
      }
    }
  });
}

TEST(StaticForce, LowerOrdersGiveTheSameValues) {
  const Machine machine = test_support::swing_crane();
  Random random(13);
  const Eigen::VectorXd q = random_configuration(machine, random);
  StaticForce full(machine), part(machine);
  full.update(q.data(), 800, 2);
  part.update(q.data(), 800, 0);
  EXPECT_EQ(full.force(), part.force());
  part.update(q.data(), 800, 1);
  EXPECT_EQ(full.force_jacobian(), part.force_jacobian());
}

TEST(StaticForce, AWorkspaceKeepsNoPreviousState) {
  const Machine machine = test_support::knuckle_crane();
  Random random(14);
  const Eigen::VectorXd a = random_configuration(machine, random);
  const Eigen::VectorXd b = random_configuration(machine, random);
  StaticForce fresh(machine), used(machine);
  used.update(a.data(), 900, 2);
  used.update(b.data(), 0, 2);
  fresh.update(b.data(), 0, 2);
  EXPECT_EQ(fresh.force(), used.force());
  EXPECT_EQ(fresh.force_hessian(1), used.force_hessian(1));
}

TEST(StaticForce, ForceIsLinearInThePayload) {
  for_random_states([](const Machine& machine, const Eigen::VectorXd& q, double) {
    const Eigen::VectorXd f0 = static_force<double>(machine, q, 0);
    const Eigen::VectorXd f1 = static_force<double>(machine, q, 1000);
    const Eigen::VectorXd f2 = static_force<double>(machine, q, 2000);
    EXPECT_LT((f2 - f1 - (f1 - f0)).norm(), kSamePathTolerance * (1 + f2.norm()));
  });
}

TEST(StaticForce, RotatingTheWholeMachineAndGravityChangesNothing) {
  for_random_states([](const Machine& machine, const Eigen::VectorXd& q, double payload) {
    Machine turned = machine;
    const Eigen::Isometry3d turn(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()));
    turned.gravity = turn * machine.gravity;
    turned.joints[0].origin = turn * machine.joints[0].origin;
    for (Cylinder& c : turned.cylinders) {
      if (c.joint != 0) continue;
      if (auto* p = std::get_if<PinsLinkage>(&c.linkage)) p->parent_pin = turn * p->parent_pin;
      if (auto* f = std::get_if<FourBarLinkage>(&c.linkage)) {
        f->barrel = turn * f->barrel;
        f->rocker = turn * f->rocker;
      }
    }
    const Eigen::VectorXd before = static_force<double>(machine, q, payload);
    const Eigen::VectorXd after = static_force<double>(turned, q, payload);
    EXPECT_LT((after - before).norm(), kSamePathTolerance * (1 + before.norm()));
  });
}

TEST(StaticForce, AnOpenFourBarThrows) {
  Machine machine = test_support::loader_crane();
  std::get<FourBarLinkage>(machine.cylinders[1].linkage).rocker_length = 1.5;
  StaticForce statics(machine);
  const double q[] = {0.2, -1.0, 0.5};
  EXPECT_THROW(statics.update(q, 0, 0), std::domain_error);
}

}  // namespace
}  // namespace sparflow
