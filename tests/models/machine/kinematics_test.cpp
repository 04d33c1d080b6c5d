/// Kinematics against Orocos KDL, an independent library, for random chains of one to seven joints.
#include "models/machine/kinematics.h"

#include <gtest/gtest.h>

#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>

#include "models/math/jet.h"
#include "tests/models/test_machines.h"

namespace sparflow {
namespace {

using test_support::kDerivativeTolerance;
using test_support::Random;
using test_support::random_configuration;

// Seven rotations and offsets of a few metres: some tens of roundings of numbers of order ten.
constexpr double kRounding = 1e-12;

KDL::Vector kdl(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
KDL::Rotation kdl(const Eigen::Matrix3d& r) {
  return {r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)};
}
Eigen::Vector3d eigen(const KDL::Vector& v) { return {v.x(), v.y(), v.z()}; }

/// The machine's joints as KDL segments (a segment's frame is the link frame), then the tip point.
KDL::Chain kdl_chain(const Machine& machine) {
  KDL::Chain chain;
  for (const Joint& joint : machine.joints) {
    const KDL::Frame origin(kdl(Eigen::Matrix3d(joint.origin.linear())),
                            kdl(Eigen::Vector3d(joint.origin.translation())));
    const auto type =
        joint.type == JointType::kRevolute ? KDL::Joint::RotAxis : KDL::Joint::TransAxis;
    chain.addSegment(KDL::Segment(
        joint.name, KDL::Joint(joint.name, origin.p, origin.M * kdl(joint.axis), type), origin));
  }
  chain.addSegment(
      KDL::Segment("tip", KDL::Joint("tip", KDL::Joint::None), KDL::Frame(kdl(machine.tip.xyz))));
  return chain;
}

KDL::JntArray kdl_array(const Eigen::VectorXd& q) {
  KDL::JntArray array(static_cast<unsigned>(q.size()));
  array.data = q;
  return array;
}

std::vector<Machine> chains() {
  std::vector<Machine> machines = test_support::all_test_machines();
  for (unsigned seed = 0; seed < 20; ++seed) {
    machines.push_back(test_support::random_machine(1 + static_cast<int>(seed % 7), 1000 + seed));
  }
  return machines;
}

TEST(Kinematics, FramesOfAllLinksAgreeWithKdl) {
  for (const Machine& machine : chains()) {
    SCOPED_TRACE(machine.name);
    const KDL::Chain chain = kdl_chain(machine);
    KDL::ChainFkSolverPos_recursive solver(chain);
    Random random(3);
    for (int i = 0; i < 5; ++i) {
      const Eigen::VectorXd q = random_configuration(machine, random);
      const std::vector<Frame<double>> frames = forward_kinematics<double>(machine, q);
      ChainGeometry geometry(machine);
      geometry.update(machine, q.data());
      for (int k = 0; k < machine.joint_count(); ++k) {
        KDL::Frame expected;
        ASSERT_EQ(solver.JntToCart(kdl_array(q), expected, k + 1), 0);
        const auto at = static_cast<std::size_t>(k);
        for (const auto& [rotation, position] :
             {std::pair{frames[at].rotation, frames[at].position},
              std::pair{geometry.rotation[at], geometry.origin[at]}}) {
          EXPECT_LT((position - eigen(expected.p)).norm(), kRounding);
          for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
              EXPECT_NEAR(rotation(row, column), expected.M(row, column), kRounding);
            }
          }
        }
      }
      KDL::Frame tip;
      ASSERT_EQ(solver.JntToCart(kdl_array(q), tip), 0);
      EXPECT_LT((tip_position<double>(machine, q) - eigen(tip.p)).norm(), kRounding);
    }
  }
}

TEST(Kinematics, TipJacobianAgreesWithKdl) {
  for (const Machine& machine : chains()) {
    SCOPED_TRACE(machine.name);
    const KDL::Chain chain = kdl_chain(machine);
    KDL::ChainJntToJacSolver solver(chain);
    Random random(4);
    for (int i = 0; i < 5; ++i) {
      const Eigen::VectorXd q = random_configuration(machine, random);
      KDL::Jacobian expected(static_cast<unsigned>(machine.joint_count()));
      ASSERT_EQ(solver.JntToJac(kdl_array(q), expected), 0);
      const Eigen::Matrix3Xd jacobian =
          point_jacobian_matrix(machine, q, machine.tip.joint, machine.tip.xyz);
      EXPECT_LT((jacobian - expected.data.topRows<3>()).norm(), kRounding);
    }
  }
}

TEST(Kinematics, HessianIsTheDerivativeOfTheJacobianAndAgreesWithJets) {
  for (const Machine& machine : chains()) {
    SCOPED_TRACE(machine.name);
    Random random(5);
    const Eigen::VectorXd q = random_configuration(machine, random);
    const int n = machine.joint_count();
    for (int link = 0; link < n; ++link) {
      const Eigen::Vector3d local = random.vector(1.0);
      ChainGeometry geometry(machine);
      geometry.update(machine, q.data());
      const Eigen::Vector3d p = geometry.point(link, local);
      for (int k = 0; k < n; ++k) {
        const Eigen::Vector3d column = point_jacobian(geometry, link, p, k);
        for (int i = 0; i <= k; ++i) {
          const Eigen::Vector3d second = point_hessian(geometry, i, column);
          const auto jacobian_column = [&](const Eigen::VectorXd& at) -> Eigen::Vector3d {
            return point_jacobian_matrix(machine, at, link, local).col(k);
          };
          const Eigen::Vector3d numeric = test_support::numeric_partial(jacobian_column, q, i);
          // distances in a chain of seven links reach some twenty metres
          EXPECT_LT((second - numeric).norm(), 20 * kDerivativeTolerance);

          Eigen::Matrix<Jet, Eigen::Dynamic, 1> jet(n);
          for (int j = 0; j < n; ++j) jet[j] = Jet(q[j]);
          jet[i] = Jet::variable(q[i], 0, 2);
          jet[k] = Jet::variable(q[k], i == k ? 0 : 1, 2);
          const Vector3<Jet> point =
              point_in_base(forward_kinematics<Jet>(machine, jet), link, local);
          for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(point[axis].value, p[axis], kRounding);
            EXPECT_NEAR(point[axis].gradient(i == k ? 0 : 1), column[axis], kRounding);
            EXPECT_NEAR(point[axis].hessian(i == k ? 0 : 1, 0), second[axis], kRounding);
          }
        }
      }
    }
  }
}

TEST(Kinematics, LinksBeyondAPointDoNotMoveIt) {
  const Machine machine = test_support::swing_crane();
  Random random(6);
  const Eigen::VectorXd q = random_configuration(machine, random);
  const Eigen::Matrix3Xd jacobian = point_jacobian_matrix(machine, q, 1, {1.0, 0.2, -0.3});
  EXPECT_GT(jacobian.col(0).norm(), 0.1);
  EXPECT_GT(jacobian.col(1).norm(), 0.1);
  EXPECT_EQ(jacobian.rightCols(2).norm(), 0.0);
  EXPECT_EQ(point_jacobian_matrix(machine, q, -1, {1, 2, 3}).norm(), 0.0);
}

TEST(Kinematics, LoaderCraneStretchedOutByHand) {
  // boom level, jib level, 2 m out: 3.4 + 3.0 + 2.0 ahead, 2.0 up
  const Eigen::Vector3d tip =
      tip_position<double>(test_support::loader_crane(), Eigen::Vector3d(0, 0, 2.0));
  EXPECT_NEAR((tip - Eigen::Vector3d(8.4, 0, 2.0)).norm(), 0.0, 1e-15);
  // positive boom angles lift: axis -y
  EXPECT_GT(tip_position<double>(test_support::loader_crane(), Eigen::Vector3d(0.1, 0, 2.0)).z(),
            2.5);
}

}  // namespace
}  // namespace sparflow
