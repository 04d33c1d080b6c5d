/// What suspect logs and references leave unexplained: equal sizes are no change only where the law is the same.
#include "diagnosis/verdict/residual_levels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "diagnosis/residual/residual_model.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "diagnosis/verdict/unmodelled_structure.h"
#include "models/math/student.h"
#include "tests/diagnosis/evidence_support.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

constexpr double kNoise = 500.0;  // [N]

/// A suspect and a reference log whose residuals are noise of one level in every channel.
Diagnosis with_noise(double seconds = 90.0) {
  const Machine machine = testing_support::drawn_machine("loader_crane");
  static std::map<double, testing_support::HiddenCase> all;
  if (!all.contains(seconds))
    all.emplace(seconds, testing_support::hidden_case(machine, {}, {5, seconds}));
  const testing_support::HiddenCase& logs = all.at(seconds);
  EvidenceOptions options;
  options.force_widths.clear();  // short stretches have rows behind no filter but the signals' own
  Diagnosis d;
  d.evidence = collect_evidence(CraneModel::untrained(machine), {make_signals(machine, logs.train)},
                                {make_signals(machine, logs.reference)}, nullptr, options);
  std::mt19937_64 random(4);
  NoiseModel noise;
  noise.variance = kNoise * kNoise;
  for (EvidenceChannel& c : d.evidence.channels)
    c.y = testing_support::draw(noise, c.blocks, random);
  for (EvidenceChannel& c : d.evidence.channels) c.noise_floor = kNoise;
  return d;
}

std::size_t jib_force(const Diagnosis& d) {
  return static_cast<std::size_t>(d.evidence.find(EvidenceKind::kForce, 1) -
                                  d.evidence.channels.data());
}

Diagnosis fitted(Diagnosis d) {
  FitControl control;
  control.keep_residuals = true;
  d.search.final = fit_effects(d.evidence, {}, nullptr, control);
  d.search.null = d.search.final;
  return d;
}

/// Force of the jib in which a law of the boom's position remains: of one sign in the suspect, of another in the reference log.
/// @param spread [-] standard deviation of the logarithm of its size from stretch to stretch
Diagnosis with_laws(double suspect, double reference, double spread = 0.0, double seconds = 90.0) {
  Diagnosis d = with_noise(seconds);
  EvidenceChannel& channel = d.evidence.channels[jib_force(d)];
  const std::vector<SignalColumn> signals = channel_signals(d.evidence, channel);
  const auto position = std::find_if(signals.begin(), signals.end(),
                                     [](const SignalColumn& s) { return s.name == "q_boom"; });
  const VectorXd law = (6.0 * position->values.array()).sin() * kNoise;
  std::mt19937_64 random(9);
  std::normal_distribution<double> deviate;
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    const Eigen::Index first = channel.blocks[b].first, n = channel.blocks[b].last - first;
    channel.y.segment(first, n) += (channel.log[b] == 0 ? suspect : reference) *
                                   std::exp(spread * deviate(random)) * law.segment(first, n);
  }
  return fitted(std::move(d));
}

/// Force of the jib whose noise is a multiple of the usual in a short stretch of motion of either log, one of ten rows or more.
Diagnosis with_loud_stretch(double suspect, double reference, double seconds = 90.0) {
  Diagnosis d = with_noise(seconds);
  EvidenceChannel& channel = d.evidence.channels[jib_force(d)];
  for (const int log : {0, 1}) {
    NoiseBlock shortest = {0, channel.y.size()};
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      const NoiseBlock& rows = channel.blocks[b];
      const Eigen::Index n = rows.last - rows.first;
      if (channel.log[b] == log && n >= 10 && n < shortest.last - shortest.first) shortest = rows;
    }
    channel.y.segment(shortest.first, shortest.last - shortest.first) *=
        log == 0 ? suspect : reference;
  }
  return fitted(std::move(d));
}

BesideReferences beside(double suspect, double reference, double spread = 0.0,
                        double seconds = 90.0) {
  const Diagnosis d = with_laws(suspect, reference, spread, seconds);
  const std::vector<ResidualStructure> left = find_residual_structure(d.evidence, d.search.final);
  EXPECT_EQ(left.size(), 1u);
  return beside_references(d, left, {}).at(0);
}

TEST(ResidualLevels, TheSameLawInBothLogsIsNoChange) {
  EXPECT_EQ(beside(1.5, 1.5), BesideReferences::kShared);
}

/// A law that is learned from both logs lies between the two, and leaves residuals of equal size and opposite sign.
TEST(ResidualLevels, OppositeLawsOfEqualSizeAreAChange) {
  // 90 s have too few motions to tell by 1 %: the chance of this is 3 % there
  EXPECT_NE(beside(1.5, -1.5), BesideReferences::kOpposite);
  EXPECT_EQ(beside(1.5, -1.5, 0.0, 300.0), BesideReferences::kOpposite);
}

TEST(ResidualLevels, ALawOfTheSuspectLogAloneIsAChange) {
  EXPECT_EQ(beside(1.5, 0.0), BesideReferences::kMore);
}

/// A law of which the suspect log has three times as much: a change where every motion shows it alike, and what motions show
/// differs by less than that. Where it is another one in each motion, three times is no difference.
TEST(ResidualLevels, AStructureIsAChangeWhereItExceedsTheReferencesSignificantly) {
  EXPECT_EQ(beside(9.0, 1.0), BesideReferences::kMore);
  EXPECT_EQ(beside(5.0, 2.0, 1.0), BesideReferences::kShared);
}

/// A pump that hunts in one motion, by so much that the RMS of the log is more than twice that of the references; less is none.
TEST(ResidualLevels, OneStretchOfMotionIsComparedWithTheLargestOfTheReferences) {
  for (const double loud : {6.0, 40.0}) {
    const Diagnosis d = with_loud_stretch(loud, 1.0);
    const std::size_t jib = jib_force(d);
    const bool twice = suspect_rms(d.evidence, jib, d.search.final.residual[jib]) >
                       d.thresholds.least_excess_ratio * reference_rms(d, jib);
    EXPECT_EQ(twice, loud > 6.0);
    EXPECT_EQ(channel_beyond_references(d), twice ? std::optional(jib) : std::nullopt);
  }
  EXPECT_EQ(channel_beyond_references(with_loud_stretch(40.0, 40.0)), std::nullopt);
  EXPECT_EQ(channel_beyond_references(with_loud_stretch(1.0, 1.0)), std::nullopt);
}

/// By its series.
double trigamma(double x) {
  double sum = 0.0;
  constexpr int kTerms = 20000;
  for (int k = 0; k < kTerms; ++k) sum += 1.0 / ((x + k) * (x + k));
  return sum + 1.0 / (x + kTerms);
}

/// Chance of a largest stretch: Student's prediction, but no less than that of an exponential tail in the logarithm of its mean square.
TEST(ResidualLevels, ALargestStretchHasTheHeavierOfTwoTails) {
  for (const double seconds : {90.0, 300.0}) {  // few stretches or many
    Diagnosis d = with_loud_stretch(4.0, 1.0, seconds);
    const std::size_t jib = jib_force(d);
    for (MachineSeries& log : d.evidence.series) {  // all motions do the same work
      log.cylinders[1].static_force.setConstant(1e4);
      log.cylinders[1].speed.setConstant(0.1);
    }
    const EvidenceChannel& channel = d.evidence.channels[jib];
    const VectorXd residual = settled(d, jib, d.search.final.residual[jib]);
    std::vector<double> references;
    double suspects = 0.0, usual = 0.0;
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      const Eigen::Index first = channel.blocks[b].first, rows = channel.blocks[b].last - first;
      if (channel.log[b] == 0) {
        suspects += 1.0;
      } else {
        references.push_back(std::log(residual.segment(first, rows).array().square().mean()));
        usual += trigamma(0.5 * static_cast<double>(rows));
      }
    }
    const Eigen::Map<const VectorXd> v(references.data(), std::ssize(references));
    const auto n = static_cast<double>(references.size());
    const double variance = (v.array() - v.mean()).square().sum() / (n - 1.0);
    double z = -1e300;  // of the stretch that deviates most, by what so few rows tell
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      if (channel.log[b] != 0) continue;
      const Eigen::Index first = channel.blocks[b].first, rows = channel.blocks[b].last - first;
      const double level = std::log(residual.segment(first, rows).array().square().mean());
      const double fewer = trigamma(0.5 * static_cast<double>(rows)) - usual / n;
      z = std::max(
          z, (level - v.mean()) / std::sqrt(variance * (1.0 + 1.0 / n) + std::max(0.0, fewer)));
    }
    const double student = student_tail(z, n - 1.0),
                 exponential = 0.5 * std::exp(-std::sqrt(2.0) * z);
    EXPECT_EQ(exponential > student, seconds == 300.0) << z;
    EXPECT_NEAR(std::log(excess_over_references(d, jib)->largest),
                std::log(suspects * (seconds == 300.0 ? exponential : student)), 1e-3);
  }
}

/// Beside references an effect must explain half of what exceeds them, without them four fifths of what exceeds the noise.
TEST(ResidualLevels, AnEffectThatExplainsLittleIsMinor) {
  Diagnosis d = with_laws(0.0, 0.0);
  const std::size_t jib = jib_force(d);
  const EvidenceChannel& channel = d.evidence.channels[jib];
  const VectorXd noise = d.search.final.residual[jib];
  DiagnosedEffect e;
  e.channels = {{jib, 0.0, 0.0, 0.01 * kNoise}};
  const auto minor =
      [&](double
              without) {  // residuals of the suspect log over those of the references, without and with it
        for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
          if (channel.log[b] != 0) continue;
          const Eigen::Index first = channel.blocks[b].first, n = channel.blocks[b].last - first;
          d.search.final.residual[jib].segment(first, n) = 4.0 * noise.segment(first, n);
          d.search.null.residual[jib].segment(first, n) = without * noise.segment(first, n);
        }
        return is_minor_effect(d, e);
      };
  // of 16 - 1 squares that are left, without the effect 36 - 1 and 27 - 1
  EXPECT_FALSE(minor(6.0));
  EXPECT_TRUE(minor(5.2));
  d.evidence.suspects = 2;  // no references
  EXPECT_TRUE(minor(6.0));
  EXPECT_FALSE(minor(20.0));
}

/// What is left beside a named effect is said where it is more than twice what the references leave.
TEST(ResidualLevels, WhatAnEffectLeavesBeyondTheReferencesIsSaid) {
  Diagnosis d;
  ChannelGain g{0, 29.1e5, 17.6e5, 1e4};
  EXPECT_EQ(left_beyond_references(d, g), "");  // no references
  g.in_references = 8.3e5;
  EXPECT_THAT(left_beyond_references(d, g), ::testing::HasSubstr("2.1 times what the references"));
  g.in_references = 8.9e5;
  EXPECT_EQ(left_beyond_references(d, g), "");
}

/// What the references leave as well is no sign against an effect in the suspect log, unless it has the opposite sign.
TEST(ResidualLevels, OnlyWhatTheReferencesDoNotLeaveIsUnmodelled) {
  const auto share = [](double suspect, double reference, BesideReferences beside) {
    const Diagnosis d = with_laws(suspect, reference);
    return unmodelled_share(d, find_residual_structure(d.evidence, d.search.final).at(0), beside);
  };
  EXPECT_EQ(share(1.5, 0.0, BesideReferences::kMore), 1.0);
  EXPECT_EQ(share(1.5, 1.6, BesideReferences::kMore), 0.0);
  EXPECT_EQ(share(1.5, -1.6, BesideReferences::kOpposite), 1.0);
}

/// An oscillation is measured before the filter. Where the filtered residual is the sensors' noise, in the references as well, it is
/// no change, however large it was before; the same residual over a floor that is nine tenths smaller is one.
TEST(ResidualLevels, AnOscillationIsLimitedByTheResidualBeyondTheNoise) {
  Diagnosis d = with_laws(0.0, 0.0);
  const std::size_t jib = jib_force(d);
  ResidualStructure left;
  left.channel = jib;
  left.oscillation = true;
  left.rms = 3.0 * kNoise;
  double& floor = d.evidence.channels[jib].noise_floor;
  const double here = suspect_rms(d.evidence, jib, d.search.final.residual[jib]);
  floor = here;
  EXPECT_EQ(unmodelled_share(d, left, BesideReferences::kMore), 0.0);
  EXPECT_EQ(beside_references(d, {left}, {}).at(0), BesideReferences::kShared);
  floor = 0.1 * here;
  d.search.final.residual[jib] = d.search.final.residual[jib].eval();
  for (std::size_t b = 0; b < d.evidence.channels[jib].blocks.size(); ++b) {
    const NoiseBlock& rows = d.evidence.channels[jib].blocks[b];
    if (d.evidence.channels[jib].log[b] != 0)
      d.search.final.residual[jib].segment(rows.first, rows.last - rows.first) *= 0.1;
  }
  EXPECT_GT(unmodelled_share(d, left, BesideReferences::kMore), 0.9);
  EXPECT_EQ(beside_references(d, {left}, {}).at(0), BesideReferences::kMore);
}

}  // namespace
}  // namespace sparflow
