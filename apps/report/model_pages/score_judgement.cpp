#include "apps/report/model_pages/score_judgement.h"

#include <algorithm>
#include <cmath>

#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
constexpr double kGoodFit = 85.0, kPoorFit = 50.0;            // [%]
constexpr double kGoodRelative = 0.05, kPoorRelative = 0.15;  // error over RMS of the measured
constexpr double kGoodEnergy = 0.02, kPoorEnergy = 0.05;      // relative error
/// [-] The smoothed signal keeps a part of the noise, so that the noise is estimated a little too low.
constexpr double kNoiseAllowance = 1.1;

/// Measured minus smoothed signal; empty where the log or the stage has none.
Eigen::VectorXd roughness(const Machine& machine, const MachineSignals& signals,
                          const ComparedSeries& series) {
  if (series.stage == "pump") {
    const auto p = static_cast<std::size_t>(machine.pump_index(series.at));
    return signals.pumps[p].pressure - signals.pumps[p].pressure_smooth;
  }
  const auto i = static_cast<std::size_t>(machine.cylinder_index(series.at));
  const CylinderSignals& c = signals.cylinders[i];
  if (series.stage == "force") return c.force - c.force_smooth;
  if (series.stage == "pressure") return c.working_pressure - c.working_pressure_smooth;
  return {};
}

struct Measured {
  double rms = kNaN, noise = kNaN;
};

Measured describe(const Machine& machine, const CompareResult& result, const StageScore& score) {
  double squares = 0.0;
  long n = 0;
  std::vector<double> rough;
  for (const LogComparison& log : result.logs) {
    for (const ComparedSeries& s : log.series) {
      if (s.stage != score.stage || s.at != score.at) continue;
      const Eigen::VectorXd difference = roughness(machine, log.signals, s);
      for (Index k = 0; k < s.measured.size(); ++k) {
        if (!std::isfinite(s.measured[k])) continue;
        if (!score.regime.empty() &&
            s.regimes[static_cast<std::size_t>(s.regime[k])] != score.regime) {
          continue;
        }
        squares += s.measured[k] * s.measured[k];
        ++n;
        if (difference.size() > 0 && std::isfinite(difference[k]))
          rough.push_back(std::abs(difference[k]));
      }
    }
  }
  Measured out;
  if (n > 0) out.rms = std::sqrt(squares / static_cast<double>(n));
  if (rough.size() >= 20) {
    const auto middle = rough.begin() + static_cast<std::ptrdiff_t>(rough.size() / 2);
    std::nth_element(rough.begin(), middle, rough.end());
    out.noise = 1.4826 * *middle;
  }
  return out;
}

/// Whether a is worse than b, for scores in the order of the stages. Of two stages with the same judgement the earlier
/// is the worse, because an error in the force causes one in the pressure.
bool worse(const JudgedScore& a, const JudgedScore& b) {
  if (a.tone != b.tone) return static_cast<int>(a.tone) > static_cast<int>(b.tone);
  if (a.score.stage != b.score.stage) return false;
  const auto open = [](const JudgedScore& s) {
    return std::isfinite(s.fit_beyond_noise) ? 100.0 - s.fit_beyond_noise : 0.0;
  };
  return open(a) > open(b);
}

}  // namespace

const char* const kJudgementRule =
    "Good: with the sensor's noise taken out of the error, a fit of at least 85 % or an error of "
    "at most 5 % of the "
    "measured RMS. Poor: a fit below 50 % and an error of more than 15 %. Fair: between.";

std::vector<JudgedScore> judge_scores(const Machine& machine, const CompareResult& result) {
  std::vector<JudgedScore> out;
  for (const StageScore& score : result.scores) {
    const Measured measured = describe(machine, result, score);
    JudgedScore j;
    j.score = score;
    j.noise = measured.noise;
    const double noise = std::isfinite(measured.noise) ? kNoiseAllowance * measured.noise : 0.0;
    const double beyond = std::sqrt(std::max(0.0, score.rmse * score.rmse - noise * noise));
    const double spread = score.rmse / (1.0 - score.fit_percent / 100.0);
    j.fit_beyond_noise = 100.0 * (1.0 - beyond / spread);
    if (score.rmse == 0.0) j.fit_beyond_noise = 100.0;
    const double relative = beyond / measured.rms;
    if (j.fit_beyond_noise >= kGoodFit || relative <= kGoodRelative || score.rmse == 0.0) {
      j.tone = Tone::kGood;
    } else if (!(j.fit_beyond_noise >= kPoorFit) && relative > kPoorRelative) {
      j.tone = Tone::kBad;
    } else {
      j.tone = Tone::kWarning;
    }
    out.push_back(std::move(j));
  }
  return out;
}

Tone judge_energy(const EnergyScore& energy) {
  const double error = std::abs(energy.relative_error);
  if (!std::isfinite(error)) return Tone::kNeutral;
  if (error <= kGoodEnergy) return Tone::kGood;
  return error <= kPoorEnergy ? Tone::kWarning : Tone::kBad;
}

const char* tone_word(Tone tone) {
  return tone == Tone::kGood ? "good" : tone == Tone::kBad ? "poor" : "fair";
}

const JudgedScore* worst_score(const std::vector<JudgedScore>& scores) {
  const JudgedScore* worst = nullptr;
  for (const JudgedScore& s : scores) {
    if (worst == nullptr || worse(s, *worst)) worst = &s;
  }
  return worst;
}

std::vector<JudgedScore> worst_of_stages(const std::vector<JudgedScore>& scores) {
  std::vector<JudgedScore> out;
  for (const JudgedScore& s : scores) {
    const auto at = std::find_if(out.begin(), out.end(), [&](const JudgedScore& o) {
      return o.score.stage == s.score.stage;
    });
    if (at == out.end()) {
      out.push_back(s);
    } else if (worse(s, *at)) {
      *at = s;
    }
  }
  return out;
}

}  // namespace sparflow
