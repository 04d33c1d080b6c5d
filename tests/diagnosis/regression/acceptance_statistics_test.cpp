#include "diagnosis/regression/acceptance_statistics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/math/linear_algebra.h"
#include "models/math/student.h"
#include "tests/diagnosis/evidence_support.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing_support::blocks_of;
using testing_support::plain_channel;
using testing_support::plain_design;
using testing_support::slow_column;
using testing_support::white;

const std::vector<NoiseBlock>& blocks() {
  static const std::vector<NoiseBlock> all = blocks_of(std::vector<Index>(20, 50));
  return all;
}
constexpr Index kRows = 1000;

/// One channel with an action and white noise of standard deviation `noise`.
Evidence evidence_with(const VectorXd& action, double noise, unsigned seed,
                       const MatrixXd& baseline = {}) {
  std::mt19937_64 random(seed);
  Evidence e;
  e.channels.push_back(
      plain_channel(blocks(), VectorXd(action + noise * white(kRows, random)), baseline));
  return e;
}

/// 200 in the middle fifth of each block's rows, else 0.
VectorXd pulses() {
  VectorXd x = VectorXd::Zero(kRows);
  for (const NoiseBlock& b : blocks()) x.segment(b.first + 20, 10).setConstant(200.0);
  return x;
}

TEST(EffectAction, SizeIsMeasuredWhereItActs) {
  // a lag acts for a second after a step and nowhere else: 200 N with 100 N of noise is a size of two, however short
  for (const VectorXd& x : {pulses(), VectorXd(VectorXd::Constant(kRows, 200.0))}) {
    Evidence e = evidence_with(x, 100.0, 1);
    const EffectDesign d = plain_design({x / 200.0});
    EffectFit fit = fit_effects(e, {&d});
    fit.theta[0] = 200.0;
    fit.noise[0] = NoiseModel{};
    fit.noise[0].variance = 1e4;
    const EffectAction action = effect_action(e, {&d}, 0, fit);
    // Noise and size are set by hand, so that rounding alone is left, as in the other tolerances of 1e-9 in this file.
    EXPECT_NEAR(action.size, 2.0, 1e-9);
    EXPECT_NEAR(action.absorbed, 0.0, 1e-12) << "nothing is learned here";
  }
}

TEST(EffectAction, WhatOneChannelAbsorbsAnotherMayShow) {
  std::mt19937_64 random(4);
  const VectorXd a = white(kRows, random), b = white(kRows, random);
  Evidence e = evidence_with(300.0 * a, 1.0, 3, a);  // absorbed entirely
  e.channels.push_back(evidence_with(20.0 * b, 1.0, 5).channels[0]);
  const EffectDesign d = plain_design({300.0 * a, 20.0 * b});
  EffectFit fit = fit_effects(e, {&d});
  fit.theta[0] = 1.0;
  const EffectAction action = effect_action(e, {&d}, 0, fit);
  // (300^2) / (300^2 + 20^2) = 0.9956, with random columns of a thousand rows, whose lengths differ by some per cent.
  EXPECT_GT(action.absorbed, 0.95);
  EXPECT_NEAR(action.absorbed_where_seen, 0.0, 1e-9);
}

TEST(EffectAction, AbsorbedShareIsThatOfTheProjectionOnTheBaseline) {
  std::mt19937_64 random(2);
  VectorXd a = white(kRows, random), b = white(kRows, random);
  a.normalize();
  b -= a * a.dot(b);
  b.normalize();
  for (const double degrees : {0.0, 30.0, 60.0, 90.0}) {
    const double angle = degrees * M_PI / 180.0;
    const VectorXd action = std::cos(angle) * a + std::sin(angle) * b;
    const Evidence e = evidence_with(300.0 * action, 1.0, 3, a);
    const EffectDesign d = plain_design({action});
    EffectFit fit = fit_effects(e, {&d});
    fit.theta = VectorXd::Constant(1, 300.0);
    EXPECT_NEAR(effect_action(e, {&d}, 0, fit).absorbed, std::pow(std::cos(angle), 2), 1e-9)
        << degrees;
  }
}

TEST(EffectAction, IsThatOfTheEffectAtTheIndex) {
  std::mt19937_64 random(4);
  const VectorXd x = slow_column(blocks(), random);
  const Evidence e = evidence_with(x, 1.0, 5);
  const EffectDesign small = plain_design({0.1 * pulses() / 200.0}), large = plain_design({x});
  EffectFit fit = fit_effects(e, {&small, &large});
  fit.theta << 1.0, 5.0;
  // The actions are 0.1 and about 5 times the noise of one; the bounds lie far from both.
  EXPECT_LT(effect_action(e, {&small, &large}, 0, fit).size, 1.0);
  EXPECT_GT(effect_action(e, {&small, &large}, 1, fit).size, 3.0);
}

TEST(EffectAction, SizeIsComparedWithTheModelFormErrorOfOthers) {
  const VectorXd ones = VectorXd::Ones(kRows);
  const Evidence e = evidence_with(110.0 * ones, 1.0, 6);
  const EffectDesign small = plain_design({ones});
  EffectDesign large = plain_design({ones});
  EffectFit fit = fit_effects(e, {&small, &large});
  fit.theta << 10.0, 100.0;
  // what all stretches have alike, and what each of the 20 may have by itself
  const double alike = std::sqrt(1.0 + 1.0 / 20.0);
  // model-form errors: a tenth of a flow limit's action, 5 % of friction, 2 % of a weight
  large.effect.effect = find_effect("flow_saturation");
  EXPECT_NEAR(effect_action(e, {&small, &large}, 0, fit).over_form, 1.0 / alike, 1e-9);
  large.effect.effect = find_effect("viscous_friction");
  EXPECT_NEAR(effect_action(e, {&small, &large}, 0, fit).over_form, 2.0 / alike, 1e-9);
  large.effect.effect = find_effect("unmodelled_mass");
  EXPECT_NEAR(effect_action(e, {&small, &large}, 0, fit).over_form, 5.0 / alike, 1e-9);
}

TEST(EffectAction, HalfOfTheFormErrorOfALawThatBothLogsHaveIsTheSameInBoth) {
  const VectorXd ones = VectorXd::Ones(kRows);
  Evidence e = evidence_with(110.0 * ones, 1.0, 6);
  const double alike = std::sqrt(1.0 + 1.0 / 20.0);  // see the test before
  const EffectDesign small = plain_design({ones});
  EffectFit fit = fit_effects(e, {&small});
  fit.theta << 10.0;
  e.channels[0].shared = {{{find_effect("flow_saturation"), 0}, 100.0 * ones}};
  EXPECT_NEAR(effect_action(e, {&small}, 0, fit).over_form, 2.0 / alike, 1e-9);
  RegressionOptions whole;
  whole.shared_form_share = 1.0;
  EXPECT_NEAR(effect_action(e, {&small}, 0, fit, whole).over_form, 1.0 / alike, 1e-9);
}

/// A law that pushes now this way and now that way in the 20 stretches is an error of each by itself, whose sum in an effect that has the
/// same sign in all of them is sqrt(20) times that of one; within a stretch it may follow the effect.
TEST(EffectAction, ErrorsOfFormThatStretchesDoNotShareAverageOut) {
  const VectorXd ones = VectorXd::Ones(kRows);
  const Evidence e = evidence_with(10.0 * ones, 1.0, 6);
  const EffectDesign small = plain_design({ones});
  VectorXd by_turns = ones, within = ones;
  for (std::size_t b = 0; b < blocks().size(); ++b) {
    if (b % 2 == 1) by_turns.segment(blocks()[b].first, 50) *= -1.0;
    within.segment(blocks()[b].first, 25) *= -1.0;
  }
  for (const VectorXd& other : {by_turns, within}) {
    EffectDesign large = plain_design({other});
    large.effect.effect = find_effect("flow_saturation");  // a tenth
    EffectFit fit = fit_effects(e, {&small, &large});
    fit.theta << 10.0, 100.0;
    EXPECT_NEAR(effect_action(e, {&small, &large}, 0, fit).over_form, std::sqrt(20.0), 1e-9);
  }
}

/// What a law leaves is alike in the stretches of one direction; those of the other direction have a part of their own (the efficiency of a
/// machine that drives and is driven), so that of an effect that acts both ways half of the square averages out.
TEST(EffectAction, StretchesOfBothDirectionsHaveErrorsOfFormOfTheirOwn) {
  VectorXd by_turns = VectorXd::Ones(kRows);
  for (std::size_t b = 1; b < blocks().size(); b += 2)
    by_turns.segment(blocks()[b].first, 50) *= -1.0;
  const Evidence e = evidence_with(10.0 * by_turns, 1.0, 6);
  const EffectDesign small = plain_design({by_turns});
  EffectDesign large = plain_design({by_turns});
  large.effect.effect = find_effect("flow_saturation");  // a tenth
  EffectFit fit = fit_effects(e, {&small, &large});
  fit.theta << 10.0, 100.0;
  EXPECT_NEAR(effect_action(e, {&small, &large}, 0, fit).over_form,
              1.0 / std::sqrt(1.0 / 2.0 + 1.0 / 20.0), 1e-9);
}

// The law that both logs have takes two thirds of a change of it where the suspect log has two thirds of the motion. No learned law
// has any of that.
TEST(EffectAction, WhatALawTakesOfItsOwnChangeIsNotAbsorbed) {
  const VectorXd everywhere = pulses();
  VectorXd here = everywhere;
  here.tail(kRows / 3).setZero();
  Evidence e = evidence_with(110.0 * here, 1.0, 6);
  e.channels[0].baseline = everywhere;
  EffectDesign change = plain_design({here});
  change.effect = {find_effect("viscous_friction"), 0};
  EffectFit fit = fit_effects(e, {&change});
  fit.theta << 10.0;
  const double part = here.squaredNorm() / everywhere.squaredNorm();
  EXPECT_NEAR(effect_action(e, {&change}, 0, fit).absorbed, part, 1e-9);
  const auto shared_by = [&](int at) {
    e.channels[0].shared = {{{find_effect("viscous_friction"), at}, 100.0 * everywhere, 0, 1}};
    return effect_action(e, {&change}, 0, fit).absorbed;
  };
  EXPECT_NEAR(shared_by(1), part, 1e-9) << "another cylinder's law";
  EXPECT_NEAR(shared_by(0), 0.0, 1e-9);
  e.channels[0].baseline.conservativeResize(kRows, 2);
  e.channels[0].baseline.col(1) = here;
  EXPECT_NEAR(shared_by(0), 1.0, 1e-9) << "a learned law has all of it";
}

TEST(OtherPower, IsTheFirstOrderOfAnotherExponent) {
  VectorXd v(kRows);
  for (Index k = 0; k < kRows; ++k) v[k] = 0.02 * static_cast<double>(k % 50 - 25);  // m/s
  EffectDesign viscous = plain_design({v});
  viscous.effect.effect = find_effect("viscous_friction");
  const VectorXd theta = VectorXd::Constant(1, 2e5);
  const EffectDesign power = other_power(viscous, theta);
  ASSERT_TRUE(power.acts());
  ASSERT_EQ(power.linear, 1);
  // v^0.9 for v: the residual of a straight line is nearly proportional to this column
  const VectorXd bent = 2e5 * v.cwiseSign().cwiseProduct(v.cwiseAbs().array().pow(0.9).matrix());
  MatrixXd both(kRows, 2);
  both << v, power.columns[0];
  const VectorXd by_line = bent - v * (v.dot(bent) / v.squaredNorm());
  const VectorXd coefficients = least_squares(both, bent);
  // What is left is of second order in the change of the exponent, 0.1.
  EXPECT_LT((bent - both * coefficients).norm(), 0.1 * by_line.norm());
  // the coefficient is the change of the exponent, up to second order
  EXPECT_NEAR(coefficients[1], -0.1, 0.03);
  EXPECT_LE(power.lower[0], -0.15);  // friction with v^0.85
  RegressionOptions narrow;
  narrow.largest_power_change = 0.05;
  EXPECT_EQ(other_power(viscous, theta, narrow).lower[0], -0.05);
  EffectDesign mass = plain_design({v});
  mass.effect.effect = find_effect("unmodelled_mass");
  EXPECT_FALSE(other_power(mass, theta).acts()) << "a weight has no free exponent";
}

/// The held-out gain by leaving rows out and solving again.
HeldOutGain by_refitting(const Evidence& e, const std::vector<const EffectDesign*>& designs,
                         std::size_t index, const EffectFit& fit, int folds) {
  const EvidenceChannel& c = e.channels[0];
  MatrixXd x(kRows, static_cast<Index>(designs.size()));
  for (std::size_t k = 0; k < designs.size(); ++k)
    x.col(static_cast<Index>(k)) = designs[k]->columns[0];
  const MatrixXd rows = whitened_rows(c, fit.noise[0], x) / std::sqrt(fit.noise[0].variance);
  MatrixXd reduced(kRows, x.cols() - 1);
  Index at = 0;
  for (Index k = 0; k < x.cols(); ++k) {
    if (k != static_cast<Index>(index)) reduced.col(at++) = rows.col(k);
  }
  std::vector<double> gains, squares_of, products_of;
  for (int f = 0; f < folds; ++f) {
    std::vector<Index> in, out;
    for (std::size_t b = 0; b < c.blocks.size(); ++b) {
      for (Index i = c.blocks[b].first; i < c.blocks[b].last; ++i)
        (static_cast<int>(b) % folds == f ? out : in).push_back(i);
    }
    const auto residual = [&](const MatrixXd& all) -> VectorXd {  // of every row
      const VectorXd theta =
          least_squares(MatrixXd(all(in, Eigen::all)), VectorXd(rows.rightCols(1)(in, 0)));
      return rows.rightCols(1) - all * theta;
    };
    const VectorXd without = residual(reduced), with = residual(rows.leftCols(x.cols()));
    gains.push_back(0.5 * (without(out).squaredNorm() - with(out).squaredNorm()));
    for (std::size_t b = static_cast<std::size_t>(f); b < c.blocks.size();
         b += static_cast<std::size_t>(folds)) {
      const Index first = c.blocks[b].first, length = c.blocks[b].last - first;
      const VectorXd predicted = (without - with).segment(first, length);
      squares_of.push_back(predicted.squaredNorm());
      products_of.push_back(predicted.dot(without.segment(first, length)));
    }
  }
  HeldOutGain g;
  double squares = 0.0;
  for (const double v : gains) g.gain += v;
  for (const double v : gains) squares += std::pow(v - g.gain / folds, 2);
  g.error = std::sqrt(squares * folds / (folds - 1.0));
  // weighted least squares of what is shown, over the square root of what is predicted
  const auto stretches = std::ssize(squares_of);
  const VectorXd root = Eigen::Map<VectorXd>(squares_of.data(), stretches).cwiseSqrt();
  const VectorXd shown = Eigen::Map<VectorXd>(products_of.data(), stretches).cwiseQuotient(root);
  const double slope = root.dot(shown) / root.squaredNorm(),
               freedom = static_cast<double>(stretches) - 1.0;
  const double variance = std::max(1.0, (shown - slope * root).squaredNorm() / freedom);
  g.chance = student_tail((slope - 0.5) * root.norm() / std::sqrt(variance), freedom);
  return g;
}

TEST(HeldOutGain, IsThatOfRefittingWithoutTheMotions) {
  std::mt19937_64 random(6);
  const VectorXd a = slow_column(blocks(), random), b = slow_column(blocks(), random);
  const Evidence e = evidence_with(0.3 * a + 0.5 * b, 1.0, 7);
  const EffectDesign first = plain_design({a}), second = plain_design({b});
  const EffectFit fit = fit_effects(e, {&first, &second});
  for (const std::size_t index : {std::size_t{0}, std::size_t{1}}) {
    const HeldOutGain fast = held_out_gain(e, {&first, &second}, index, fit, 5),
                      dense = by_refitting(e, {&first, &second}, index, fit, 5);
    // Ridges that keep the systems solvable, 1e-10 to 1e-9 of a parameter's information, differ between both ways.
    EXPECT_NEAR(fast.gain, dense.gain, 1e-4 * (1.0 + std::abs(dense.gain)));
    EXPECT_NEAR(fast.error, dense.error, 1e-4 * (1.0 + dense.error));
    EXPECT_NEAR(std::log(fast.chance), std::log(dense.chance), 1e-3);
  }
}

TEST(HeldOutGain, RisesWithAnEffectAndFallsWithoutOne) {
  std::mt19937_64 random(8);
  double nothing = 0.0;
  int clear = 0, by_chance = 0, certain = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    const VectorXd x = slow_column(blocks(), random);
    const EffectDesign d = plain_design({x});
    const Evidence without = evidence_with(VectorXd::Zero(kRows), 1.0, 100 + seed),
                   with = evidence_with(0.5 * x, 1.0, 200 + seed);
    const HeldOutGain none = held_out_gain(without, {&d}, 0, fit_effects(without, {&d}), 5);
    nothing += none.gain;
    by_chance += none.chance < 0.05 ? 1 : 0;
    const HeldOutGain g = held_out_gain(with, {&d}, 0, fit_effects(with, {&d}), 5);
    clear += g.gain > g.error ? 1 : 0;
    certain += g.chance < 0.01 ? 1 : 0;
  }
  EXPECT_LT(nothing / 50.0, 0.0)
      << "a superfluous parameter loses about half a nat on motions left out";
  // Half a nat, with a mean over fifty cases that is certain to a fraction of a nat; worse means an error of the folds.
  EXPECT_GT(nothing / 50.0, -3.0);
  EXPECT_EQ(clear, 50);
  EXPECT_EQ(certain, 50);
  // 2.5 of 50 at one in twenty; 7 and more have a chance of 0.01
  EXPECT_LT(by_chance, 7);
}

/// A law that is right in one stretch of motion and wrong in the others predicts nothing, however much it gains there.
TEST(HeldOutGain, OfOneStretchAloneIsChance) {
  std::mt19937_64 random(9);
  const VectorXd x = slow_column(blocks(), random);
  VectorXd once = VectorXd::Zero(kRows);
  const NoiseBlock& first = blocks().front();
  once.segment(first.first, first.last - first.first) =
      20.0 * x.segment(first.first, first.last - first.first);
  const EffectDesign d = plain_design({x});
  const Evidence e = evidence_with(once, 1.0, 10);
  EXPECT_GT(held_out_gain(e, {&d}, 0, fit_effects(e, {&d}), 5).chance, 0.05);
}

/// Adds size * tanh(t / width), whose derivative has a closed form.
class Ramp final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = [] {
      EffectInfo i;
      i.id = "ramp_of_a_test";
      i.place = EffectPlace::kMachine;
      i.parameters = {{"size", "N", 1.0, 0.0, 10.0, 1.0, "", true, {}},
                      {"width", "s", 1.0, 0.1, 10.0, 1.0, "", false, {0.5, 1.5}}};
      return i;
    }();
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }
  bool columns_filtered() const override { return true; }  // no filter in a hand-made log
  bool columns(const MachineSeries& log, const MeasuredQuantity&, int,
               std::span<const double> shape, MatrixXd& columns) const override {
    columns = (log.time.array() / shape[0]).tanh().matrix();
    return true;
  }
};

TEST(ShapeSlopes, AreTheDerivativeOfTheAction) {
  const Ramp ramp;
  Evidence e;
  e.suspects = 1;
  e.series.resize(1);
  e.series[0].time = VectorXd::LinSpaced(kRows, 0.0, 4.0);
  e.series[0].step = 4.0 / (kRows - 1);
  e.series[0].runs = {{0, kRows}};
  EvidenceChannel c = plain_channel(blocks(), VectorXd::Zero(kRows));
  for (Index i = 0; i < kRows; ++i) c.sample.push_back(i);
  e.channels.push_back(c);
  const double width = 0.7;
  const EffectDesign d = make_design(e, {&ramp, -1}, {width});
  ASSERT_EQ(d.linear, 1);
  ASSERT_TRUE(d.acts());
  const EffectDesign wider = with_shape_slopes(e, d, VectorXd::Constant(1, 3.0));
  ASSERT_EQ(wider.linear, 2);
  ASSERT_EQ(wider.columns[0].cols(), 2);
  EXPECT_EQ(wider.columns[0].col(0), d.columns[0].col(0));
  for (Index i = 0; i < kRows; ++i) {
    const double x = e.series[0].time[i] / width;
    const double slope = -3.0 * x / width / std::pow(std::cosh(x), 2);
    // central difference of 2 % of the width: relative error of some 0.02^2
    EXPECT_NEAR(wider.columns[0](i, 1), slope, 2e-3 * 3.0 / width);
  }
  // the effect does not act in reference logs
  e.suspects = 0;
  EXPECT_FALSE(make_design(e, {&ramp, -1}, {width}).acts());
}

/// A share with the bounds 0.5 and 2 that no channel shows is estimated as zero and lies on no bound; one that is shown does.
TEST(Bounds, AParameterThatActsInNoChannelLiesOnNone) {
  EffectDesign d;
  d.linear = 2;
  d.lower = {0.5, 0.0};
  d.upper = {2.0, 1.0};
  d.columns = {MatrixXd::Zero(4, 2), MatrixXd()};
  d.columns[0].col(1).setOnes();
  EXPECT_FALSE(d.parameter_acts(0));
  EXPECT_TRUE(d.parameter_acts(1));
  EXPECT_FALSE(rests_on_bound(d, VectorXd{{0.0, 0.5}}));
  EXPECT_TRUE(rests_on_bound(d, VectorXd{{0.0, 1.0}}));
  d.columns[0](0, 0) = 1.0;
  EXPECT_TRUE(rests_on_bound(d, VectorXd{{0.5, 0.5}}));
}

}  // namespace
}  // namespace sparflow
