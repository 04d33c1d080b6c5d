#pragma once
/// Thresholds of the evidence: which samples form a channel, which branch of a valve law holds in them, what its noise
/// model may contain. An Evidence keeps the options that it was collected with.
#include <array>
#include <vector>

#include "diagnosis/evidence/mechanisms.h"
#include "models/effects/effect.h"

namespace sparflow {

/// See branches.h. The oil's temperature is in degC, pressures are in bar.
struct BranchOptions {
  /// Usable samples of all logs of a cylinder and direction below which no branch is decided.
  /// @threshold [samples] 1..; chosen: each of two branches may have its fewest samples
  int fewest_samples = 60;
  /// Samples of one branch in one log below which its mask is empty, and below which no law is
  /// fitted.
  /// @threshold [samples] 5..; chosen: fewer do not determine a law with four or five coefficients
  int fewest_of_branch = 30;
  /// Samples above which the laws are fitted to every second, third, ... sample only.
  /// @threshold [samples] 60..; chosen: samples within the filter's width are correlated, so that
  /// more than this make the fit slower, not better
  int most_fitted = 3000;
  /// Prior share of samples that follow neither law.
  /// @threshold [1] 0..1; chosen: one sample of fifty, for starts and stops. Half or twice of it changes the odds that a
  /// sample is an outlier by two, that is by what 0.7 nat of its distance to the laws do
  double outlier_share = 0.02;
  /// Least standard deviation of a law.
  /// @threshold [bar] 0..; chosen: that of the pressure sensors
  double least_deviation = 0.3;
  /// Posterior probability of a law above which a sample is a member of its branch.
  /// @threshold [1] 0.5..1; chosen: at most one of twenty such samples may belong to the other
  /// branch
  double least_probability = 0.95;
  /// Standard deviations by which a member of one branch lies above the other law; nearer is the
  /// intersection of both laws, in which no branch is decided.
  /// @threshold [1] 0..; derived: a normal error exceeds three standard deviations in 0.13 % of
  /// samples
  double clear_deviations = 3.0;
  /// Share of the load that the supply pressure carries by a counterbalance valve's law, above
  /// which that law is the return line's again.
  /// @threshold [1] 0.6..1; derived: the share is 1 where the return line sets the pressures and
  /// 1/(1 + R A_hold/A_supply) < 0.6 where a valve of pilot ratio R > 1 does
  double largest_load_share = 0.75;
  /// Standard deviation of the load below which the share of it that a law carries is not known.
  /// @threshold [bar] 0..; chosen: the load's share is a slope, which needs loads that differ
  double least_load_deviation = 1.0;
  /// Samples dropped on both sides of a change of branch.
  /// @threshold [samples] 0..; chosen: near a change the filter mixes both laws
  int guard_samples = 2;
  /// Neighbouring samples that count as one independent sample in a comparison of likelihoods.
  /// @threshold [samples] 1..; chosen: samples within the filter's width are correlated
  double samples_alike = 10.0;
  /// Gain of separate laws for two states of a machine over common laws, above which they are kept.
  /// It is counted in independent samples (samples_alike).
  /// @threshold [nat] 0..; chosen: odds of e^10 = 22,000 that a valve was changed between the
  /// states
  double separate_laws_gain = 10.0;
  /// Range of the oil's temperature above which the return line's law depends on it.
  /// @threshold [degC] 0..; chosen: a smaller change leaves nothing that a slope could be fitted to
  double least_oil_range = 2.0;
  /// Least range of the pressure that a law does not set, over which outliers are spread evenly.
  /// @threshold [bar] 0..; chosen: keeps the density of outliers finite where a pressure is
  /// constant
  double least_pressure_range = 10.0;
};

/// See NoiseModel::estimate.
struct NoiseOptions {
  /// Largest reflection coefficient of the autoregression, in size.
  /// @threshold [1] 0..1; chosen: nearer to one would explain any slow effect as noise
  double largest_reflection = 0.97;
  /// Share of the variance that counts as independent from row to row, whatever the residuals say (white-noise correction, as in
  /// ITU-T G.728). Laws are driven by measured pressures, whose errors would else decide the sizes of laws beside slow model errors:
  /// the inverse covariance of these weights differences of neighbouring rows a thousand times more than levels.
  /// @threshold [1] 0..1; tuned: sizes of laws in the speeds of a simulated excavator and a crane differ from those of ordinary least
  /// squares by up to a quarter, in place of three quarters; from 0.1 to 0.3 they change by up to an eighth
  double white_share = 0.2;
  /// Blocks below which they have no random offset.
  /// @threshold [blocks] 2..; chosen: a variance of fewer block means says nothing
  int fewest_blocks_for_offsets = 4;
  /// Rows that the prior of a block's variance is worth; zero: all blocks have one variance. Beside references alone
  /// (VerdictOptions::block_freedom).
  /// @threshold [rows] 0..; chosen: one variance for all blocks
  double block_freedom = 0.0;
  /// Blocks below which they have one variance.
  /// @threshold [blocks] 2..; chosen: as fewest_blocks_for_offsets
  int fewest_blocks_for_scales = 4;
  /// Rows of a block that count as one independent row of its mean, while the mean is shrunken.
  /// @threshold [rows] 1..; chosen: stands for the autoregression, which is not known yet in that
  /// step
  double rows_alike = 4.0;
  /// Time constants of settling that are tried (NoiseModel::settling).
  /// @threshold [s] 0..; chosen: from a fast spool to a column of oil behind a slow pump; between neighbours the likelihood changes
  /// little
  std::array<double, 4> settling = {0.15, 0.4, 1.0, 2.5};
  /// Rows within one time constant after a change, and beyond three, below which both have the same deviation.
  /// @threshold [rows] 2..; chosen: of fewer rows one outlier would decide; whether they differ decides the likelihood's gain
  double fewest_rows_of_kind = 5.0;
  /// Largest ratio of the deviations right after a change and in steady motion.
  /// @threshold [1] 1..; chosen: beyond it transient rows have no weight left
  double largest_transient_ratio = 30.0;
  /// Gain in likelihood of a deviation that settles, below which it is constant.
  /// @threshold [nat] 0..; chosen: a likelihood ratio of e^10; rows are not quite independent, so that chance gains more than the
  /// 2 nats of a test of two parameters
  double least_settling_gain = 10.0;
};

/// See CavitationFloor in channel_builder.cpp.
struct CavitationOptions {
  /// Rows on either side of the pressure limit below which there is no limit.
  /// @threshold [rows] 1..; chosen: the law has five coefficients, the limit one
  int fewest_rows_of_piece = 20;
  /// Rows below which no limit is searched for.
  /// @threshold [rows] 2..; chosen: three times the rows that either side needs
  int fewest_rows = 60;
  /// Ratio of the sums of squared errors with and without the limit, below which it is kept.
  /// @threshold [1] 0..1; chosen: a limit that explains less than a fifth may follow the law's own
  /// error
  double largest_error_ratio = 0.8;
};

struct EvidenceOptions {
  Mechanisms mechanisms;  ///< of the diagnosis that uses the evidence
  BranchOptions branches;
  NoiseOptions noise;
  CavitationOptions cavitation;
  /// Whether the noise may settle after commands (NoiseModel::settling): in a comparison with references, which lack the same of
  /// starts and stops. In a log alone a start may be where an effect of flow or pump shows;
  /// forces settle there after fast changes of speed (unsteady_span).
  bool settles = false;
  /// Uses unfiltered rows up to the ends of each motion, for signals whose own window is so short
  /// (sharpest_window) that it distorts nothing.
  bool whole_motions = false;
  /// Kinds of channels that are collected; empty = all. An estimate needs those in which its effects show.
  std::vector<EvidenceKind> kinds;
  /// Effects of the model that act in reference and suspect logs alike. Their linear parameters are estimated anew in
  /// each channel, as columns of its baseline: an error of their values is no difference between the logs.
  std::vector<AppliedEffect> shared;

  /// Change of a command, as share of full command, from which machine and oil have to settle again.
  /// @threshold [1] 0..1; chosen: levers rest within a twentieth
  double least_change = 0.05;
  /// Time in which the speed of a steady rod changes by less than its median while it moves.
  /// @threshold [s] 0.05..2; chosen: a start or a stop by the lever takes as long
  double unsteady_span = 0.5;
  /// Rate of a pump's pressure above which machine and oil are not settled.
  /// @threshold [Pa/s] 1e5..1e8; chosen: a load that is driven through its range in two seconds changes its pressure as fast; a pump
  /// that follows a demand is ten times faster
  double fastest_settled = 5e6;
  /// Pressure below which a chamber that grows counts as void, so that the valve's flow does not set the speed there.
  /// @threshold [Pa] 0..1e6; chosen: an anti-cavitation valve holds tank pressure less its cracking pressure, some 1 bar, and a
  /// sensor's offset and noise add another
  double void_pressure = 2e5;
  /// Widths of the further low-pass of forces, which is as narrow as the noise of the accelerations allows (low_pass_width); none: no
  /// low-pass.
  /// @threshold [s] 0..2; chosen: half as wide again each; the widest still leaves most of a motion of some seconds, and the lowest
  /// natural frequencies pass the narrower ones
  std::vector<double> force_widths = {0.0, 0.2, 0.3, 0.45, 0.7, 1.0};
  /// Noise of the accelerations that no low-pass is for, as a share of the largest measured force.
  /// @threshold [1] 0..1; chosen: 0.1 % as ResidualModelOptions::smallest_force_share, a fraction of the error to which masses are known
  double force_noise_share = 1e-3;
  /// Rows of a channel in one width of the filter.
  /// @threshold [1] 1..; chosen: rows a third of the width apart are nearly independent; more rows
  /// would cost time and add no information
  double rows_a_window = 3.0;
  /// Rows below which a channel is dropped.
  /// @threshold [rows] 1..; chosen: a baseline of up to six columns, two noise coefficients and an
  /// effect
  int fewest_rows = 30;
  /// Rows of the references below which a supply channel's pressure limit is learned from all logs.
  /// @threshold [rows] 1..; chosen: twice the rows that a channel needs
  int fewest_reference_rows = 60;
  /// Blocks below which a channel is dropped.
  /// @threshold [blocks] 2..; derived: a motion can only be left out where another one remains
  int fewest_blocks = 2;
  /// Stretch of motion below which it forms no block.
  /// @threshold [s] 0..; chosen: a shorter one shows starts and stops only
  double shortest_block = 0.3;
  /// Stretch of motion above which it is cut into several blocks.
  /// @threshold [s] 0..; chosen: blocks are the units that are held out and resampled, so that a
  /// log needs several
  double longest_block = 8.0;
  /// Rows that a stretch of motion must span, else it forms no block.
  /// @threshold [rows] 1..; derived: the autoregression has two coefficients
  int fewest_rows_of_block = 2;
  /// Rows that a block may always have, however long these are.
  /// @threshold [rows] 1..; derived: twice the fewest, so that no block is cut below them
  int rows_of_longest_block = 4;
  /// Third differences of a raw signal below which its noise is not known.
  /// @threshold [samples] 1..; chosen: a robust deviation of 20 values has a standard error of a
  /// quarter, of correlated ones more
  int fewest_differences = 20;
  /// Samples without command above which the noise of a speed is known from them.
  /// @threshold [samples] 1..; chosen: a robust deviation of 50 independent values has a standard
  /// error of a sixth
  int fewest_samples_at_rest = 50;
  /// Largest action of a linear parameter at its bound, beyond the columns before it, below which
  /// its column is zero; in units of the sensors' noise.
  /// @threshold [1] 0..; chosen: a twentieth of the noise changes no measurement; its estimate
  /// would be determined by rounding alone
  double negligible_action = 0.05;
};

}  // namespace sparflow
