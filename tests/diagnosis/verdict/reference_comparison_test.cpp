/// Diagnosis against references: what both logs show is no change, another value of it is one.
#include "diagnosis/verdict/reference_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>
#include <random>

#include "diagnosis/selection/search_candidates.h"
#include "identification/learning/fit.h"
#include "identification/signals/series.h"
#include "models/effects/hydraulics.h"
#include "tests/diagnosis/evidence_support.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using simulator::HiddenEffect;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing_support::drawn_machine;

const Machine& loader() {
  static const Machine machine = drawn_machine("loader_crane");
  return machine;
}

/// A log of one crane at its own motions.
Log crane_log(const std::vector<HiddenEffect>& effects, std::uint64_t motions) {
  simulator::CaseRequest request;
  request.log.machine = loader();
  request.log.effects = effects;
  request.log.crane_seed = 7;
  request.log.motion_seed = motions;
  request.log.seconds = 100.0;
  request.test_seconds = 5.0;
  return log_from_text("log.csv", simulator::csv_text(simulator::generate_case(request).train),
                       loader());
}

std::vector<std::string> keys_of(const std::vector<DiagnosedEffect>& effects) {
  std::vector<std::string> keys;
  keys.reserve(effects.size());
  for (const DiagnosedEffect& e : effects) keys.push_back(e.key());
  return keys;
}

/// Friction of the boom acts in the reference of every case here, and the model does not have it.
struct Compared {
  Log reference = crane_log({{"coulomb_friction", "boom", 1.0, 0}}, 7);
  CraneModel model;
  Compared() {
    FitOptions options;
    options.hold_out_every = 0;
    model = fit(loader(), {reference}, {}, options).model;
  }
  Diagnosis with(const std::vector<HiddenEffect>& effects) const {
    return diagnose(model, {crane_log(effects, 8)}, {reference});
  }
};
const Compared& compared() {
  static const Compared c;
  return c;
}

TEST(ReferenceComparison, TwoEffectsOfAChannelThatActInBothLogsAreAlike) {
  // Dry and viscous friction have similar columns: without the other one, either takes its part over.
  const auto logs = testing_support::hidden_case(loader(), {}, {5, 90.0});
  CraneModel model = CraneModel::untrained(loader());
  Diagnosis d;
  d.evidence = collect_evidence(model, {make_signals(loader(), logs.train)},
                                {make_signals(loader(), logs.reference)});
  ASSERT_TRUE(d.evidence.has_reference());
  const auto at = d.evidence.find(EvidenceKind::kForce, 1) - d.evidence.channels.data();
  EvidenceChannel& channel = d.evidence.channels[static_cast<std::size_t>(at)];
  std::mt19937_64 random(2);
  NoiseModel noise;
  noise.phi1 = 0.4;
  noise.variance = 200.0 * 200.0;  // [N^2]
  channel.y = testing_support::draw(noise, channel.blocks, random);
  for (const auto& [id, size] : {std::pair{"coulomb_friction", 2e3}, {"viscous_friction", 5e4}}) {
    const EffectAt effect{find_effect(id), 1};
    channel.y += size * d.evidence.columns(effect, {}, channel, {}, ActingLogs::kAll).col(0);
    FoundEffect found;
    found.design = make_design(d.evidence, effect, {});
    d.search.found.push_back(std::move(found));
  }
  FitControl control;
  control.keep_residuals = true;
  d.search.final = fit_effects(d.evidence, {&d.search.found[0].design, &d.search.found[1].design},
                               nullptr, control);
  EXPECT_EQ(in_references(d, 0, {}), InReferences::kAlike);
  EXPECT_EQ(in_references(d, 1, {}), InReferences::kAlike);
}

/// The dead bands of both directions follow two stretches of motion whatever the cause is, so that these prove no change; eight do.
TEST(ReferenceComparison, ALawWithAsManyParametersAsStretchesOfMotionIsNoChange) {
  const auto logs = testing_support::hidden_case(loader(), {}, {5, 90.0});
  const CraneModel model = CraneModel::untrained(loader());
  for (const int stretches : {2, 8}) {
    Diagnosis d;
    d.evidence = collect_evidence(model, {make_signals(loader(), logs.train)},
                                  {make_signals(loader(), logs.reference)});
    const int boom = loader().cylinder_index("boom");
    const auto at = d.evidence.find(EvidenceKind::kFlow, boom) - d.evidence.channels.data();
    EvidenceChannel& channel = d.evidence.channels[static_cast<std::size_t>(at)];
    FoundEffect found;
    found.design = make_design(d.evidence, {find_effect("valve_deadband"), boom}, {0.0});
    ASSERT_EQ(found.design.linear, 2);
    found.held_out_chance = 0.0;
    int acting = 0;
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      if (channel.log[b] == 0 && acting++ < stretches) continue;
      const Eigen::Index first = channel.blocks[b].first;
      found.design.columns[static_cast<std::size_t>(at)]
          .middleRows(first, channel.blocks[b].last - first)
          .setZero();
    }
    ASSERT_GT(acting, 8);
    std::mt19937_64 random(2);
    NoiseModel noise;
    noise.variance = 1e-3 * 1e-3;  // [m^2/s^2]
    channel.y = testing_support::draw(noise, channel.blocks, random) +
                found.design.columns[static_cast<std::size_t>(at)] * Eigen::Vector2d(0.1, 0.1);
    d.search.found.push_back(std::move(found));
    FitControl control;
    control.keep_residuals = true;
    d.search.final = fit_effects(d.evidence, {&d.search.found[0].design}, nullptr, control);
    EXPECT_EQ(in_references(d, 0, {}), stretches == 2 ? InReferences::kVaries : InReferences::kNot)
        << stretches << " stretches";
  }
}

/// A lag whose time constant differs less between both logs than either tells it is no change, whatever the sizes of the one law in
/// the other log say and whichever variant of the law each log prefers; a lag whose intervals exclude each other is one.
/// Of a late law the product of share and time is known better than either: where it differs, each interval by itself may still hold
/// the other log's value.
TEST(ReferenceComparison, ValuesWithinTheIntervalsOfTheReferencesAreAlike) {
  const auto logs = testing_support::hidden_case(loader(), {}, {5, 90.0});
  const CraneModel model = CraneModel::untrained(loader());
  const Effect* lag = find_effect("pump_lag");
  struct Intervals {
    double half;         // [s] width of those of the time constants
    double form;         // variant of the law in the suspect log
    double correlation;  // of share and time constant
  };
  for (const auto& [half, form, correlation] : {Intervals{0.1, 0.0, 0.0},
                                                {0.01, 0.0, 0.0},
                                                {0.1, 1.0, 0.0},
                                                {0.01, 1.0, 0.0},
                                                {0.1, 0.0, -0.99}}) {
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(7, 7);
    covariance.topLeftCorner(2, 2) << 0.05 * 0.05, correlation * 0.05 * 0.5 * half,
        correlation * 0.05 * 0.5 * half, 0.25 * half * half;
    EvidenceOptions options;
    options.shared = {{lag,
                       0,
                       {1.0, 0.30, 0.0, 0.0, 0.0, 0.0, 0.0},
                       {0.9, 0.30 - half, 0.0, 0.0, 0.0, 0.0, 0.0},
                       {1.1, 0.30 + half, 0.0, 0.0, 0.0, 0.0, 0.0},
                       covariance}};
    Diagnosis d;
    d.evidence = collect_evidence(model, {make_signals(loader(), logs.train)},
                                  {make_signals(loader(), logs.reference)}, nullptr, options);
    const auto at = d.evidence.find(EvidenceKind::kPump, 0) - d.evidence.channels.data();
    EvidenceChannel& channel = d.evidence.channels[static_cast<std::size_t>(at)];
    FoundEffect found;
    found.design = make_design(d.evidence, {lag, 0}, {0.36, form, 0.0, 0.0, 0.0, 0.0});
    found.values = {1.0, 0.36, form, 0.0, 0.0, 0.0, 0.0};
    found.lower95 = {0.9, 0.36 - half, form, 0.0, 0.0, 0.0, 0.0};
    found.upper95 = {1.1, 0.36 + half, form, 0.0, 0.0, 0.0, 0.0};
    found.covariance = covariance;
    found.held_out_chance = 0.0;
    std::mt19937_64 random(2);
    NoiseModel noise;
    noise.variance = 1e5 * 1e5;  // [Pa^2]
    channel.y = testing_support::draw(noise, channel.blocks, random) +
                found.design.columns[static_cast<std::size_t>(at)].col(0);
    d.search.found.push_back(std::move(found));
    FitControl control;
    control.keep_residuals = true;
    d.search.final = fit_effects(d.evidence, {&d.search.found[0].design}, nullptr, control);
    if (half > 0.05 && correlation == 0.0)
      EXPECT_EQ(in_references(d, 0, {}), InReferences::kAlike);
    else
      EXPECT_THAT(in_references(d, 0, {}), AnyOf(InReferences::kNot, InReferences::kOther));
  }
}

/// A lag of a valve that the references' own diagnosis has left out is estimated from them alone before it is called a change: it is
/// none if the values agree, in whichever variant, and is one if they differ or if the references do not have it.
TEST(ReferenceComparison, ALawOfSeveralParametersIsEstimatedFromTheReferencesAlone) {
  const auto logs =
      testing_support::hidden_case(loader(), {{"valve_lag", "boom", 1.0, 0}}, {7, 100.0});
  const double tau = logs.truth("valve_lag", "tau");
  FitOptions options;
  options.hold_out_every = 0;
  const CraneModel model = fit(loader(), {logs.reference}, {}, options).model;
  const auto found_with = [&](double at, double delay, const Log& reference) {
    DiagnosisSignals signals;
    signals.references = {make_signals(loader(), reference)};
    Diagnosis d;
    FoundEffect found;
    found.design.effect = {find_effect("valve_lag"), loader().cylinder_index("boom")};
    found.design.shape = {at, delay};
    found.values = {1.0, at, delay};
    found.lower95 = {0.9, 0.9 * at, delay};
    found.upper95 = {1.1, 1.1 * at, delay};
    found.covariance = Eigen::Vector3d(0.05 * 0.05, 0.05 * 0.05 * at * at, 0.0).asDiagonal();
    d.search.found.push_back(found);
    return found_in_references(model, signals, DiagnoseOptions{}, d, 0);
  };
  EXPECT_TRUE(found_with(1.05 * tau, 0.0, logs.train));
  EXPECT_TRUE(found_with(1.05 * tau, 1.0, logs.train)) << "another variant";
  EXPECT_FALSE(found_with(2.0 * tau, 0.0, logs.train)) << "another value";
  EXPECT_FALSE(found_with(1.05 * tau, 0.0, logs.reference)) << "not in the references";
}

/// Evidence of both logs, which have a dead band of the boom's valve whose gain stays, and the variant that vanishes at full opening as
/// an effect found.
struct TwoVariants {
  EffectAt band{find_effect("valve_deadband"), loader().cylinder_index("boom")};
  Diagnosis d;
  std::size_t at = 0;  ///< of the speed's channel

  explicit TwoVariants(const testing_support::HiddenCase& logs) {
    EvidenceOptions options;
    options.shared = {{band.effect, band.at, {0.05, 0.05, 0.0}, {}, {}}};
    d.evidence =
        collect_evidence(CraneModel::untrained(loader()), {make_signals(loader(), logs.train)},
                         {make_signals(loader(), logs.reference)}, nullptr, options);
    at = static_cast<std::size_t>(d.evidence.find(EvidenceKind::kFlow, band.at) -
                                  d.evidence.channels.data());
    FoundEffect found;
    found.design = make_design(d.evidence, band, {1.0});
    found.held_out_chance = 0.0;
    d.search.found.push_back(std::move(found));
  }
  Eigen::VectorXd shown(double variant, double size, ActingLogs where) const {
    return d.evidence.columns(band, std::vector{variant}, d.evidence.channels[at], {}, where) *
           Eigen::Vector2d(size, size);
  }
  void fit_to(const Eigen::VectorXd& speed) {
    EvidenceChannel& channel = d.evidence.channels[at];
    std::mt19937_64 random(2);
    NoiseModel noise;
    noise.variance = 1e-3 * 1e-3;  // [m^2/s^2]
    channel.y = testing_support::draw(noise, channel.blocks, random) + speed;
    FitControl control;
    control.keep_residuals = true;
    d.search.final = fit_effects(d.evidence, {&d.search.found[0].design}, nullptr, control);
  }
};

/// Both logs have a dead band, and the change is best told by its other variant. In either group of logs the size of that variant is
/// compared while the law that both have keeps its values: estimated anew, it would be the sum of both sizes, and neither is determined.
TEST(ReferenceComparison, AnotherVariantOfALawThatBothLogsHaveIsCompared) {
  TwoVariants bands(testing_support::hidden_case(loader(), {}, {5, 90.0}));
  for (const bool changed : {true, false}) {
    bands.fit_to(bands.shown(1.0, 0.04, changed ? ActingLogs::kSuspects : ActingLogs::kAll));
    EXPECT_EQ(in_references(bands.d, 0, {}), changed ? InReferences::kNot : InReferences::kAlike);
  }
}

/// A friction of the boom that decays with the speed, in white noise, in a suspect log and in a reference of slower motions.
struct Decays {
  double found = 0.0, acting = 0.0;  ///< [m/s] speed of the decay that was found, and that acts
  double suspect = 0.0, reference = 0.0;  ///< [N] that act
};
Diagnosis with_decays(const Decays& decays) {
  auto logs = testing_support::hidden_case(loader(), {}, {5, 90.0});
  logs.reference.time *= 12.0;
  const EffectAt friction{find_effect("stribeck_friction"), loader().cylinder_index("boom")};
  EvidenceOptions options;
  options.force_widths.clear();  // short stretches have rows behind no filter but the signals' own
  Diagnosis d;
  d.evidence =
      collect_evidence(CraneModel::untrained(loader()), {make_signals(loader(), logs.train)},
                       {make_signals(loader(), logs.reference)}, nullptr, options);
  const auto at = d.evidence.find(EvidenceKind::kForce, friction.at) - d.evidence.channels.data();
  EvidenceChannel& channel = d.evidence.channels[static_cast<std::size_t>(at)];
  std::mt19937_64 random(2);
  NoiseModel noise;
  noise.variance = 50.0 * 50.0;  // [N^2]
  channel.y = testing_support::draw(noise, channel.blocks, random);
  for (const auto& [where, force] : {std::pair{ActingLogs::kSuspects, decays.suspect},
                                     {ActingLogs::kReferences, decays.reference}})
    channel.y +=
        force * d.evidence.columns(friction, std::vector{decays.acting}, channel, {}, where).col(0);
  FoundEffect found;
  found.design = make_design(d.evidence, friction, {decays.found});
  found.held_out_chance = 0.0;
  d.search.found.push_back(std::move(found));
  FitControl control;
  control.keep_residuals = true;
  d.search.final = fit_effects(d.evidence, {&d.search.found[0].design}, nullptr, control);
  return d;
}

/// The speed of decay that was found in the suspect log is not that of the machine. The reference, with slower motions, has 3.6 times the
/// size of that law, although one law explains both logs; none explains a friction of the suspect log alone.
TEST(ReferenceComparison, OneLawThatExplainsBothLogsIsNoChange) {
  const auto alike = all_in_references(with_decays({0.1, 0.006, 4000.0, 4000.0}), {}, false);
  EXPECT_EQ(alike[0].there, InReferences::kAlike);
  ASSERT_TRUE(alike[0].law);
  EXPECT_NEAR(alike[0].law->values[0], 4000.0, 150.0);
  EXPECT_NEAR(alike[0].law->values[1], 0.006, 0.0003);
  const auto changed = all_in_references(with_decays({0.01, 0.006, 4000.0, 0.0}), {}, false);
  EXPECT_THAT(changed[0].there, AnyOf(InReferences::kNot, InReferences::kOther));
  EXPECT_FALSE(changed[0].law);
}

/// A law that both logs have is estimated without bounds. Where it has become its own opposite, another variant beside it may only undo
/// that in the suspect log: by itself it has no size there.
TEST(ReferenceComparison, WhatUndoesTheOppositeOfALawIsNoChange) {
  auto logs = testing_support::hidden_case(loader(), {}, {5, 90.0});
  for (auto& [log, largest] : {std::pair{&logs.train, 0.15}, {&logs.reference, 1.0}}) {
    Eigen::VectorXd& command = testing_support::channel(*log, "u_boom").values;
    command *= largest / command.cwiseAbs().maxCoeff();  // the variants differ by the opening
  }
  TwoVariants bands(logs);
  bands.fit_to(bands.shown(1.0, 0.05, ActingLogs::kSuspects) -
               bands.shown(0.0, 0.05, ActingLogs::kAll));
  EXPECT_GT(bands.d.search.final.theta.minCoeff(), 0.03) << "found beside the opposite";
  EXPECT_EQ(in_references(bands.d, 0, {}), InReferences::kVaries);
}

/// A friction of the jib in white noise, of one size in the suspect and of another in the reference log.
struct Sizes {
  double suspect = 0.0, reference = 0.0;  ///< [N]
  double deviation = 2000.0;              ///< of the noise [N]
  double louder = 1.0;                    ///< noise of the suspect log over that of the reference
  double least_explained = VerdictOptions{}.least_excess_explained;
  double known =
      0.0;  ///< [N] the model's own friction of both logs, of which the found one is a change
};
Diagnosis with_sizes(const Sizes& sizes) {
  const auto logs = testing_support::hidden_case(loader(), {}, {5, 90.0});
  const EffectAt friction{find_effect("coulomb_friction"), 1};
  EvidenceOptions options;
  options.force_widths.clear();  // the numbers of the tests are of stretches as they are without
  if (sizes.known > 0.0) options.shared = {{friction.effect, friction.at, {sizes.known}, {}, {}}};
  Diagnosis d;
  d.evidence =
      collect_evidence(CraneModel::untrained(loader()), {make_signals(loader(), logs.train)},
                       {make_signals(loader(), logs.reference)}, nullptr, options);
  const auto at = d.evidence.find(EvidenceKind::kForce, 1) - d.evidence.channels.data();
  EvidenceChannel& channel = d.evidence.channels[static_cast<std::size_t>(at)];
  std::mt19937_64 random(2);
  NoiseModel noise;
  noise.variance = sizes.deviation * sizes.deviation;
  FoundEffect found;
  found.design = make_design(d.evidence, friction, {});
  found.held_out_chance = 0.0;
  channel.y = testing_support::draw(noise, channel.blocks, random);
  for (std::size_t b = 0; b < channel.blocks.size(); ++b)
    if (channel.log[b] == 0)
      channel.y.segment(channel.blocks[b].first,
                        channel.blocks[b].last - channel.blocks[b].first) *= sizes.louder;
  channel.y += sizes.suspect * found.design.columns[static_cast<std::size_t>(at)].col(0) +
               sizes.reference *
                   d.evidence.columns(friction, {}, channel, {}, ActingLogs::kReferences).col(0);
  d.thresholds.least_excess_explained = sizes.least_explained;
  d.search.found.push_back(std::move(found));
  FitControl control;
  control.keep_residuals = true;
  d.search.final = fit_effects(d.evidence, {&d.search.found[0].design}, nullptr, control);
  return d;
}
InReferences compared_sizes(const Sizes& sizes) { return in_references(with_sizes(sizes), 0, {}); }

/// The residual of 2 kN is no larger with the friction left in it. In this draw the sizes then differ by 3.0, 3.9, 4.5 and 7.5 standard
/// errors, which 17 stretches of motion tell: chances of 0.008, 0.0013, 0.0004 and less, of which the first two lie between both
/// levels (by the normal distribution the second would be 0.0001).
TEST(ReferenceComparison, ADifferenceIsAChangeByItsSizeAloneOnlyIfItIsCertain) {
  EXPECT_EQ(compared_sizes({1000.0, 1100.0}), InReferences::kAlike);
  EXPECT_EQ(compared_sizes({1000.0, 950.0}), InReferences::kAlike);
  EXPECT_EQ(compared_sizes({1000.0, 850.0}), InReferences::kOther);
  EXPECT_EQ(compared_sizes({1000.0, 350.0}), InReferences::kNot);
}

/// The difference of 1000 and 950 N is one that the residuals must prove. They do not while both logs have another friction, of the
/// boom, which joins the references first; only in the last turn they must.
TEST(ReferenceComparison, ResidualsProveADifferenceOnceWhatBothHaveActsInBoth) {
  Diagnosis d = with_sizes({1000.0, 950.0});
  const EffectAt friction{find_effect("viscous_friction"), loader().cylinder_index("boom")};
  const auto at = d.evidence.find(EvidenceKind::kForce, friction.at) - d.evidence.channels.data();
  EvidenceChannel& channel = d.evidence.channels[static_cast<std::size_t>(at)];
  std::mt19937_64 random(3);
  NoiseModel noise;
  noise.variance = 200.0 * 200.0;  // [N^2]
  channel.y = testing_support::draw(noise, channel.blocks, random) +
              5e4 * d.evidence.columns(friction, {}, channel, {}, ActingLogs::kAll).col(0);
  FoundEffect alike;
  alike.design = make_design(d.evidence, friction, {});
  alike.held_out_chance = 0.0;
  d.search.found.push_back(std::move(alike));
  FitControl control;
  control.keep_residuals = true;
  d.search.final = fit_effects(d.evidence, {&d.search.found[0].design, &d.search.found[1].design},
                               nullptr, control);
  const auto there = [&](bool last) {
    std::vector<InReferences> out;
    for (const ComparedWithReferences& c : all_in_references(d, {}, last)) out.push_back(c.there);
    return out;
  };
  EXPECT_THAT(there(false), ElementsAre(InReferences::kOther, InReferences::kAlike));
  EXPECT_THAT(there(true), ElementsAre(InReferences::kAlike, InReferences::kAlike));
}

/// A suspect log that is twice as noisy as the reference exceeds it with the effect and without: of the squared residual beyond that of
/// the reference the effect explains 18 %. The difference of the sizes, 3.1 standard errors, is significant and no more.
TEST(ReferenceComparison, AnEffectThatExplainsLittleOfTheExcessIsNoChange) {
  EXPECT_EQ(compared_sizes({1000.0, 1080.0, 2000.0, 2.0}), InReferences::kAlike);
  EXPECT_EQ(compared_sizes({1000.0, 1080.0, 2000.0, 2.0, 0.0}), InReferences::kOther);
}

/// Form error of the law: 5 % of what both logs have. 8 % more is 1.6 of it, 40 % more is 8; sampling alone resolves 1 %.
TEST(ReferenceComparison, ADifferenceWithinTheFormErrorOfTheLawIsNoChange) {
  EXPECT_EQ(compared_sizes({1000.0, 1080.0, 40.0}), InReferences::kAlike);
  EXPECT_EQ(compared_sizes({1000.0, 1400.0, 40.0}), InReferences::kOther);
}

/// A change must improve the prediction of motions left out, be it another value of a law that the references have or a law of its own.
TEST(ReferenceComparison, AChangeMustPredictMotionsLeftOut) {
  const auto compared = [](double known, double chance) {
    Diagnosis d =
        with_sizes({400.0, 0.0, 40.0, 1.0, VerdictOptions{}.least_excess_explained, known});
    d.search.found[0].held_out_chance = chance;
    return in_references(d, 0, {});
  };
  EXPECT_EQ(compared(1000.0, 0.051), InReferences::kVaries);
  EXPECT_EQ(compared(1000.0, 0.049), InReferences::kOther);
  EXPECT_EQ(compared(0.0, 0.051), InReferences::kVaries);
  EXPECT_EQ(compared(0.0, 0.049), InReferences::kNot);
}

/// A valve whose flow falls with the load has the signature of a leak in motion; both logs have it, so that a reference tells them apart.
TEST(ReferenceComparison, ALeakInMotionIsACandidateBesideAReferenceOnly) {
  const auto logs = testing_support::hidden_case(loader(), {}, {5, 90.0});
  const MachineSignals train = make_signals(loader(), logs.train),
                       reference = make_signals(loader(), logs.reference);
  const auto forms = [&](const std::vector<MachineSignals>& references) {
    const Evidence evidence =
        collect_evidence(CraneModel::untrained(loader()), {train}, references);
    std::vector<double> found;
    for (const SearchCandidate& c : search_candidates(evidence, {{find_effect("leakage"), 1}}))
      for (const EffectDesign& d : c.designs) found.push_back(d.shape.front());
    return found;
  };
  EXPECT_THAT(forms({reference}), Contains(2.0));
  EXPECT_THAT(forms({}), testing::AllOf(Contains(1.0), testing::Not(Contains(2.0))));
}

TEST(ReferenceComparison, WhatBothLogsShowIsNoChange) {
  const Diagnosis d = compared().with({{"coulomb_friction", "boom", 1.0, 0}});
  EXPECT_EQ(d.verdict, Verdict::kNone) << d.table();
  EXPECT_THAT(d.effects, IsEmpty());
  EXPECT_THAT(keys_of(d.lacking), Contains("coulomb_friction:boom"));
}

TEST(ReferenceComparison, AChangeBesideItIsNamedAlone) {
  const Diagnosis d =
      compared().with({{"coulomb_friction", "boom", 1.0, 0}, {"viscous_friction", "jib", 1.0, 0}});
  EXPECT_EQ(d.verdict, Verdict::kMissing) << d.table();
  EXPECT_THAT(keys_of(d.effects), ElementsAre("viscous_friction:jib")) << d.table();
  EXPECT_FALSE(d.effects.front().change);
  EXPECT_THAT(keys_of(d.lacking), Contains("coulomb_friction:boom"));
}

/// A force that no law explains in two motions of either log would hide a friction that all others show.
TEST(ReferenceComparison, MotionsThatNoLawExplainsHideNoChangeThatAllOthersShow) {
  const auto disturbed = [](Log log, double from) {
    Eigen::VectorXd& pressure = testing_support::channel(log, "pA_boom").values;
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      const double t = log.time[k] - from;
      if (t > 0.0 && t < 12.0) pressure[k] += 60e5 * std::sin(2.0 * std::numbers::pi * 0.21 * t);
    }
    return log;
  };
  const Log reference = disturbed(crane_log({}, 7), 40.0);
  const CraneModel model = [] {
    FitOptions options;
    options.hold_out_every = 0;
    return fit(loader(), {crane_log({}, 7)}, {}, options).model;
  }();
  const Log log = disturbed(crane_log({{"viscous_friction", "boom", 0.4, 0}}, 8), 20.0);
  DiagnoseOptions options;
  options.check_data = false;
  const Diagnosis d = diagnose(model, {log}, {reference}, options);
  EXPECT_EQ(d.verdict, Verdict::kMissing);
  ASSERT_THAT(keys_of(d.effects), ElementsAre("viscous_friction:boom"));
  // The error that is shown is the one by which it was judged: the disturbed motions hide what the effect explains.
  EXPECT_TRUE(d.stretches_weighed);
  EXPECT_THAT(d.table(), HasSubstr("weighed by the variance of each stretch of motion"));
  const ChannelGain& gain = d.effects[0].channels[0];
  EXPECT_GT(gain.weighed_before / gain.weighed_after, gain.rmse_before / gain.rmse_after);
  const EvidenceChannel& force = d.evidence.channels[gain.channel];
  const NoiseModel& noise = d.search.final.noise[gain.channel];
  double squares = 0.0, rows = 0.0;
  for (std::size_t b = 0; b < force.blocks.size(); ++b) {
    for (Eigen::Index r = force.blocks[b].first; force.log[b] == 0 && r < force.blocks[b].last;
         ++r) {
      const double deviation = noise.block_scale[b];
      squares += std::pow(d.search.final.residual[gain.channel][r] / deviation, 2);
      rows += 1.0 / (deviation * deviation);
    }
  }
  EXPECT_NEAR(gain.after(), std::sqrt(squares / rows), 1e-9 * gain.after());
  options.evidence.mechanisms.switch_off(Mechanism::kBlocks);
  const Diagnosis w = diagnose(model, {log}, {reference}, options);
  EXPECT_THAT(keys_of(w.effects), IsEmpty());
  EXPECT_FALSE(w.stretches_weighed);
}

TEST(ReferenceComparison, AnotherValueOfItIsAChangeAndItsParametersAreTheDifference) {
  const Diagnosis d = compared().with({{"coulomb_friction", "boom", 2.0, 0}});
  EXPECT_EQ(d.verdict, Verdict::kMissing) << d.table();
  ASSERT_THAT(keys_of(d.effects), ElementsAre("coulomb_friction:boom")) << d.table();
  EXPECT_TRUE(d.effects.front().change);
  ASSERT_THAT(keys_of(d.lacking), Contains("coulomb_friction:boom"));
  const auto shared =
      std::find_if(d.lacking.begin(), d.lacking.end(),
                   [](const DiagnosedEffect& e) { return e.key() == "coulomb_friction:boom"; });
  // twice the effect: the difference is as large as what both have, but for the errors of both estimates
  EXPECT_NEAR(d.effects.front().parameters.front().value / shared->parameters.front().value, 1.0,
              0.15);
}

/// The log with a measured pressure of the return line: 1 bar, `loss` bar at all return flows of 100 l/min (turbulent), and
/// a sensor's noise of 0.1 bar.
Log with_return_pressure(Log log, double loss, unsigned seed) {
  const MachineSeries series =
      make_series(CraneModel::untrained(loader()), make_signals(loader(), log));
  const double full = 100.0 / 60000.0;  // [m^3/s]
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.1e5);
  Channel c;
  c.column = "p_return_bar";
  c.signal = "p_return";
  c.role = Role::kReturnPressure;
  c.unit = "Pa";
  c.values = 1e5 + 1e5 * loss * (total_return_flow(series).array() / full).square();
  for (double& v : c.values) v += noise(random);
  c.valid = c.values.array().isFinite();
  log.channels.push_back(std::move(c));
  return log;
}

/// Without chamber pressures, so that the return line's sensor alone can show it.
Log without_chambers(Log log) {
  std::erase_if(log.channels, [](const Channel& c) {
    return c.role == Role::kPressureA || c.role == Role::kPressureB;
  });
  return log;
}

TEST(ReferenceComparison, AReturnLineThatHasChangedIsFoundInItsMeasuredPressure) {
  const Log reference = without_chambers(with_return_pressure(compared().reference, 2.0, 1));
  const Log suspect = crane_log({{"coulomb_friction", "boom", 1.0, 0}}, 8);
  const Diagnosis changed = diagnose(
      compared().model, {without_chambers(with_return_pressure(suspect, 6.0, 2))}, {reference});
  EXPECT_THAT(keys_of(changed.effects), ElementsAre("return_back_pressure")) << changed.table();
  // 4 bar more at 100 l/min; 0.1 bar of noise in some hundred rows
  ASSERT_FALSE(changed.effects.empty());
  EXPECT_NEAR(changed.effects.front().parameters.front().value, 4.0 / (100.0 * 100.0), 0.1 * 4e-4);
  const Diagnosis same = diagnose(
      compared().model, {without_chambers(with_return_pressure(suspect, 2.0, 3))}, {reference});
  EXPECT_EQ(same.verdict, Verdict::kNone) << same.table();
}

/// Logs of a public hydraulics simulator, whose laws nobody here wrote.
struct ForeignPlant {
  std::string shared = std::string(SPARFLOW_SOURCE_DIR) + "/../shared/";
  std::string folder = shared + "data/foreign_plant/";
  Machine machine = load_machine(shared + "machines/three_axis.yaml");
  Log reference = load_log(folder + "ref1.csv", machine);
  CraneModel model = learned();

  static bool absent() {
    return !std::filesystem::exists(std::string(SPARFLOW_SOURCE_DIR) +
                                    "/../shared/data/foreign_plant");
  }
  CraneModel learned() const {
    FitOptions options;
    options.hold_out_every = 0;
    return fit(machine, {reference}, {}, options).model;
  }
  Diagnosis of(const char* name) const {
    return diagnose(model, {load_log(folder + name, machine)}, {reference});
  }
  std::vector<std::string> named(const char* name) const { return keys_of(of(name).effects); }
};

TEST(ReferenceComparison, ChangesOfAForeignPlantAreNamedAlone) {
  if (ForeignPlant::absent())
    GTEST_SKIP() << "the logs of the foreign plant are not part of the repository";
  const ForeignPlant plant;
  EXPECT_THAT(plant.named("a1.csv"), ElementsAre("coulomb_friction:lift"));
  EXPECT_THAT(plant.named("b1.csv"), ElementsAre("viscous_friction:lift"));
  EXPECT_THAT(plant.named("d1.csv"), ElementsAre("leakage:lift"));
  EXPECT_THAT(plant.named("hl1.csv"), ElementsAre("line_loss:lift"));
  EXPECT_THAT(plant.named("j1.csv"), ElementsAre("pressure_offset:lift"));
  EXPECT_THAT(plant.named("i1.csv"), ElementsAre("flow_saturation:main"));
}

TEST(ReferenceComparison, AForeignPlantWithoutAChangeIsCleanAndAHuntingPumpUnknown) {
  if (ForeignPlant::absent())
    GTEST_SKIP() << "the logs of the foreign plant are not part of the repository";
  const ForeignPlant plant;
  EXPECT_THAT(plant.named("clean1.csv"), IsEmpty());
  EXPECT_THAT(plant.named("clean2.csv"), IsEmpty());
  // The regulator hunts in one motion only: the mean level of the residual hardly moves, and no law fits. What both logs lack
  // in another channel gains more than it.
  const Diagnosis hunting = plant.of("e1.csv");
  EXPECT_NE(hunting.verdict, Verdict::kNone) << hunting.table();
  EXPECT_NE(hunting.verdict, Verdict::kBadData) << hunting.table();
}

}  // namespace
}  // namespace sparflow
