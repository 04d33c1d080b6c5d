/// One law of a valve's lag for suspect and reference logs, against the law that each group prefers.
#include "diagnosis/verdict/law_comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "identification/signals/signals.h"
#include "tests/diagnosis/evidence_support.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

const Machine& lagging_crane() {
  static const Machine machine = testing_support::drawn_machine("loader_crane");
  return machine;
}

/// Time constants of the lag of the jib's valve. [s]
struct Lags {
  double suspects, references;  ///< that act in the logs
  double found, known;          ///< that suspect logs and references prefer by themselves
};

EffectAt lag() { return {find_effect("valve_lag"), lagging_crane().cylinder_index("jib")}; }

/// The speeds of the jib are nothing but the lags and white noise of 2 mm/s.
Diagnosis with_lags(const Lags& lags) {
  const auto logs = testing_support::hidden_case(lagging_crane(), {}, {5, 90.0});
  EvidenceOptions options;
  options.shared = {{lag().effect, lag().at, {1.0, lags.known, 0.0}, {}, {}}};
  Diagnosis d;
  d.evidence = collect_evidence(CraneModel::untrained(lagging_crane()),
                                {make_signals(lagging_crane(), logs.train)},
                                {make_signals(lagging_crane(), logs.reference)}, nullptr, options);
  const auto at = static_cast<std::size_t>(d.evidence.find(EvidenceKind::kFlow, lag().at) -
                                           d.evidence.channels.data());
  EvidenceChannel& channel = d.evidence.channels[at];
  Evidence plain = d.evidence;  // whose columns are the laws themselves
  plain.options.shared.clear();
  const auto law = [&](double tau, ActingLogs where) {
    return VectorXd(plain.columns(lag(), std::vector<double>{tau, 0.0}, channel, {}, where).col(0));
  };
  std::mt19937_64 random(2);
  NoiseModel noise;
  noise.variance = 0.002 * 0.002;  // [m^2/s^2]
  // what the known law leaves
  channel.y = testing_support::draw(noise, channel.blocks, random) +
              law(lags.suspects, ActingLogs::kSuspects) +
              law(lags.references, ActingLogs::kReferences) - law(lags.known, ActingLogs::kAll);
  FoundEffect found;
  found.design = make_design(d.evidence, lag(), {lags.found, 0.0});
  d.search.found.push_back(std::move(found));
  return d;
}

bool explains_both(const Diagnosis& d, double tau) {
  FoundEffect law = d.search.found[0];
  law.design.shape[0] = tau;
  return as_good_as_own_laws(d, 0, law);
}

TEST(LawComparison, OneLawIsAsGoodAsTwoThatTheLogsHardlyTellApart) {
  const Diagnosis d = with_lags({0.30, 0.30, 0.31, 0.29});
  EXPECT_TRUE(explains_both(d, 0.30));
  EXPECT_TRUE(explains_both(d, 0.31));
}

TEST(LawComparison, ALawOfOneGroupAloneIsNoLawOfBoth) {
  const Diagnosis d = with_lags({0.6, 0.2, 0.6, 0.2});
  EXPECT_FALSE(explains_both(d, 0.6));  // worse in the references
  EXPECT_FALSE(explains_both(d, 0.2));  // worse in the suspect log
  EXPECT_FALSE(explains_both(d, 0.4));
}

TEST(LawComparison, AStretchThatGainsMuchIsNoAdvantageUnlessTheOthersGain) {
  std::vector<double> gains(25);
  for (std::size_t k = 0; k < gains.size(); ++k) gains[k] = k % 2 == 0 ? 1.0 : -1.5;
  gains[0] = 150.0;
  EXPECT_GT(chance_of_gains_in(gains), 0.1);
  for (double& g : gains) g = std::abs(g);
  EXPECT_NEAR(chance_of_gains_in(gains), std::pow(0.5, 25), 1e-12);  // all of 25
  for (double& g : gains) g = -g;
  EXPECT_GT(chance_of_gains_in(gains), 0.5);
}

/// Five of ten stretches gain and one loses: a chance of 7/64 by their number.
TEST(LawComparison, AMeanThatIsCertainIsAnAdvantageHoweverFewStretchesGain) {
  std::vector<double> gains(10, 0.0);
  for (std::size_t k = 0; k < 5; ++k) gains[k] = 10.0 + static_cast<double>(k);
  gains[9] = -1.0;
  EXPECT_LT(chance_of_gains_in(gains), 0.03);    // 2.4 standard errors, nine degrees of freedom
  EXPECT_EQ(chance_of_gains_in({1000.0}), 0.0);  // not known
}

TEST(LawComparison, ComparesOnlyWhatReplacesALawOfAllLogs) {
  Diagnosis d = with_lags({0.3, 0.3, 0.3, 0.3});
  EXPECT_TRUE(explains_both(d, 0.3));
  d.evidence.options.shared.clear();
  EXPECT_FALSE(explains_both(d, 0.3));
}

}  // namespace
}  // namespace sparflow
