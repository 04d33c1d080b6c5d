/// Tests of the filter with closed forms: polynomials, known coefficients, known noise gains, gaps.
#include "identification/signals/smoothing.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

Eigen::VectorXd even_time(int n, double step, double start = 0.0) {
  return Eigen::VectorXd::LinSpaced(n, start, start + step * (n - 1));
}

Eigen::VectorXd uneven_time(int n, double step) {
  Eigen::VectorXd time(n);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> factor(0.3, 1.7);
  time[0] = 3.0;
  for (int i = 1; i < n; ++i) time[i] = time[i - 1] + step * factor(random);
  return time;
}

Eigen::VectorXd white_noise(Eigen::Index n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::VectorXd v(n);
  for (Eigen::Index i = 0; i < n; ++i) v[i] = normal(random);
  return v;
}

SavitzkyGolay filter(const Eigen::VectorXd& time, double window, int order = 3) {
  return {time, {{0, time.size()}}, window, order};
}

/// Polynomials up to the filter's order and their derivatives are reproduced exactly, also at the ends.
void expect_polynomials_exact(const Eigen::VectorXd& time, int order) {
  const double middle = time[time.size() / 2];
  const Eigen::ArrayXd s = time.array() - middle;
  const SavitzkyGolay sg = filter(time, 0.25, order);
  for (int degree = 0; degree <= order; ++degree) {
    const Eigen::VectorXd p = 5.0 + s.pow(degree);
    const Smoothed out = sg.smooth(p);
    const Eigen::VectorXd slope =
        degree >= 1 ? Eigen::VectorXd(degree * s.pow(degree - 1)) : Eigen::VectorXd::Zero(s.size());
    const Eigen::VectorXd curvature =
        degree >= 2 ? Eigen::VectorXd(degree * (degree - 1) * s.pow(degree - 2))
                    : Eigen::VectorXd::Zero(s.size());
    const double size = p.cwiseAbs().maxCoeff();
    // Rounding of the samples (1e-16 of their size) grows by 1/step for each derivative (step 0.02 s).
    EXPECT_LT((out.value - p).cwiseAbs().maxCoeff(), 1e-13 * size) << degree;
    EXPECT_LT((out.first - slope).cwiseAbs().maxCoeff(), 1e-11 * size) << degree;
    if (order >= 2) {
      EXPECT_LT((out.second - curvature).cwiseAbs().maxCoeff(), 1e-9 * size) << degree;
    }
  }
}

TEST(SavitzkyGolay, PolynomialsAreExactOnEvenSampling) {
  for (const int order : {1, 2, 3, 4}) expect_polynomials_exact(even_time(80, 0.02), order);
}

TEST(SavitzkyGolay, PolynomialsAreExactOnUnevenSampling) {
  for (const int order : {1, 2, 3, 4}) expect_polynomials_exact(uneven_time(80, 0.02), order);
}

TEST(SavitzkyGolay, CoefficientsAreThoseOfTheOriginalTables) {
  // Savitzky & Golay (1964), tables I and IV: cubic smoothing over 5 points, cubic first derivative over 7.
  const Eigen::VectorXd time = even_time(41, 1.0);
  Eigen::VectorXd pulse = Eigen::VectorXd::Zero(41);
  pulse[20] = 1.0;
  const Eigen::VectorXd smooth = filter(time, 4.0).apply(pulse, 0);
  const double five[] = {-3, 12, 17, 12, -3};
  // Rounding of coefficients below one.
  for (int k = -2; k <= 2; ++k) EXPECT_NEAR(smooth[20 - k], five[k + 2] / 35.0, 1e-15);
  EXPECT_NEAR(smooth[17], 0.0, 1e-15);
  const Eigen::VectorXd slope = filter(time, 6.0).apply(pulse, 1);
  const double seven[] = {22, -67, -58, 0, 58, 67, -22};
  for (int k = -3; k <= 3; ++k) EXPECT_NEAR(slope[20 - k], seven[k + 3] / 252.0, 1e-15);
}

TEST(SavitzkyGolay, EvenAndUnevenPathsAgree) {
  // The same samples; a shift of 0.2 % of a step in one of them sends the run down the uneven path.
  const Eigen::VectorXd time = even_time(200, 0.02);
  Eigen::VectorXd shifted = time;
  shifted[100] += 4e-5;
  const Eigen::VectorXd v = white_noise(200, 3);
  const Smoothed even = filter(time, 0.2).smooth(v), uneven = filter(shifted, 0.2).smooth(v);
  const auto away = [&](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    return std::max((a - b).head(90).cwiseAbs().maxCoeff(), (a - b).tail(90).cwiseAbs().maxCoeff());
  };
  // Rounding, larger by 1/0.02 s = 50 for each derivative.
  EXPECT_LT(away(even.value, uneven.value), 1e-12);
  EXPECT_LT(away(even.first, uneven.first), 1e-10);
  EXPECT_LT(away(even.second, uneven.second), 1e-8);
}

TEST(SavitzkyGolay, NoiseGainIsThatOfTheClosedForm) {
  const int n = 40000;
  const Eigen::VectorXd time = even_time(n, 0.02);
  const SavitzkyGolay sg = filter(time, 0.24, 2);  // 13 points
  // Quadratic: sum of squares is (3/4)(3 m^2 + 3 m - 1) / ... = closed forms for m = 6:
  // slope 1 / sum k^2 = 1/182, per step.
  EXPECT_NEAR(sg.noise_gain(1), std::sqrt(1.0 / 182.0) / 0.02, 1e-9);
  const Smoothed out = sg.smooth(white_noise(n, 11));
  // A standard deviation from n / 13 independent values is good to 1/sqrt(2 n/13) = 1.3 %: five sigma.
  const auto deviation = [&](const Eigen::VectorXd& v) { return std::sqrt(v.squaredNorm() / n); };
  EXPECT_NEAR(deviation(out.value) / sg.noise_gain(0), 1.0, 0.065);
  EXPECT_NEAR(deviation(out.first) / sg.noise_gain(1), 1.0, 0.065);
  EXPECT_NEAR(deviation(out.second) / sg.noise_gain(2), 1.0, 0.065);
}

TEST(SavitzkyGolay, WindowsDoNotReachAcrossAGap) {
  Eigen::VectorXd time(200);
  time << even_time(100, 0.02), even_time(100, 0.02, 10.0);
  Eigen::VectorXd v(200);
  v << 2.0 * time.head(100), 1000.0 - 3.0 * time.tail(100).array();
  const SavitzkyGolay sg(time, {{0, 100}, {100, 200}}, 0.25);
  const Eigen::VectorXd slope = sg.apply(v, 1);
  // Rounding of values up to 1000, divided by steps of 0.02 s.
  EXPECT_LT((slope.head(100).array() - 2.0).abs().maxCoeff(), 1e-9);
  EXPECT_LT((slope.tail(100).array() + 3.0).abs().maxCoeff(), 1e-9);
}

TEST(SavitzkyGolay, AHoleActsAsAGapOfItsChannel) {
  const Eigen::VectorXd time = even_time(100, 0.02);
  Eigen::VectorXd v = 2.0 * time;
  v.tail(40).array() += 7.0;
  v.segment(55, 5).setConstant(NAN);  // the jump lies in the hole
  v[2] = NAN;                         // two samples before it are too few for a cubic
  const Smoothed out = filter(time, 0.25).smooth(v);
  for (int i = 0; i < 100; ++i) {
    const bool known = i >= 3 && !(i >= 55 && i < 60);
    EXPECT_EQ(std::isfinite(out.first[i]), known) << i;
    if (known) {
      EXPECT_NEAR(out.first[i], 2.0, 1e-9) << i;
    }
  }
}

TEST(SavitzkyGolay, ShortStretchesAndCoarseSamplingAreAccepted) {
  const Eigen::VectorXd four = even_time(4, 0.02);
  EXPECT_NEAR(filter(four, 0.25).apply(four, 1)[0], 1.0, 1e-12);
  EXPECT_TRUE(std::isnan(filter(four.head(3), 0.25).apply(four.head(3), 1)[0]));
  // 5 Hz: a window of 0.25 s would hold one sample; it is widened.
  const Eigen::VectorXd coarse = even_time(30, 0.2);
  EXPECT_NEAR(filter(coarse, 0.25).apply(coarse.array().square(), 2)[12], 2.0, 1e-9);
}

TEST(SavitzkyGolay, OneSampleGivesNaNAndNoSampleNothing) {
  const Eigen::VectorXd one = Eigen::VectorXd::Zero(1);
  EXPECT_TRUE(std::isnan(SavitzkyGolay(one, {{0, 1}}, 0.25).apply(one, 0)[0]));
  EXPECT_EQ(SavitzkyGolay(Eigen::VectorXd(), {}, 0.25).apply(Eigen::VectorXd(), 1).size(), 0);
}

TEST(ChooseWindow, GrowsWithTheNoise) {
  const Eigen::VectorXd time = even_time(3000, 0.02);
  const Eigen::VectorXd motion = (time.array() * 8.0).sin() * 0.3;  // 1.3 Hz
  const auto chosen = [&](double noise) {
    return choose_window(time, {{0, 3000}}, motion + noise * white_noise(3000, 5));
  };
  const double quiet = chosen(1e-6), usual = chosen(3e-4), loud = chosen(1e-2);
  EXPECT_LE(quiet, usual);
  EXPECT_LE(usual, loud);
  EXPECT_LT(quiet, loud);
  // The grid of windows at 50 Hz is 0.2 to 0.4 s (smoothing.h), to half a step of 0.02 s; so it is below.
  EXPECT_GE(quiet, 0.2);
  EXPECT_LE(loud, 0.42);
}

TEST(ChooseWindow, IsCloseToTheOptimum) {
  // The velocity is known here: the error by the chosen window against the smallest of a fine grid.
  const Eigen::VectorXd time = even_time(3000, 0.02);
  const Eigen::ArrayXd t = time.array();
  const Eigen::VectorXd motion = 0.1 * (3.0 * t).sin() + 0.05 * (7.0 * t).cos();
  const Eigen::VectorXd speed = 0.3 * (3.0 * t).cos() - 0.35 * (7.0 * t).sin();
  const Eigen::VectorXd measured = motion + 2e-4 * white_noise(3000, 9);
  const auto error = [&](double window) {
    return (filter(time, window).apply(measured, 1) - speed).norm();
  };
  double best = INFINITY;
  for (double w = 0.1; w <= 0.7; w += 0.02) best = std::min(best, error(w));
  // The grid's ratio is 1.2 and the error is flat around its minimum.
  EXPECT_LT(error(choose_window(time, {{0, 3000}}, measured)), 1.15 * best);
}

TEST(ChooseWindow, HasADefaultWithoutMotion) {
  const Eigen::VectorXd time = even_time(100, 0.02);
  EXPECT_DOUBLE_EQ(choose_window(time, {{0, 100}}, Eigen::MatrixXd(100, 0)), 0.25);
  EXPECT_DOUBLE_EQ(choose_window(time, {{0, 100}}, Eigen::MatrixXd::Constant(100, 2, 3.0)), 0.25);
  EXPECT_DOUBLE_EQ(choose_window(time, {{0, 100}}, Eigen::MatrixXd::Constant(100, 1, NAN)), 0.25);
}

TEST(MakeFilter, RealAndSimulatedLogsGetAUsualWindow) {
  const std::string simulated = test::shared_file("loader_crane/plain/train.csv");
  if (!std::filesystem::exists(simulated)) GTEST_SKIP() << "the shared logs are not here";
  const Log log = load_log(simulated, test::loader_crane());
  const double window = make_filter(log).window();
  EXPECT_GE(window, 0.2);
  EXPECT_LE(window, 0.42);
  RecordProperty("window_loader_crane", std::to_string(window));
  EXPECT_DOUBLE_EQ(make_filter(log, {.window_s = 0.3, .order = 2}).window(), 0.3);
}

TEST(SharpestWindow, NoiseIsAThousandthOfTheAcceleration) {
  const Eigen::VectorXd time = even_time(8000, 1e-3);
  const double w = 2.0 * M_PI * 0.7, amplitude = 0.1;
  const Eigen::VectorXd clean = amplitude * (w * time).array().sin();
  const double acceleration = amplitude * w * w / std::sqrt(2.0);  // RMS
  int at_the_limit = 0;
  for (const double sigma : {1e-7, 3e-6, 2e-5}) {
    const Eigen::VectorXd x = clean + sigma * white_noise(8000, 4);
    const double window = sharpest_window(time, {{0, 8000}}, x, 0.4);
    const auto share = [&](double width) {
      return std::pow(sigma * filter(time, width).noise_gain(2) / acceleration, 2);
    };
    // the noise's size is itself estimated, to some 2 %
    EXPECT_LT(share(window), 1.1e-3) << sigma;
    if (window > 0.0101) {
      ++at_the_limit;
      EXPECT_GT(share(window / 1.2), 0.9e-3) << sigma;
    }
  }
  EXPECT_GE(at_the_limit, 2) << "only the least noise allows the shortest window";
  const Eigen::VectorXd rough = clean + 5e-3 * white_noise(8000, 4);
  EXPECT_DOUBLE_EQ(sharpest_window(time, {{0, 8000}}, rough, 0.2), 0.2);
}

/// A motion that starts, continues steadily and stops: noise in the steady part makes an estimated inertia too small.
TEST(QuietenAcceleration, KeepsStartsAndStopsAndReducesTheNoiseBetween) {
  constexpr int kSamples = 600;
  constexpr double kRow = 0.02, kDigits = 4.5e-4, kRamp = 0.4, kSpeed = 0.1;
  Eigen::VectorXd time(kSamples), smooth(kSamples), q(kSamples);
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  double speed = 0.0, position = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    time[i] = kRow * i;
    const bool starts = time[i] >= 2.0 && time[i] < 2.0 + kRamp - 1e-9;
    const bool stops = time[i] >= 9.0 && time[i] < 9.0 + kRamp - 1e-9;
    const double acceleration = (starts ? 1.0 : stops ? -1.0 : 0.0) * kSpeed / kRamp;
    position += kRow * speed + 0.5 * kRow * kRow * acceleration;
    speed += kRow * acceleration;
    smooth[i] = position;
    q[i] = position + kDigits * normal(random);
  }
  const std::vector<SampleRange> runs = {{0, kSamples}};
  const SavitzkyGolay filter(time, runs, 0.24);
  const Eigen::VectorXd narrow = filter.apply(q, 2), truth = filter.apply(smooth, 2);
  Eigen::VectorXd quiet = narrow;
  quieten_acceleration(time, runs, q, filter, quiet);
  const auto rms = [](const auto& v) {
    return std::sqrt(v.squaredNorm() / static_cast<double>(v.size()));
  };
  // Three times the window reduces the noise by 3^2.5, about fifteen; a tenth allows for windows that differ by chance.
  EXPECT_LT(rms(quiet.segment(200, 200)), 0.1 * rms(narrow.segment(200, 200)));
  // An inertia is estimated by this scale of the acceleration against the truth after the same filter.
  const auto scale = [&](const Eigen::VectorXd& a) { return a.dot(truth) / a.squaredNorm(); };
  EXPECT_LT(scale(narrow), 0.75);
  EXPECT_NEAR(scale(quiet), 1.0, 0.12);
  // Without noise all windows agree, or the narrow one is kept.
  Eigen::VectorXd clean(kSamples);
  for (int i = 0; i < kSamples; ++i) clean[i] = std::sin(2.0 * time[i]);
  const Eigen::VectorXd before = filter.apply(clean, 2);
  Eigen::VectorXd after = before;
  quieten_acceleration(time, runs, clean, filter, after);
  // A sine of 0.3 Hz is reproduced by any of the windows to better than a thousandth.
  EXPECT_LT((after - before).cwiseAbs().maxCoeff(), 1e-3 * before.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace sparflow
