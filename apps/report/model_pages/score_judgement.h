#pragma once
/// What a score is worth in words and colours.
#include "apps/report/page/page.h"
#include "identification/comparison/compare.h"

namespace sparflow {

/// One score beside what no model could do better than.
struct JudgedScore {
  StageScore score;
  /// Standard deviation of the sensor's noise, from the measured minus its smoothed self (1.4826 times the median
  /// of the magnitude, on compared samples). SI; NaN where it is not known, as of speeds.
  double noise = 0.0;
  double fit_beyond_noise =
      0.0;  ///< [%] the fit with the noise taken out of the error; NaN if nothing varies
  Tone tone = Tone::kNeutral;  ///< kGood, kWarning or kBad, by kJudgementRule
};

extern const char* const kJudgementRule;  ///< for the reader, whole sentences

/// All scores in the order of the result.
std::vector<JudgedScore> judge_scores(const Machine& machine, const CompareResult& result);
Tone judge_energy(const EnergyScore& energy);
const char* tone_word(Tone tone);  ///< "good", "fair", "poor"

/// The one that needs attention most: by tone, then the earlier stage (its error is carried on to the later),
/// then by what of the variation it leaves unexplained beyond noise. nullptr when there is none.
const JudgedScore* worst_score(const std::vector<JudgedScore>& scores);
/// The worst of each stage, in the order of the stages.
std::vector<JudgedScore> worst_of_stages(const std::vector<JudgedScore>& scores);

}  // namespace sparflow
