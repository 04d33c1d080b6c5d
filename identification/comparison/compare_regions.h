#pragma once
/// Finds where a model is worst: the region of one or two signals that holds the most error for the fewest samples.
/// Deterministic.
///
/// A region's score is the likelihood ratio of M. Kulldorff, "A spatial scan statistic", Commun. Statist.
/// 26 (1997), with squared error in place of counts: with E the region's share of the squared error and S its
/// share of the samples, score = E ln(E/S) + (1-E) ln((1-E)/(1-S)), nats. It is zero when the error is
/// spread evenly, and prefers neither tiny regions nor large ones. All intervals between the
/// quantiles of each signal, and all rectangles of two signals, are tried.
#include <Eigen/Dense>
#include <functional>
#include <string>
#include <vector>

namespace sparflow {

/// A signal on which the error may depend. A sample with NaN lies in none of its intervals.
struct RegimeSignal {
  std::string key;         ///< for scripts, with its unit: "q_boom_deg"
  std::string words;       ///< for sentences: "boom angle"
  std::string unit;        ///< for display: "deg"; "" for pure numbers
  double scale = 1.0;      ///< SI value of one `unit`
  Eigen::VectorXd values;  ///< SI
};

/// The samples of one regime: a cylinder in one direction, a pump with one load-sensing leader.
struct ErrorGroup {
  std::string stage, at;
  std::string regime;      ///< "extend", "retract", a load-sensing leader, "standby"
  std::string words;       ///< "boom retracting"
  std::string pool;        ///< shares are taken among the groups of one pool
  std::string pool_words;  ///< "the pressure error"
  std::string unit;
  double scale = 1.0;                 ///< SI value of one `unit`
  double severity = 1.0;              ///< unexplained share of the pool, to order different units
  Eigen::VectorXd squared_error;      ///< [samples] SI squared
  std::vector<RegimeSignal> signals;  ///< as long as squared_error
};

struct RegionBound {
  std::string key, words, unit;
  double lo = 0.0, hi = 0.0;  ///< in `unit`
};

struct WorstRegion {
  std::string stage, at, regime;
  std::vector<RegionBound> where;  ///< empty = the whole regime
  double rmse = 0.0;               ///< in `unit`
  std::string unit;
  double share_of_error = 0.0;    ///< of the pool's squared error, 0..1
  double share_of_samples = 0.0;  ///< of the pool's samples, 0..1
  double score = 0.0;             ///< [nat]
  /// "boom retracting with boom angle 12..35 deg: 41 % of the pressure error in 9 % of the samples (RMSE
  /// 4.2 bar)"
  std::string sentence;
};

struct RegionOptions {
  /// Number of quantiles of each signal between which intervals are tried.
  /// @threshold [1] 3..50; chosen: resolution of a tenth of the samples
  int bins = 10;
  /// Least share of the pool's samples in a region.
  /// @threshold [1] 0..0.5; chosen: a smaller region is a single motion, which worst_segments finds
  double least_share = 0.02;
  /// Pools of which a smaller share is unexplained are not searched.
  /// @threshold [1] 0..0.5; chosen: such a model is good everywhere
  double least_severity = 0.02;
  /// Least share of the pool's squared error in a region.
  /// @threshold [1] 0..1; chosen: with less, removing the region's error would hardly help
  double least_error = 0.10;
  /// Least RMSE of a region over the pool's: it holds twice its share of the squared error.
  /// @threshold [1] 1.3..5; derived: pure noise stays below 1.3 in the smallest region of a log of
  /// 10 000 samples, all regions tried
  double contrast = 1.41;
  /// Largest number of signals that are tried in pairs; of more, those with the best intervals of their own.
  /// @threshold [signals] 10..100; chosen: pose, speeds, loads and a dozen columns; of hundreds of further columns the
  /// pairs, which grow with the square, would take minutes
  std::size_t paired = 24;
  /// Factor by which a further signal must raise the score.
  /// @threshold [1] 1..3; chosen: keeps descriptions short
  double gain_per_signal = 1.25;
  /// Largest number of regions reported.
  /// @threshold [regions] 1..100; chosen: as many as a screen shows and a reader compares
  int most = 6;
};

/// Groups that are gathered when they are needed: all of them together take several times the memory of the logs.
struct ErrorGroups {
  std::size_t count = 0;
  /// @param with_signals false: a group without its signals is asked for
  std::function<ErrorGroup(std::size_t index, bool with_signals)> gather;
};

/// The regions of groups that are gathered one at a time.
std::vector<WorstRegion> worst_regions(const ErrorGroups& groups, const RegionOptions& options);

/// @return at most one region for each group, the worst first; none where the error is spread evenly
std::vector<WorstRegion> worst_regions(const std::vector<ErrorGroup>& groups,
                                       const RegionOptions& options = {});

}  // namespace sparflow
