#include "diagnosis/residual/residual_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "diagnosis/residual/residual_oscillation.h"
#include "diagnosis/verdict/residual_levels.h"
#include "models/effects/memory.h"
#include "tests/diagnosis/evidence_support.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const CraneModel& model() {
  static const CraneModel m = [] {
    CraneModel crane = CraneModel::untrained(testing_support::drawn_machine("loader_crane"));
    for (auto& c : crane.cylinders) c.margin = 15e5;
    return crane;
  }();
  return m;
}

/// The motions of a log of 90 s; tests replace the residuals of its channels.
const Evidence& motions() {
  static const Evidence e = collect_evidence(
      model(), {make_signals(model().machine,
                             testing_support::hidden_case(model().machine, {}, {5, 90.0}).train)});
  return e;
}

/// The same with a reference log, by which pressures can be judged.
const Evidence& motions_with_pressures() {
  static const Evidence e = [] {
    const auto logs = testing_support::hidden_case(model().machine, {}, {5, 90.0});
    return collect_evidence(model(), {make_signals(model().machine, logs.train)},
                            {make_signals(model().machine, logs.reference)});
  }();
  return e;
}

/// Coloured noise of unit size in every channel, and white noise before the filter.
struct Left {
  Evidence evidence;
  EffectFit fit;

  explicit Left(unsigned seed, const Evidence& of = motions()) : evidence(of) {
    std::mt19937_64 random(seed);
    NoiseModel noise;
    noise.phi1 = 0.4;
    noise.variance = 1.0 - 0.16;
    for (EvidenceChannel& c : evidence.channels) {
      const double size = c.unit.si;  // N, mm/s, bar
      fit.noise.push_back(noise);
      fit.noise.back().variance *= size * size;
      fit.residual.push_back(size * testing_support::draw(noise, c.blocks, random));
      for (VectorXd& raw : c.raw) raw = size * testing_support::white(raw.size(), random);
    }
  }
  std::size_t channel(EvidenceKind kind, int index) const {
    for (std::size_t k = 0; k < evidence.channels.size(); ++k) {
      if (evidence.channels[k].kind == kind && evidence.channels[k].index == index) return k;
    }
    throw std::logic_error("no such channel");
  }
  /// Adds size * of(sample), in the channel's unit.
  template <class F>
  void add(std::size_t c, double size, const F& of) {
    const EvidenceChannel& e = evidence.channels[c];
    for (Index i = 0; i < e.rows(); ++i)
      fit.residual[c][i] += e.unit.si * size * of(e.sample[static_cast<std::size_t>(i)]);
  }
};

TEST(ResidualModel, NoiseHasNoStructure) {
  int unmodelled = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const Left left(seed);
    unmodelled += find_residual_structure(left.evidence, left.fit).empty() ? 0 : 1;
  }
  // by chance no residual model explains a tenth of the variance on motions left out in about ten channels
  EXPECT_LE(unmodelled, 1) << "of 12 logs with nothing but coloured noise";
}

TEST(ResidualModel, ASineIsFoundWithItsFrequency) {
  for (const double hz : {0.8, 1.7}) {
    Left left(20);
    const std::size_t c = left.channel(EvidenceKind::kPump, 0);
    const VectorXd& time = left.evidence.series[0].time;
    left.add(c, 1.0,
             [&](Index k) { return std::sin(2.0 * std::numbers::pi * hz * time[k] + 1.0); });
    const std::vector<ResidualStructure> found = find_residual_structure(left.evidence, left.fit);
    ASSERT_FALSE(found.empty()) << hz;
    EXPECT_EQ(found[0].channel, c);
    // the width of a line is 1 / 90 s, the length of the log
    EXPECT_NEAR(found[0].frequency, hz, 0.02);
    EXPECT_THAT(found[0].depends_on, Contains(HasSubstr("time")));
    // the sine has a variance of 0.5 and the noise of 1; the share of a line is estimated to about 15 %
    EXPECT_NEAR(found[0].explained, 0.33, 0.12);
    EXPECT_NEAR(found[0].rms, std::sqrt(0.5) * 1e5, 0.25 * std::sqrt(0.5) * 1e5);
  }
}

/// An oscillation of 1.8 Hz and 2.5 bar, the phase of which is lost the sooner the larger `diffusion` [rad/sqrt(s)].
void oscillate(VectorXd& raw, double step, double diffusion, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  double phase = 0.0;
  for (double& v : raw) {
    phase += 2.0 * std::numbers::pi * 1.8 * step + diffusion * std::sqrt(step) * normal(random);
    v += 2.5e5 * std::sin(phase);
  }
}

TEST(ResidualModel, AnOscillationOfVaryingFrequencyIsFound) {
  std::mt19937_64 random(3);
  Left left(21);
  const std::size_t c = left.channel(EvidenceKind::kPump, 0);
  EvidenceChannel& channel = left.evidence.channels[c];
  const double hz = 1.8;
  // the phase is lost within about two seconds: no line in a periodogram of 90 s
  oscillate(channel.raw[0], left.evidence.series[0].step, 1.0, random);
  const std::vector<ResidualStructure> found = find_residual_structure(left.evidence, left.fit);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].channel, c);
  // The phase drifts by sqrt(0.28) = 0.5 rad in half a period, a sixth of it; twice that.
  EXPECT_NEAR(found[0].frequency, hz, 0.3 * hz);
  EXPECT_THAT(found[0].depends_on, Contains(HasSubstr("oscillation")));
}

TEST(ResidualModel, AnOscillationThatTheReferencesHaveLessRegularlyIsNoChange) {
  std::mt19937_64 random(3);
  Left left(21, motions_with_pressures());
  const std::size_t c = left.channel(EvidenceKind::kPump, 0);
  EvidenceChannel& channel = left.evidence.channels[c];
  ASSERT_EQ(channel.raw.size(), 2U);
  const double step = left.evidence.series[0].step;
  const VectorXd quiet = channel.raw[1];
  oscillate(channel.raw[0], step, 1.0, random);
  // the phase is lost within a twelfth of a period: the autocorrelation has a minimum, but a shallow one
  oscillate(channel.raw[1], step, 5.0, random);
  Evidence reference = left.evidence;
  std::swap(reference.series[0], reference.series[1]);
  std::swap(reference.channels[c].raw[0], reference.channels[c].raw[1]);
  const DiagnoseOptions options;
  ASSERT_GT(strongest_oscillation(reference, reference.channels[c], options.residual).dip,
            options.residual.deepest_dip)
      << "the references' one does not count by itself";
  Diagnosis d;
  d.evidence = left.evidence;
  d.search.final = left.fit;
  const std::vector<ResidualStructure> found = find_residual_structure(d.evidence, left.fit);
  ASSERT_FALSE(found.empty());
  ASSERT_TRUE(found[0].channel == c && found[0].oscillation);
  // the references' filtered residual is noise, the other one a little more, so that it says nothing
  d.evidence.channels[c].noise_floor = reference_rms(d, c);
  for (std::size_t b = 0; b < channel.blocks.size(); ++b)
    if (channel.log[b] == 0)
      d.search.final.residual[c].segment(channel.blocks[b].first,
                                         channel.blocks[b].last - channel.blocks[b].first) *= 1.05;
  EXPECT_EQ(beside_references(d, found, options)[0], BesideReferences::kShared);
  // significantly more, but less than twice: the motions alone change the strength of an oscillation
  Diagnosis louder = d;
  for (std::size_t b = 0; b < channel.blocks.size(); ++b)
    if (channel.log[b] == 0)
      louder.search.final.residual[c].segment(
          channel.blocks[b].first, channel.blocks[b].last - channel.blocks[b].first) *= 1.8;
  EXPECT_TRUE(exceeds_references(louder, c));
  EXPECT_EQ(beside_references(louder, found, options)[0], BesideReferences::kShared);
  d.evidence.channels[c].raw[1] = quiet;
  EXPECT_EQ(beside_references(d, found, options)[0], BesideReferences::kMore);
}

TEST(ResidualModel, NoiseBesideAnOscillationIsThatOfAllRuns) {
  // Two runs of the same length, the second with three times the noise of the first: variance (1 + 9) / 2.
  Left left(31);
  const std::size_t c = left.channel(EvidenceKind::kPump, 0);
  EvidenceChannel& channel = left.evidence.channels[c];
  ASSERT_EQ(channel.raw.size(), 1U);
  MachineSeries& series = left.evidence.series[0];
  VectorXd& raw = channel.raw[0];
  const Index middle = raw.size() / 2;
  series.runs = {{0, middle}, {middle, raw.size()}};
  std::mt19937_64 random(4);
  const double size = 0.2e5, hz = 1.8;
  raw = size * testing_support::white(raw.size(), random);
  raw.tail(raw.size() - middle) *= 3.0;
  for (Index i = 0; i < raw.size(); ++i)
    raw[i] += 2.5e5 * std::sin(2.0 * std::numbers::pi * hz * series.step * static_cast<double>(i));
  const Oscillation oscillation = strongest_oscillation(left.evidence, channel, {});
  // Half a period, 0.28 s, is found to a sample of 0.02 s.
  EXPECT_NEAR(oscillation.frequency, hz, 0.1 * hz);
  // standard error of the variance: some 3 % at 2000 samples a run, twice that with third differences
  EXPECT_NEAR(oscillation.noise, size * std::sqrt(5.0), 0.1 * size * std::sqrt(5.0));
}

TEST(ResidualModel, AFunctionOfASignalIsFoundAndTheSignalNamed) {
  Left left(22);
  const std::size_t c = left.channel(EvidenceKind::kPump, 0);
  const VectorXd q = left.evidence.series[0].q.col(1);
  const double lo = q.minCoeff(), hi = q.maxCoeff();
  left.add(c, 1.5,
           [&](Index k) { return std::sin(2.0 * std::numbers::pi * (q[k] - lo) / (hi - lo)); });
  const std::vector<ResidualStructure> found = find_residual_structure(left.evidence, left.fit);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].channel, c);
  EXPECT_EQ(found[0].depends_on.front(), "q_jib");
  // The sine has a variance of 1.5^2 / 2, half of the whole; on motions left out the fit explains less.
  EXPECT_GT(found[0].explained, 0.25);
  EXPECT_EQ(found[0].frequency, 0.0);
}

TEST(ResidualModel, SpeedThatFallsWithLaggedPowerIsFound) {
  // an engine that slows under load, with a time constant between the two of the signals
  Left left(25);
  const std::size_t c = left.channel(EvidenceKind::kFlow, 0);
  const MachineSeries& s = left.evidence.series[0];
  VectorXd power = VectorXd::Zero(s.samples());
  for (const CylinderSeries& cylinder : s.cylinders) power += cylinder.flow;
  power = power.cwiseProduct(s.pumps[0].pressure);
  for (double& p : power) p = std::isfinite(p) ? p : 0.0;
  const VectorXd late = first_order_lag(s, power, 0.8);
  const VectorXd& u = s.cylinders[0].command;
  const double scale = 1.0 / (u.cwiseAbs().maxCoeff() * late.maxCoeff());
  left.add(c, 8.0, [&](Index k) { return -scale * u[k] * late[k]; });
  const std::vector<ResidualStructure> found = find_residual_structure(left.evidence, left.fit);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].channel, c);
  EXPECT_THAT(found[0].depends_on, Contains(HasSubstr("with a lag of")));
}

TEST(ResidualModel, ASpoolWithBacklashIsFoundThoughNoMeasuredSignalContainsIt) {
  Left left(26);
  const std::size_t c = left.channel(EvidenceKind::kFlow, 0);
  const VectorXd& u = left.evidence.series[0].cylinders[0].command;
  const double width = 0.1;
  VectorXd side = VectorXd::Zero(u.size());  // -1 .. 1: position inside the backlash
  double spool = 0.0;
  for (Index k = 0; k < u.size(); ++k) {
    spool = u[k] == 0.0 ? 0.0 : std::clamp(spool, u[k] - 0.5 * width, u[k] + 0.5 * width);
    side[k] = (u[k] - spool) / (0.5 * width);
  }
  left.add(c, 1.5, [&](Index k) { return -side[k]; });
  const std::vector<ResidualStructure> found = find_residual_structure(left.evidence, left.fit);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].channel, c);
  EXPECT_THAT(found[0].depends_on, Contains(HasSubstr("with a backlash of 10 %")));
}

TEST(ResidualModel, AnIsolatedEventIsFoundWithItsTime) {
  Left left(27);
  const std::size_t c = left.channel(EvidenceKind::kForce, 0);
  const EvidenceChannel& e = left.evidence.channels[c];
  const VectorXd& time = left.evidence.series[0].time;
  const double row_s = left.evidence.stride * left.evidence.series[0].step;
  std::size_t longest = 0;
  for (std::size_t b = 0; b < e.blocks.size(); ++b) {
    if (e.blocks[b].last - e.blocks[b].first > e.blocks[longest].last - e.blocks[longest].first)
      longest = b;
  }
  const double from = time[e.sample[static_cast<std::size_t>(e.blocks[longest].first)]];
  // The event of four seconds must lie within the stretch.
  ASSERT_GT(row_s * static_cast<double>(e.blocks[longest].last - e.blocks[longest].first), 4.0);
  // larger than the noise floor and than a thousandth of the largest force, below which nothing is reported
  const double noise = std::max(e.noise_floor, 2e-3 * e.largest_force) / e.unit.si;
  // eight times the usual residual, oscillating as with a swinging load, which depends on no signal
  const auto oscillating = [&](double seconds) {
    Left one = left;
    one.add(c, 8.0 * std::numbers::sqrt2 * noise, [&](Index k) {
      const double t = time[k] - from;
      return t > 0.0 && t < seconds ? std::sin(2.0 * std::numbers::pi * t / 1.3) : 0.0;
    });
    one.fit.residual[c] += (noise - 1.0) * left.fit.residual[c];
    return find_residual_structure(one.evidence, one.fit);
  };
  const std::vector<ResidualStructure> found = oscillating(4.0);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].channel, c);
  EXPECT_TRUE(found[0].event);
  EXPECT_THAT(found[0].depends_on, Contains(HasSubstr("times the usual residual from")));
  for (const ResidualStructure& l : oscillating(0.9)) EXPECT_FALSE(l.event) << "a short impact";
}

TEST(ResidualModel, AFunctionOfThePressureModelsInputsIsNoStructure) {
  // a pressure model learns smooth laws of its cylinder's own flow
  Left left(23, motions_with_pressures());
  int channels = 0;
  for (std::size_t c = 0; c < left.evidence.channels.size(); ++c) {
    const EvidenceChannel& e = left.evidence.channels[c];
    if (e.kind == EvidenceKind::kForce || e.kind == EvidenceKind::kFlow ||
        e.kind == EvidenceKind::kPump)
      continue;
    ++channels;
    for (std::size_t b = 0; b < e.blocks.size(); ++b) {
      const VectorXd& flow = left.evidence.series[static_cast<std::size_t>(e.log[b])]
                                 .cylinders[static_cast<std::size_t>(e.index)]
                                 .flow;
      for (Index i = e.blocks[b].first; i < e.blocks[b].last; ++i) {
        const double q = flow[e.sample[static_cast<std::size_t>(i)]];
        left.fit.residual[c][i] += 2.0 * e.unit.si * std::sqrt(q / flow.maxCoeff());
      }
    }
  }
  EXPECT_GE(channels, 4) << "of three cylinders, in both directions";
  for (const ResidualStructure& l : find_residual_structure(left.evidence, left.fit))
    ADD_FAILURE() << left.evidence.channels[l.channel].text << " depends on " << l.depends_on[0];
}

TEST(ResidualModel, ReferencesTakeNoPart) {
  // the same structure in rows of a reference log is not reported
  Left left(24);
  const std::size_t c = left.channel(EvidenceKind::kPump, 0);
  const VectorXd& time = left.evidence.series[0].time;
  left.add(c, 2.0, [&](Index k) { return std::sin(2.0 * std::numbers::pi * time[k]); });
  left.evidence.suspects = 0;
  EXPECT_THAT(find_residual_structure(left.evidence, left.fit), IsEmpty());
}

TEST(ResidualModel, NoSignalSharesItsSensorWithTheChannel) {
  const auto names = [](EvidenceKind kind, int index) {
    std::vector<std::string> all;
    for (const SignalColumn& s : channel_signals(motions(), *motions().find(kind, index)))
      all.push_back(s.name);
    return all;
  };
  const std::vector<std::string> force = names(EvidenceKind::kForce, 0),
                                 flow = names(EvidenceKind::kFlow, 0),
                                 pump = names(EvidenceKind::kPump, 0);
  EXPECT_THAT(force, testing::Not(Contains("pA_boom")));
  EXPECT_THAT(force, Contains("v_boom"));
  EXPECT_THAT(force, Contains("pA_jib"));
  EXPECT_THAT(flow, testing::Not(Contains("v_boom")));
  EXPECT_THAT(flow, Contains("pA_boom"));
  EXPECT_THAT(pump, testing::Not(Contains("pA_boom")));
  EXPECT_THAT(pump, testing::Not(Contains("p_main")));
  EXPECT_THAT(pump, Contains("q_boom"));
}

}  // namespace
}  // namespace sparflow
