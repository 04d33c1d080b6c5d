/// Effects of force: laws against hand cases, Jets against numeric derivatives over the registry,
/// columns against the laws, and what an effect must leave unchanged.
#include <gtest/gtest.h>

#include "models/effects/builtin.h"
#include "models/machine/inertial_torque.h"
#include "tests/models/effects/effects_support.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test_support::effect;
using test_support::instant_at;
using test_support::log_of;
using test_support::numeric_derivative;
using test_support::Random;
using test_support::stacked;
using test_support::swinging;
using test_support::swinging_log;

std::vector<double> typical(const EffectInfo& info) {
  std::vector<double> p;
  for (const EffectParameter& parameter : info.parameters) {
    p.push_back(parameter.typical != 0.0 ? parameter.typical : 0.5 * parameter.upper);
  }
  return p;
}

VectorXd added(const Effect& e, const Instant<double>& s, int at, std::vector<double> p) {
  VectorXd out = VectorXd::Zero(s.machine->cylinder_count());
  e.add_force(s, at, p, {out.data(), static_cast<std::size_t>(out.size())});
  return out;
}

/// The static force of a machine with an effect's masses, gravity or angles.
VectorXd changed_force(const Machine& machine, const AppliedEffect& e, const VectorXd& q,
                       double payload) {
  Machine changed = machine;
  e.effect->change_machine(changed, e.at, e.values);
  return static_force<double>(changed, q, payload);
}

// --- hand cases --------------------------------------------------------------------------------------------

struct OneCylinder : ::testing::Test {
  Machine machine = test_support::loader_crane();
  Instant<double> s = make_instant(machine);
  OneCylinder() {
    s.side = {1, -1, 0};
    s.speed = {0.02, -0.05, 0.0};
    s.static_force = {120e3, -30e3, 500.0};
  }
};

TEST_F(OneCylinder, FrictionsFollowTheirClosedForms) {
  EXPECT_DOUBLE_EQ(added(effect("viscous_friction"), s, 1, {1e5})[1], -5e3);
  EXPECT_DOUBLE_EQ(added(effect("load_friction"), s, 0, {0.05})[0], 6e3);
  EXPECT_DOUBLE_EQ(added(effect("load_friction"), s, 1, {0.05})[1], -1.5e3);
  EXPECT_DOUBLE_EQ(added(effect("stribeck_friction"), s, 0, {8e3, 0.01})[0], 8e3 * std::exp(-2.0));
  EXPECT_DOUBLE_EQ(added(effect("stribeck_friction"), s, 1, {8e3, 0.01})[1], -8e3 * std::exp(-5.0));
  EXPECT_DOUBLE_EQ(added(effect("presliding"), s, 1, {8e3, 2e-3})[1], -8e3);
  EXPECT_DOUBLE_EQ(added(effect("force_offset"), s, 2, {700.0})[2], 700.0);
  for (const char* id : {"load_friction", "stribeck_friction", "presliding"}) {
    EXPECT_EQ(added(effect(id), s, 2, {1.0, 1.0})[2], 0.0) << id << " at rest";
  }
}

TEST_F(OneCylinder, FrictionOnlyDissipatesPower) {
  for (const char* id : {"coulomb_friction", "viscous_friction", "stribeck_friction",
                         "load_friction", "presliding"}) {
    const Effect& e = effect(id);
    for (int at : {0, 1}) {
      const auto i = static_cast<std::size_t>(at);
      EXPECT_GT(added(e, s, at, typical(e.info()))[at] * s.speed[i], 0.0) << id;
    }
  }
}

TEST_F(OneCylinder, CushionIsAtTheFirstStopOfStrokeOrJoint) {
  Joint& joint = machine.joints[static_cast<std::size_t>(machine.cylinders[0].joint)];
  const auto length = [&](double q) { return cylinder_length(machine, 0, q); };
  const bool rises = length(joint.position.hi) > length(joint.position.lo);
  const double longest = length(rises ? joint.position.hi : joint.position.lo);
  const auto force_at = [&](double x) {
    s.length[0] = x;
    return added(effect("end_cushion"), s, 0, {20e3, 0.1, 0.0})[0];
  };
  machine.cylinders[0].stroke.reset();
  EXPECT_NEAR(force_at(longest), 20e3, 1e-6);
  machine.cylinders[0].length_at_zero_stroke = 0.0;
  machine.cylinders[0].stroke = longest + 0.2;  // longer than the joint permits
  EXPECT_NEAR(force_at(longest), 20e3, 1e-6);
  machine.cylinders[0].stroke = longest - 0.05;  // ends before the joint does
  EXPECT_NEAR(force_at(longest - 0.05), 20e3, 1e-6);
  // A joint that moves the cylinder beyond its greatest length is no stop.
  machine.cylinders[0].stroke.reset();
  double dead = joint.position.lo;
  for (double q = -M_PI; q < M_PI; q += 0.01) {
    if (length(q) > length(dead)) dead = q;
  }
  joint.position = {dead - 0.5, dead + 0.5};
  EXPECT_EQ(force_at(length(dead)), 0.0);
}

TEST_F(OneCylinder, CushionActsTowardsItsStopOnly) {
  machine.cylinders[0].length_at_zero_stroke = 1.5;
  machine.cylinders[0].stroke = 1.0;
  Joint& joint = machine.joints[static_cast<std::size_t>(machine.cylinders[0].joint)];
  joint.position = {0.0, 0.0};  // only the stroke limits it
  const Effect& e = effect("end_cushion");
  const auto force = [&](double length, int side, double ends) {
    s.length[0] = length;
    s.side[0] = side;
    return added(e, s, 0, {20e3, 0.1, ends})[0];
  };
  EXPECT_NEAR(force(2.45, 1, 0.0), 5e3, 1e-6);  // half way into the zone: a quarter
  EXPECT_NEAR(force(2.5, 1, 0.0), 20e3, 1e-6);
  EXPECT_NEAR(force(1.55, -1, 0.0), -5e3, 1e-6);
  EXPECT_EQ(force(2.45, -1, 0.0), 0.0);  // away from the stop
  EXPECT_EQ(force(2.39, 1, 0.0), 0.0);   // before the zone
  EXPECT_EQ(force(2.45, 1, -1.0), 0.0);  // the other end's cushion
  EXPECT_NEAR(force(2.45, 1, 1.0), 5e3, 1e-6);
}

TEST(PadFriction, IsTheBeamsMomentByHand) {
  // jib level, extension 2 m, nothing but a payload of 100 kg at the tip: moment about the joint's frame at zero
  // travel 100 g 2 m; 1 m further back 100 g 3 m
  Machine machine = test_support::loader_crane();
  machine.links.clear();
  const VectorXd x =
      stacked(Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0, 0, 0.1), Eigen::Vector3d::Zero());
  const Instant<double> s = instant_at(machine, x, 100.0);
  const Effect& e = effect("pad_friction");
  // The rounded corner of |moment| differs by less than its 10 N m.
  EXPECT_NEAR(added(e, s, 2, {0.1, 0.0})[2], 0.1 * 100 * 9.81 * 2, 0.1 * 10);
  EXPECT_NEAR(added(e, s, 2, {0.1, 1.0})[2], 0.1 * 100 * 9.81 * 3, 0.1 * 10);
  EXPECT_EQ(e.places(machine), std::vector<int>{2});
  EXPECT_TRUE(e.places(test_support::knuckle_crane()).empty());
}

TEST(StructuralFlex, LoadDeflectsTheArmInProportionToTorque) {
  const Machine machine = test_support::loader_crane();
  const VectorXd x = stacked(Eigen::Vector3d(0.4, -0.8, 2), Eigen::Vector3d::Constant(0.1),
                             Eigen::Vector3d::Zero());
  const Instant<double> s = instant_at(machine, x, 500.0);
  const double kappa = 2e-7;
  const double sag = kappa * s.static_torque[0];
  ASSERT_GT(sag, 0.0);  // the boom's torque lifts, since the load pulls it down
  VectorXd q = x.head(3);
  q[0] -= sag;
  const VectorXd torque = static_torque<double>(machine, q, 500.0);
  const VectorXd force = static_force<double>(machine, q, 500.0);
  const Effect& e = effect("structural_flex");
  const VectorXd bends = added(e, s, -1, {kappa, 0.0, 0.0});
  const VectorXd gives_way = added(e, s, -1, {kappa, 0.0, 1.0});
  for (Index i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double scale = 1e-9 * (1.0 + std::abs(force[i]));  // the same numbers in another order
    EXPECT_NEAR(bends[i], torque[i] / s.rate[k] - s.static_force[k], scale);
    EXPECT_NEAR(gives_way[i], force[i] - s.static_force[k], scale);
  }
}

TEST(MachineEffects, EqualTheMachineTheyDescribe) {
  const Machine machine = test_support::swing_crane();
  Random random(4);
  const VectorXd q = test_support::usable_state(machine, random).head(4);
  const double payload = 200.0;
  const VectorXd force = static_force<double>(machine, q, payload);
  const auto near = [](const VectorXd& a, const VectorXd& b) {
    return (a - b).norm() < 1e-9 * (1.0 + b.norm());
  };
  EXPECT_TRUE(
      near(changed_force(machine, {&effect("payload_error"), -1, {37.0, 0.02}, {}, {}}, q, payload),
           static_force<double>(machine, q, 1.02 * payload + 37.0)));
  EXPECT_TRUE(
      near(changed_force(machine, {&effect("payload_error"), -1, {0.0, 0.02}, {}, {}}, q, payload),
           static_force<double>(machine, q, 1.02 * payload)));
  VectorXd turned = q;
  turned[2] += 0.02;
  EXPECT_TRUE(near(changed_force(machine, {&effect("angle_offset"), 2, {0.02}, {}, {}}, q, payload),
                   static_force<double>(machine, turned, payload)));
  // The boom is the first luffing joint: a tilt of the base equals an angle of the boom except for the linkage.
  const Machine crane = test_support::loader_crane();
  const VectorXd pose = Eigen::Vector3d(0.3, -0.7, 1.0);
  VectorXd raised = pose;
  raised[0] += 0.03;
  Machine tilted = crane;
  effect("base_tilt").change_machine(tilted, -1, std::vector<double>{0.03});
  EXPECT_TRUE(near(static_torque<double>(tilted, pose, payload),
                   static_torque<double>(crane, raised, payload)));
  EXPECT_FALSE(near(force, static_force<double>(machine, turned, payload)));
}

TEST(AngleOffset, ShowsInTheSpeedOfItsOwnRod) {
  const Machine machine = test_support::loader_crane();
  const MachineSeries log = swinging_log(machine);
  const Effect& e = effect("angle_offset");
  MatrixXd column;
  ASSERT_TRUE(e.columns(log, {EvidenceKind::kFlow, 0}, 0, {}, column));
  const double offset = 1e-5;
  for (Index k = 0; k < log.samples(); k += 20) {
    // The computed speed is dx/dq(q) qd, the true one dx/dq(q + offset) qd.
    const double q = log.q(k, 0), qd = log.qd(k, 0);
    const double wrong = linkage_rates(machine, 0, q).d1 * qd,
                 right = linkage_rates(machine, 0, q + offset).d1 * qd;
    EXPECT_NEAR(column(k, 0) * offset, wrong - right, 1e-3 * std::abs(wrong - right) + 1e-12);
  }
  EXPECT_FALSE(e.columns(log, {EvidenceKind::kFlow, 1}, 0, {}, column));
}

/// What an effect that changes the machine adds to a cylinder's inertial force, from the changed machine itself.
VectorXd inertial_difference(const AppliedEffect& e, const MachineSeries& log, int cylinder) {
  Machine changed = *log.machine;
  e.effect->change_machine(changed, e.at, e.values);
  const int joint = changed.cylinders[static_cast<std::size_t>(cylinder)].joint;
  VectorXd out(log.samples());
  for (Index k = 0; k < log.samples(); ++k) {
    const VectorXd q = log.q.row(k), qd = log.qd.row(k), qdd = log.qdd.row(k);
    const auto torque = [&](const Machine& machine) {
      return inertial_torque<double>(machine, q, qd, qdd, log.payload[k])[joint];
    };
    out[k] = (torque(changed) - torque(*log.machine)) /
             linkage_rates(changed, cylinder, log.q(k, joint)).d1;
  }
  return out;
}

TEST(InertialColumns, MassesAddTheShareOfTheirInertiaThatTheModelHas) {
  const Machine machine = test_support::loader_crane();
  MachineSeries log = swinging_log(machine);
  const Effect& payload = effect("payload_error");
  EXPECT_EQ(inertial_columns(payload, log, {EvidenceKind::kForce, 0}, -1).size(), 0)
      << "the model has no inertial forces";
  log.inertia = 0.6;
  EXPECT_EQ(inertial_columns(payload, log, {EvidenceKind::kFlow, 0}, -1).size(), 0);
  EXPECT_EQ(inertial_columns(effect("coulomb_friction"), log, {EvidenceKind::kForce, 0}, 0).size(),
            0);
  const std::vector<double> values = {80.0, 0.1};
  for (int i = 0; i < 2; ++i) {
    const MatrixXd columns = inertial_columns(payload, log, {EvidenceKind::kForce, i}, -1);
    ASSERT_EQ(columns.cols(), 2);
    const VectorXd sum = columns.col(0) * values[0] + columns.col(1) * values[1];
    const VectorXd law = 0.6 * inertial_difference({&payload, -1, values, {}, {}}, log, i);
    // point masses at the tip enter the inertial force linearly
    EXPECT_LT((sum - law).cwiseAbs().maxCoeff(), 1e-9 * law.cwiseAbs().maxCoeff());
    EXPECT_GT(law.cwiseAbs().maxCoeff(), 1.0);
  }
}

/// A moment whose mass is not determined has the inertia of a mass at the link's end, and one with a mass on the link that of
/// this mass; the static force is the same.
TEST(UnmodelledMass, MomentOfInertiaIsThatOfAMassOnTheLink) {
  const Machine machine = test_support::loader_crane();
  const Effect& mass = effect("unmodelled_mass");
  const int joint = 1;
  MachineSeries log = swinging_log(machine);
  for (int k = 0; k < machine.joint_count(); ++k) {
    if (k == joint) continue;  // it moves alone, so that its own moment of inertia is all there is
    log.qd.col(k).setZero();
    log.qdd.col(k).setZero();
  }
  const double length = machine.joints[2].origin.translation().norm(), moment = 90.0;
  const auto at_distance = [&](double d) {
    return AppliedEffect{&mass, joint, {moment / d, moment, 0.0}, {}, {}};
  };
  const AppliedEffect unknown{&mass, joint, {0.0, moment, 0.0}, {}, {}};
  const AppliedEffect beyond{&mass, joint, {0.01, moment, 0.0}, {}, {}};
  const AppliedEffect couple{&mass, joint, {0.0, 0.0, moment}, {}, {}};
  const int cylinder = 1;
  ASSERT_EQ(machine.cylinders[cylinder].joint, joint);
  const VectorXd end = inertial_difference(at_distance(length), log, cylinder);
  const double scale = end.cwiseAbs().maxCoeff();
  EXPECT_LT((inertial_difference(unknown, log, cylinder) - end).cwiseAbs().maxCoeff(),
            1e-9 * scale);
  EXPECT_LT((inertial_difference(beyond, log, cylinder) - end).cwiseAbs().maxCoeff(), 1e-3 * scale);
  const VectorXd half = inertial_difference(at_distance(0.5 * length), log, cylinder);
  EXPECT_LT((half - 0.5 * end).cwiseAbs().maxCoeff(), 1e-9 * scale);  // moment times distance
  EXPECT_LT(inertial_difference(couple, log, cylinder).cwiseAbs().maxCoeff(), 1e-9 * scale);
  const VectorXd q = log.q.row(5).transpose();
  const VectorXd before = static_force<double>(machine, q, 0.0);
  const VectorXd near = changed_force(machine, at_distance(0.5 * length), q, 0.0) - before;
  const VectorXd far = changed_force(machine, unknown, q, 0.0) - before;
  EXPECT_NEAR(near[cylinder], far[cylinder], 1e-9 * std::abs(far[cylinder]));
  EXPECT_GT(std::abs(far[cylinder]), 1.0);
}

// --- over the registry ---------------------------------------------------------------------------------------

TEST(ForceEffects, JetsAgreeWithNumericDerivatives) {
  for (const Machine& machine : test_support::effect_machines()) {
    Random random(21);
    const VectorXd x = test_support::usable_state(machine, random);
    const double payload = 400.0;
    const Instant<Jet> jets = test_support::jets_at(machine, x, payload);
    const Index n = x.size();
    for (const auto& e : effect_catalogue()) {
      const EffectInfo& info = e->info();
      if (info.stage != EffectStage::kForce || e->changes_machine()) continue;
      std::vector<double> p = typical(info);
      if (info.id == "end_cushion") p[1] = 5.0;  // a zone in which every pose lies
      for (const int at : e->places(machine)) {
        SCOPED_TRACE(machine.name + " " + info.id + " " + std::to_string(at));
        std::vector<Jet> out(machine.cylinders.size(), Jet(0.0));
        e->add_force(jets, at, p, out);
        const VectorXd plain_out = added(*e, instant_at(machine, x, payload), at, p);
        for (std::size_t i = 0; i < out.size(); ++i) {
          const auto c = static_cast<Index>(i);
          double scale = 1.0 + std::abs(plain_out[c]);
          for (int a = 0; a < n; ++a) scale += std::abs(out[i].gradient(a));
          EXPECT_NEAR(out[i].value, plain_out[c], 1e-11 * scale);  // the same formulas
          const VectorXd direction = VectorXd::LinSpaced(n, 0.3, -0.8);
          double slope = 0.0, curvature = 0.0;
          for (int a = 0; a < n; ++a) {
            slope += out[i].gradient(a) * direction[a];
            for (int b = 0; b < n; ++b)
              curvature += out[i].hessian(a, b) * direction[a] * direction[b];
          }
          // along one line through all joint states: first derivative of values, second of Jet slopes
          const auto value = [&](double t) {
            return added(*e, instant_at(machine, x + t * direction, payload), at, p)[c];
          };
          const auto jet_slope = [&](double t) {
            std::vector<Jet> moved(machine.cylinders.size(), Jet(0.0));
            e->add_force(test_support::jets_at(machine, x + t * direction, payload), at, p, moved);
            double sum = 0.0;
            for (int a = 0; a < n; ++a) sum += moved[i].gradient(a) * direction[a];
            return sum;
          };
          // Linkages vary over some 0.1 rad; a step of 4e-3 with three levels leaves an error of 1e-7.
          EXPECT_NEAR(slope, numeric_derivative(value, 0.0, 4e-3), 1e-6 * scale);
          EXPECT_NEAR(curvature, numeric_derivative(jet_slope, 0.0, 4e-3),
                      1e-6 * (scale + std::abs(curvature)));
        }
      }
    }
  }
}

TEST(ForceEffects, ZeroParametersChangeNothing) {
  int machines_changed = 0;
  for (const Machine& machine : test_support::effect_machines()) {
    Random random(5);
    const VectorXd x = test_support::usable_state(machine, random);
    const Instant<double> s = instant_at(machine, x, 250.0);
    const VectorXd force = static_force<double>(machine, x.head(machine.joint_count()), 250.0);
    for (const auto& e : effect_catalogue()) {
      if (e->info().stage != EffectStage::kForce) continue;
      std::vector<double> p = typical(e->info());
      for (std::size_t k = 0; k < p.size(); ++k) {
        if (e->info().parameters[k].linear) p[k] = 0.0;
      }
      for (const int at : e->places(machine)) {
        EXPECT_EQ(added(*e, s, at, p).norm(), 0.0) << e->info().id;
        if (!e->changes_machine()) continue;
        ++machines_changed;
        const VectorXd same =
            changed_force(machine, {e.get(), at, p, {}, {}}, x.head(machine.joint_count()), 250.0);
        EXPECT_LT((same - force).norm(), 1e-9 * (1.0 + force.norm())) << e->info().id;
      }
    }
  }
  EXPECT_GT(machines_changed, 10) << "masses, payload, angles, tilt on several machines";
}

/// Columns times parameters equal the law, at sizes where the law is nearly linear.
TEST(ForceEffects, ColumnsAreTheLaw) {
  for (const Machine& machine : {test_support::loader_crane(), test_support::swing_crane()}) {
    const MachineSeries log = swinging_log(machine);
    for (const auto& e : effect_catalogue()) {
      const EffectInfo& info = e->info();
      const bool memory = info.id == "presliding" || info.id == "payload_sway";
      if (info.stage != EffectStage::kForce || memory) continue;
      if (!e->definition().empty()) continue;
      std::vector<double> p, shape;
      for (const EffectParameter& parameter : info.parameters) {
        const double value = parameter.typical;
        if (!parameter.linear) shape.push_back(value);
        p.push_back(parameter.linear ? 0.1 * value : value);
      }
      Index linear = static_cast<Index>(p.size() - shape.size());
      for (const int at : e->places(machine)) {
        for (int i = 0; i < machine.cylinder_count(); ++i) {
          SCOPED_TRACE(machine.name + " " + info.id + " " + std::to_string(at));
          MatrixXd columns;
          const bool shows = e->columns(log, {EvidenceKind::kForce, i}, at, shape, columns);
          double worst = 0.0, largest = 0.0;
          for (Index k = 0; k < log.samples(); k += 7) {
            const VectorXd q = log.q.row(k).transpose();
            const VectorXd x = stacked(q, log.qd.row(k).transpose(), log.qdd.row(k).transpose());
            const VectorXd law =
                e->changes_machine()
                    ? VectorXd(changed_force(machine, {e.get(), at, p, {}, {}}, q, log.payload[k]) -
                               static_force<double>(machine, q, log.payload[k]))
                    : added(*e, instant_at(machine, x, log.payload[k]), at, p);
            double sum = 0.0;
            for (Index c = 0; shows && c < linear; ++c)
              sum += columns(k, c) * p[static_cast<std::size_t>(c)];
            worst = std::max(worst, std::abs(sum - law[i]));
            largest = std::max(largest, std::abs(law[i]));
          }
          // Columns of angles are secants over one or two degrees; the law here is evaluated at a tenth of that.
          EXPECT_LE(worst, 0.05 * largest + 1e-6);
        }
      }
    }
  }
}

// --- memory ----------------------------------------------------------------------------------------------------

TEST(Presliding, ReversalBuildsUpOverItsDistance) {
  const Machine machine = test_support::loader_crane();
  // extension out for 1 s at 0.1 m/s, then back
  const MachineSeries log = log_of(
      machine,
      [](double t) {
        const double q = t < 1.0 ? 2.0 + 0.1 * t : 2.1 - 0.1 * (t - 1.0);
        return stacked(Eigen::Vector3d(0.3, -1, q), Eigen::Vector3d(0, 0, t < 1 ? 0.1 : -0.1),
                       Eigen::Vector3d::Zero());
      },
      2.0, 0.01, 0.0);
  MatrixXd column;
  const double distance = 4e-3;
  ASSERT_TRUE(
      effect("presliding")
          .columns(log, {EvidenceKind::kForce, 2}, 2, std::vector<double>{distance}, column));
  EXPECT_NEAR(column(99, 0), 1.0, 1e-9);  // 25 distances after the start
  for (int k = 1; k < 8; ++k) {           // exact: dz/dx = (sign - z)/distance from z = 1
    EXPECT_NEAR(column(100 + k, 0), -1.0 + 2.0 * std::exp(-1e-3 * k / distance), 1e-6);
  }
  EXPECT_NEAR(column(200, 0), -1.0, 1e-9);
}

}  // namespace
}  // namespace sparflow
