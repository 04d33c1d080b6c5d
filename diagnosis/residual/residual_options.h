#pragma once
/// Thresholds of the search for unmodelled structure in the residual and for isolated events.
#include <array>
#include <cstddef>

namespace sparflow {

struct ResidualModelOptions {
  // --- when structure counts
  /// Share of the residual's variance, on motions left out, from which structure counts.
  /// @threshold [1] 0..1; chosen: a tenth of the squared error; without the structure the RMS would
  /// be a twentieth smaller.
  double least_share = 0.10;
  /// The same share for the driven model, that is for what acts against the motion or the opening.
  /// @threshold [1] 0..1; chosen: small irregularities of valves and seals have that form, too, so
  /// more is asked than of the flexible model.
  double least_share_driven = 0.3;
  /// RMS of the explained part over the standard deviation of the rest, from which structure
  /// counts.
  /// @threshold [1] 0..; chosen: about a third of the amplitude of what stays unexplained beside
  /// it, so that a small regular part of a large residual decides nothing.
  double least_size = 0.35;
  /// RMS of an event's largest second over that of the median second, from which an event counts.
  /// @threshold [1] 1..; tuned: in 30 logs with nothing hidden the largest second is at most 3.5
  /// times the usual one (docs/history/diagnosis.md).
  double least_event = 4.0;
  /// Autocorrelation of the fast part below which the residual oscillates.
  /// @threshold [1] -1..0; chosen: white noise and a step have no such minimum, an undamped sine
  /// has -1.
  double deepest_dip = -0.3;
  /// RMS of structure in a speed below which it is not reported, however regular.
  /// @threshold [m/s] 0..; chosen: 0.05 mm/s, half a thousandth of a usual speed (0.1 m/s); it only leaves out structure in
  /// logs whose noise is smaller still.
  double smallest_speed = 5e-5;
  /// RMS of structure in a pressure below which it is not reported, however regular.
  /// @threshold [Pa] 0..; chosen: 0.05 bar, an eighth of the error of usual sensors (0.1 % of 400 bar); it only leaves out
  /// structure in logs whose noise is smaller still.
  double smallest_pressure = 5e3;
  /// RMS of structure in a force below which it is not reported, as share of the largest static
  /// force.
  /// @threshold [1] 0..1; chosen: 0.1 % of the largest force, a fraction of the error to which a
  /// machine file has masses and areas.
  double smallest_force_share = 1e-3;
  /// Rows of suspect logs below which a channel is not searched.
  /// @threshold [rows] 1..; chosen: sixteen rows in each of five folds.
  int fewest_rows = 80;

  // --- the flexible and the driven model
  /// Number of folds of the cross-validation over blocks of motion.
  /// @threshold [1] 2..; chosen: each fit sees four fifths of the motions, as SearchOptions::folds.
  int folds = 5;
  /// Hat functions of one signal.
  /// @threshold [1] 2..; chosen: five intervals with about the same number of rows, enough for a
  /// law with one bend or one hump.
  int hats = 6;
  /// Quantile at which the first hat function stands, and from above the last.
  /// @threshold [1] 0..0.5; chosen: one row in a hundred at either end may be an outlier.
  double outermost_hat = 0.01;
  /// Random Fourier features of all signals together.
  /// @threshold [1] 0..; chosen: as many as the hat functions of ten signals, for products of
  /// signals.
  int fourier = 60;
  /// Draws by which a Fourier feature picks its signals.
  /// @threshold [1] 1..; chosen: a law of more than four signals is not looked for.
  int fourier_signals = 4;
  /// Standard deviation of a Fourier feature's frequency, for signals of unit variance.
  /// @threshold [1] 0..; chosen: a draw turns a feature by 0.7 radian over a standard deviation of
  /// its signal, so that the laws are smooth.
  double fourier_width = 0.7;
  /// Factor of the Fourier features beside the hat functions, which the ridge penalises equally.
  /// @threshold [1] 0..; chosen: a law of several signals needs twice the coefficients of a law of
  /// one, so the plainer law is preferred.
  double fourier_weight = 0.5;
  /// Strengths of the ridge that cross-validation chooses from, relative to the mean of the Gram
  /// matrix's diagonal.
  /// @threshold [1] 0..; chosen: steps of ten, as the best is chosen by the data.
  std::array<double, 3> ridge = {0.003, 0.03, 0.3};
  /// Ridge of the smooth function of flow and force that a pressure model would learn anyway.
  /// @threshold [1] 0..; numerical: keeps cells without rows solvable, relative to the mean of the
  /// Gram matrix's diagonal.
  double own_ridge = 1e-3;
  /// Share of the whole structure that a signal must explain alone to be named.
  /// @threshold [1] 0..1; chosen: a fifth; signals below it come along with a stronger one.
  double least_share_alone = 0.2;
  /// Share of the structure that a spectral line must hold for the structure to be called periodic.
  /// @threshold [1] 0..1; chosen: the larger part. "Periodic" names a frequency as the cause, which must explain more
  /// than all other signals together do.
  double least_line_share = 0.5;
  /// Time constants of lagged pump power among the signals. A first-order lag between them is
  /// nearly a linear combination of both.
  /// @threshold [s] 0..; chosen: engines, thermal valves and power controllers answer that late
  /// (docs/history/diagnosis.md).
  std::array<double, 2> power_lags = {0.3, 1.5};
  /// Widths of a backlash among the signals, as share of full command. A sticking spool or a worn
  /// lever follows the command with backlash; the residual then depends on the side from which the
  /// command came, which no measured signal contains.
  /// @threshold [1] 0..1; chosen: steps of two, up to a fifth of full command
  /// (docs/history/diagnosis.md).
  std::array<double, 3> backlashes = {0.05, 0.1, 0.2};
  /// Rows after which the time since a motion's start counts no further.
  /// @threshold [rows] 0..; chosen: about seven windows of the filter, of which a row is a third.
  double start_rows = 20.0;

  // --- oscillations of varying frequency
  /// Half width of the moving mean that is taken off: slower parts are no oscillation.
  /// @threshold [s] 0..; chosen: passes what is faster than a second.
  double oscillation_half_width = 0.5;
  /// Shortest lag at which a minimum of the autocorrelation counts, half a period.
  /// @threshold [s] 0..; chosen: 10 Hz, which is two and a half samples at 50 Hz; at half of it a minimum would rest on
  /// neighbouring samples alone.
  double shortest_lag = 0.05;
  /// Longest lag at which a minimum of the autocorrelation counts, half a period.
  /// @threshold [s] 0..; chosen: 0.7 Hz, near the slowest that the moving mean leaves.
  double longest_lag = 0.7;
  /// Length of a run below which it is not searched for oscillations, in half widths of the mean.
  /// @threshold [1] 2..; chosen: three quarters of such a run are clear of the mean's two ends.
  int shortest_run = 8;
  /// Samples below which neither a run nor a log is searched for oscillations.
  /// @threshold [samples] 1..; chosen: the autocorrelation of white noise then has a standard error
  /// of 0.07.
  int fewest_samples = 200;
  /// Robust standard deviations beyond which a value is a start or a stop and is left out.
  /// @threshold [1] 1..; chosen: starts and stops of motions are steps, not oscillations.
  double outlier = 5.0;
  /// Variance of the oscillation over that of white noise, below which it is no larger than the
  /// noise.
  /// @threshold [1] 0..; chosen: an RMS of 0.7 times that of the noise.
  double least_oscillation = 0.5;

  // --- spectral lines
  /// Power of a spectral line over the median of its surroundings, from which it is significant.
  /// @threshold [1] 1..; derived: for noise the power of a frequency has an exponential
  /// distribution, which exceeds that many medians with probability 2^-18; by chance once in a
  /// hundred channels of 2000 rows.
  double line_ratio = 18.0;
  /// Rows of suspect logs below which no spectral line is searched.
  /// @threshold [rows] 1..; chosen: enough for a median over the surroundings of a line.
  double fewest_rows_line = 100.0;
  /// Rows of one log below which it takes no part in the periodogram.
  /// @threshold [rows] 1..; chosen: half of what a channel needs, so that a short log adds no line
  /// of its own.
  std::size_t fewest_rows_of_log = 50;
  /// Highest frequency that is searched, in units of the sampling rate.
  /// @threshold [1] 0..0.5; chosen: somewhat below the Nyquist frequency, which is one half.
  double highest_frequency = 0.45;
  /// Frequencies that are searched, in units of one by the log's length.
  /// @threshold [1] 1..; derived: half the width of a line, so that no line falls between two
  /// frequencies.
  double oversampling = 2.0;
  /// Largest number of frequencies that are searched.
  /// @threshold [1] 1..; chosen: bounds the time for long logs.
  double most_frequencies = 4000.0;
  /// Frequencies on either side of a line that are at least its surroundings.
  /// @threshold [1] 1..; chosen: a median of forty values, which a line itself does not raise.
  int fewest_around = 20;
  /// Part of all frequencies that is at least the surroundings of a line on either side: one by
  /// this.
  /// @threshold [1] 1..; chosen: a twentieth of the spectrum in all, over which the power of noise
  /// is taken as equal.
  int surroundings = 40;
  /// Periods in all rows, below which a line is a slow drift that is left to the flexible model.
  /// @threshold [1] 1..; chosen: what repeats fewer than twenty times is not told from a slow
  /// dependence on signals.
  double fewest_periods = 20.0;

  // --- events
  /// Length of the pieces into which motions are cut to find an event.
  /// @threshold [s] 0..; chosen: longer than an impact, shorter than a motion.
  double event_length = 1.0;
  /// Such pieces below which the median means nothing and no event is searched.
  /// @threshold [1] 1..; chosen: the median of twenty normal values has a standard error of a
  /// quarter of their deviation.
  std::size_t fewest_seconds = 20;
  /// RMS of a neighbouring piece over that of the median piece, from which it belongs to the event.
  /// @threshold [1] 1..; chosen: half of what an event itself must reach.
  double event_beside = 2.0;
};

struct IsolatedEventOptions {
  /// Length of the windows in which an effect's reduction of the error is added up.
  /// @threshold [s] 0..; chosen: an event is placed to half a second. It is another question than
  /// ResidualModelOptions::event_length: that decides whether there is an event, with a threshold (least_event) that was
  /// tuned on pieces of one second; this only says from when to when a known one lasts.
  double window = 0.5;
  /// Share of the largest window's reduction from which a neighbouring window belongs to the event.
  /// @threshold [1] 0..1; chosen: a tenth of the squared error, a third of the amplitude.
  double beside = 0.1;
};

}  // namespace sparflow
