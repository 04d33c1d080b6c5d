#pragma once
/// Fit of a valve section to a log: rod speed against command by ordinary least squares. It scales the columns of the
/// flow effects, so that their parameters are dimensionless or times.
#include <cstddef>
#include <functional>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "models/effects/series.h"

namespace sparflow {

/// speed = gain max(0, |u| - dead_band) sign(u), for each direction.
struct SectionFit {
  double gain_extend = 0.0, gain_retract = 0.0;            ///< [m/s] per unit of command
  double dead_band_extend = 0.0, dead_band_retract = 0.0;  ///< [-]
  double gain(double command) const { return command > 0.0 ? gain_extend : gain_retract; }
  double dead_band(double command) const {
    return command > 0.0 ? dead_band_extend : dead_band_retract;
  }
};

/// The valve sections of several logs. A valve has one gain whatever the log; fitted to each log by itself it takes up what else slows
/// the rods there (a pump without flow left), and the sizes of an effect, whose columns it scales, would differ from log to log.
/// Columns are computed for each log twice: the first time the fits keep their samples here, the second time they use those of all logs.
class SectionPool {
 public:
  /// |u| [-], share of the flow that passes [-] and the rod speed in the commanded direction [m/s], for one direction.
  struct Samples {
    std::vector<double> command, share, speed;
  };
  void begin(std::size_t log) { log_ = log; }
  void complete();
  /// No effect fits a section of these.
  bool empty() const { return samples_.empty(); }
  /// Keeps the samples of the present log in place of former ones, or, once complete, returns those of all logs.
  const Samples& together(int cylinder, int side, Samples samples);
  /// Where the dead band of these samples ends, by `search`; once complete it is searched for once. [-]
  double dead_band(int cylinder, int side, const std::function<double()>& search);

 private:
  std::map<std::tuple<int, int, std::size_t>, Samples> samples_;  // by cylinder, side, log
  std::map<std::pair<int, int>, Samples> all_;                    // by cylinder, side
  std::map<std::pair<int, int>, double> bands_;                   // the same
  std::size_t log_ = 0;
  bool complete_ = false;
};

/// Fits the gains alone: least squares of the measured speed on `command`, for each sign. A direction with too few
/// samples gets the gain of the machine file's full flow, 0 if it has none.
/// @param command [samples, -] the logged command, or the delayed one where the flow follows that
/// @param pool of several logs; null: of this one alone
SectionFit fit_gains(const MachineSeries& log, int cylinder, const Eigen::VectorXd& command,
                     SectionPool* pool = nullptr);

/// What the rod speed changes by when the valve's opening acts late. The gains are those of the late opening; those of the opening
/// itself would be biased towards zero.
/// @param opening [samples, -]  @param late delays or filters a series  @return [samples, m/s]
Eigen::VectorXd late_flow(const MachineSeries& log, int cylinder, const Eigen::VectorXd& opening,
                          const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& late,
                          SectionPool* pool = nullptr);

/// Fits gains and dead bands: the dead band has the smallest sum of squares, by grid search and golden section.
SectionFit fit_dead_bands(const MachineSeries& log, int cylinder, SectionPool* pool = nullptr);

}  // namespace sparflow
