#pragma once
/// Judges scores as good, fair or poor.
#include "apps/report/page/page.h"
#include "identification/comparison/compare.h"

namespace sparflow {

/// One score beside the noise of its sensor, below which no model can get.
struct JudgedScore {
  StageScore score;
  /// Standard deviation of the sensor's noise, from the measured minus its smoothed self (1.4826 times the median
  /// of the magnitude, on compared samples). SI; NaN where it is not known, as of speeds.
  double noise = 0.0;
  /// [%] fit with the noise's variance subtracted from the squared error; NaN when the quantity does not vary
  double fit_beyond_noise = 0.0;
  Tone tone = Tone::kNeutral;  ///< kGood, kWarning or kBad, by kJudgementRule
};

extern const char* const kJudgementRule;  ///< whole sentences for the reader of a page

/// All scores in the order of the result.
std::vector<JudgedScore> judge_scores(const Machine& machine, const CompareResult& result);
Tone judge_energy(const EnergyScore& energy);
const char* tone_word(Tone tone);  ///< "good", "fair", "poor"

/// Returns the worst score: by tone, then the earlier stage (its error propagates to the later ones), then by the share
/// of the variation that it leaves unexplained beyond noise. nullptr when there is none.
const JudgedScore* worst_score(const std::vector<JudgedScore>& scores);
/// Returns the worst score of each stage, in the order of the stages.
std::vector<JudgedScore> worst_of_stages(const std::vector<JudgedScore>& scores);

}  // namespace sparflow
