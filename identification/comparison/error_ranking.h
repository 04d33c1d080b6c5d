#pragma once
/// The one ranking of a comparison's errors. Headline, stage at fault, tiles, colours, terminal and JSON are read from it and
/// decide nothing themselves, so that they cannot contradict each other. docs/pages.md describes it.
///
/// The unexplained share of a quantity is its RMS error beyond the sensor's noise over its scale: the standard deviation of
/// the measured values, or a third of their RMS where they vary less than that (the pressure of a constant supply). The
/// share decides the grade, and the grade the colour. The worst grade comes first; of one grade, errors that arise in
/// their own stage come before those that are mostly inherited from the stage before, and then larger shares before smaller
/// ones.
#include <string>
#include <vector>

namespace sparflow {

struct CompareResult;
struct Machine;
struct StageScore;

enum class Grade { kGood, kFair, kPoor };
const char* grade_word(Grade grade);  ///< "good", "fair", "poor"

struct RankingOptions {
  /// Largest unexplained share that is good.
  /// @threshold [1] 0..1; chosen: a fit of 85 % or an error of 5 % of the level
  double good_share = 0.15;
  /// Smallest unexplained share that is poor.
  /// @threshold [1] 0..1; chosen: a fit of less than a half, or an error of a sixth of the level
  double poor_share = 0.5;
  /// Least scale of a quantity, as a share of the RMS of its measured values.
  /// @threshold [1] 0..1; chosen: an error of five percent of a nearly constant pressure is good whatever little it varies
  double level_share = 1.0 / 3.0;
  /// Scale of an energy, as a share of the measured energy.
  /// @threshold [1] 0..1; chosen: 1.5 % of the energy is good and 5 % poor
  double energy_share = 0.1;
  /// Least unexplained share of the worst quantity for its cause to be named as the stage at fault.
  /// @threshold [1] 0..0.5; chosen: smaller errors hardly affect the energy
  double least_share_at_fault = 0.05;
};

/// One quantity with its error, or the energy of a pump. SI.
struct RankedError {
  std::string stage, at, regime;  ///< as in StageScore; energy of a pump: stage "energy"
  std::string words;              ///< "working pressure of boom extending"
  std::string amount;             ///< "20.3 kN RMS"; of an energy "-3.1 %"
  double error = 0.0;             ///< RMS error; of an energy predicted - measured [J]
  double noise = 0.0;             ///< standard deviation of the sensor's noise; NaN = not known
  double scale = 0.0;             ///< what the error is compared with
  double unexplained = 0.0;       ///< unexplained share, 0 = none
  Grade grade = Grade::kGood;
  /// Index of the quantity from which most of the error is inherited; -1 = it arises here.
  int source = -1;

  /// What is not unexplained, at least 0. [%]
  double explained_percent() const;
};

struct ErrorRanking {
  std::vector<RankedError> errors;  ///< worst first
  std::string headline;             ///< one sentence without full stop
  RankingOptions options;           ///< by which it was made

  bool empty() const { return errors.empty(); }
  Grade grade() const { return empty() ? Grade::kGood : errors.front().grade; }
  /// The quantity where the worst error arises: the first, or its source. nullptr when there is none.
  const RankedError* cause() const;
  /// The same, where its error is large enough for its stage to be at fault.
  const RankedError* at_fault() const;
  const RankedError* find(const std::string& stage, const std::string& at,
                          const std::string& regime = "") const;
  /// The worst of each stage, in the order of the ranking.
  std::vector<const RankedError*> worst_of_stages() const;
  /// Place in the ranking, 0 = worst; a regime "" stands for the worst regime. Behind all when it is not ranked.
  std::size_t place(const std::string& stage, const std::string& at,
                    const std::string& regime) const;
};

/// @param result its scores, energies, logs and split errors (StageAtFault::stages) count
ErrorRanking rank_errors(const Machine& machine, const CompareResult& result,
                         const RankingOptions& options = {});

/// Standard deviation of the sensor's noise in one quantity, from measured minus smoothed signal, SI; NaN where it is not
/// known, as of speeds.
double sensor_noise(const Machine& machine, const CompareResult& result, const StageScore& score);

/// "working pressure of boom extending"
std::string quantity_name(const std::string& stage, const std::string& at,
                          const std::string& regime);

}  // namespace sparflow
