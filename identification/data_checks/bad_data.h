#pragma once
/// Finds faulty measurement channels: stuck, jumping, noisy, missing or clipped. No physical law explains these faults, so
/// they are searched before a residual is attributed to a missing effect. Every check requires two things: the channel
/// departs from its usual behaviour or from its peers (channels of the same quantity), and no other channel changes at
/// that moment. A pressure that steps with a command, or an oscillation that all sensors measure, is a motion of the
/// machine. docs/fit_and_compare.md, "Bad data".
#include <string>
#include <utility>
#include <vector>

#include "identification/data_checks/position_ripple.h"
#include "identification/signals/signals.h"

namespace sparflow {

enum class BadDataKind {
  kStuck,      ///< constant for longer than its noise or the machine's motion allows
  kJumping,    ///< steps away and back that no other channel explains
  kNoisy,      ///< white noise far above that of its peers or its own elsewhere
  kDropOut,    ///< falls to zero, or is missing
  kSaturated,  ///< repeatedly cut off at one value
  kWild,       ///< repeated single samples far off both their neighbours
  kRippling    ///< a position that oscillates by far more than the pressures allow
};

struct BadChannel {
  std::string channel;  ///< signal's name without unit: "pA_boom"
  BadDataKind kind = BadDataKind::kStuck;
  double from_s = 0.0;   ///< [s] first and ...
  double to_s = 0.0;     ///< ... last sample affected, in the log's time
  double share = 0.0;    ///< of the log's samples, 0..1
  std::string evidence;  ///< one sentence with figures
  std::string remedy;    ///< one sentence: what to do

  // For the chart of the channel.
  std::string file = {};        ///< the log's name
  std::string unit = {};        ///< of `values`: bar, mm, degC ...
  Eigen::VectorXd time = {};    ///< [s] [samples]
  Eigen::VectorXd values = {};  ///< [unit] [samples] as logged, NaN = missing
  std::vector<std::pair<double, double>> stretches = {};  ///< [s] affected, in order
};

/// @return "stuck", "jumping", "noisy", "drop_out", "saturated", "wild" or "rippling", as in JSON
const char* bad_data_word(BadDataKind kind);

/// Thresholds of the checks. A level of noise is a standard deviation of the white part, estimated
/// from third differences; a share is of the log's samples unless it says otherwise.
struct BadDataOptions {
  // Noise: the level of each block against that of the peers and of the channel itself.

  /// Length of the blocks in which noise is estimated.
  /// @threshold [s] 0.2..10; chosen: a machine hardly changes its way of moving within a second
  double block_s = 1.0;
  /// Least number of samples in a block; blocks of slowly sampled logs are longer than `block_s`.
  /// @threshold [samples] 10..1000; derived: with 40 samples a median scatters by a fifth
  double block_fewest = 40.0;
  /// Least number of differences from which a noise level is estimated.
  /// @threshold [differences] 3..100; chosen: the median of fewer differences is no estimate
  std::size_t fewest_differences = 10;
  /// Quantile of the blocks' levels that stands for the channel's quiet state.
  /// @threshold [1] 0..0.5; chosen: the lower quartile stays quiet with noise in up to three
  /// quarters of the blocks; it is 0.87 of the median for equal noise
  double quiet_quantile = 0.25;
  /// Least noise of a block over the median of the peers; sensors twice as noisy as their peers are
  /// accepted.
  /// @threshold [1] 2..10; derived: a block's estimate scatters by a fifth, so 3 is eight of its
  /// standard deviations above equal noise
  double noise_ratio = 3.0;
  /// Factor on `noise_ratio` where there is a single peer.
  /// @threshold [1] 1..5; chosen: a single peer may be a sensor of a better type
  double single_peer_ratio = 2.0;
  /// Least noise of a position with fewer than two peers, over its range.
  /// @threshold [1] 0..0.01; chosen: a stroke sensor vibrates with its own cylinder
  double shaking_share = 1e-3;
  /// Factor on `noise_ratio` for the median over all blocks, above which the channel is noisy
  /// throughout.
  /// @threshold [1] 0.5..1; chosen: the level over many blocks is known better than that of one
  /// block, so a smaller ratio suffices
  double throughout_share = 0.83;
  /// Factor on `noise_ratio` for the single blocks of a channel that is noisy throughout.
  /// @threshold [1] 0.3..1; chosen: allows a block of such a channel to scatter below its median
  double throughout_block_share = 0.5;
  /// Factor on `noise_ratio` for a burst over the channel's own quiet blocks.
  /// @threshold [1] 1..3; chosen: a burst is at four times the quiet level, far above its scatter
  double burst_own_ratio = 1.33;
  /// Factor on `noise_ratio` for a burst over the median of the peers.
  /// @threshold [1] 0.3..1; chosen: a burst is at twice the peers' level, as it also stands out
  /// from the channel itself
  double burst_peer_share = 0.67;
  /// Least ratio of the sixth to the third differences' level; 1 is white noise.
  /// @threshold [1] 0.45..0.95; derived: an oscillation of a quarter of the sampling rate has 0.42
  double least_whiteness = 0.7;
  /// Least ratio of the channel's disturbance to the largest one of a peer in the same block.
  /// @threshold [1] 1..5; chosen: when the machine vibrates, all its sensors are disturbed
  double livelier_ratio = 1.6;
  /// Least total duration of noisy blocks.
  /// @threshold [s] 0..60; chosen: a shorter disturbance hardly affects the results
  double noise_bursts_s = 2.0;
  /// Least number of noisy blocks.
  /// @threshold [blocks] 1..100; chosen: a single block may be chance
  double noise_fewest_blocks = 2.0;

  // Stuck and missing values.

  /// Duration below which a constant stretch is never called stuck.
  /// @threshold [s] 0.1..60; chosen: a shorter one hardly affects the results
  double stuck_s = 1.0;
  /// A constant stretch is a fault when its probability, by how often the channel repeats a value
  /// in the same state of the machine, is below this; it is divided by the number of samples.
  /// @threshold [1] 1e-15..1e-3; chosen: rate of false alarms in a log under independent
  /// repetitions, far below any usual one because repetitions are correlated
  double stuck_chance = 1e-9;
  /// Least number of steps of a state of the machine from which the frequency of repetitions is
  /// estimated.
  /// @threshold [steps] 10..1000; chosen: the frequency is then known to a seventh of a standard
  /// deviation of a single step
  double fewest_steps = 50.0;
  /// Frequency of repetitions above which they are no evidence that a channel is stuck. Below it,
  /// `stuck_chance` weighs how long the stretch is for that frequency.
  /// @threshold [1] 0.3..0.99; chosen: such a channel mostly repeats its value, as one that is
  /// logged faster than it is measured
  double common_repeats = 0.7;
  /// Quantile of the lengths of constant stretches that stands for the usual length.
  /// @threshold [1] 0.5..0.99; chosen: nine of ten stretches are no longer
  double usual_stretch_quantile = 0.9;
  /// Least length of a stuck stretch over the usual length.
  /// @threshold [1] 1..20; chosen: clearly beyond what the channel does in its healthy state
  double stretch_ratio = 3.0;
  /// Number of stretches from which on a stretch is compared with the usual length.
  /// @threshold [stretches] 2..100; chosen: with fewer the usual length would be the fault's own
  std::size_t fewest_stretches = 10;
  /// Time before and after a start, stop or reversal in which it may fill or empty a chamber.
  /// @threshold [s] 0.05..2; chosen: response time of a valve
  double valve_answer_s = 0.3;
  /// Least share of a channel's samples without a value.
  /// @threshold [1] 0..1; chosen: a fifth missing leaves too little of most motions
  double missing_share = 0.2;

  /// Command above which a cylinder is surely told to move: then a position that never changes is a
  /// fault, and so is a command that the cylinder does not follow.
  /// @threshold [1] 0..1; chosen: outside any dead band
  double firm_command = 0.15;

  // Stuck commands, which the cylinder's motion contradicts.

  /// Least duration of one value of a command.
  /// @threshold [s] 0.2..60; chosen: hands and controllers hold a command for a second as well
  double command_stuck_s = 1.5;
  /// Least time without interruption in which the cylinder does not follow.
  /// @threshold [s] 0.2..10; chosen: longer than a valve and an oscillating load delay a motion
  double contradiction_s = 0.8;
  /// Speed over the usual speed at this command below which the cylinder does not follow.
  /// @threshold [1] 0..0.5; chosen: a saturated pump slows a cylinder to half its speed
  double slowest_following = 0.4;
  /// Speed over the usual speed at this command above which the cylinder does not follow.
  /// @threshold [1] 2..10; chosen: a faulty pressure compensator lets it run at up to twice its
  /// speed
  double fastest_following = 2.2;
  /// Share of a pump's largest flow in the log above which it is exhausted and its cylinders need not follow.
  /// @threshold [1] 0.5..1; chosen: flows from speeds scatter by some percent
  double exhausted_share = 0.9;
  /// Share of the observed stroke at either end in which the cylinder need not follow.
  /// @threshold [1] 0..0.2; chosen: end stop and its damping
  double end_share = 0.03;
  /// Largest share of the other commanded samples that the cylinder does not follow either.
  /// @threshold [1] 0..0.5; chosen: with a larger share the cause is the valve or the pump
  double astray_share = 0.02;
  /// Least number of driven samples in a direction from which the usual speed is estimated.
  /// @threshold [samples] 20..10000; chosen: two coefficients with room for the fault itself
  std::size_t speed_fewest = 100;

  // Jumps and wild samples.

  /// Least size of a jump, and of a wild sample's distance to its neighbours, in standard
  /// deviations of the noise. A clipped zero that is entered by a smaller step is no fault either.
  /// @threshold [1] 5..50; chosen: beyond noise of any usual distribution
  double jump_noise = 10.0;
  /// Largest time within which a jump must return.
  /// @threshold [s] 0.1..600; chosen: a level that stays may be a change of the machine
  double jump_back_s = 10.0;
  /// Step of a position over the largest one that its joint's limit of speed allows.
  /// @threshold [1] 1..5; chosen: a machine may exceed the limit of its file by half
  double jump_speed_ratio = 1.5;
  /// Largest difference of the step back from the step away, as a share of the latter, beyond
  /// noise.
  /// @threshold [1] 0..1; chosen: the signal itself moves on while the channel is away
  double jump_alike_share = 0.35;
  /// Noise that is added to that difference, in standard deviations.
  /// @threshold [1] 1..10; chosen: each of the two steps has the noise of two samples
  double jump_alike_noise = 4.0;
  /// Largest number of samples between a step and its explanation in another channel.
  /// @threshold [samples] 0..20; chosen: delays of sensor and logger
  Eigen::Index near_samples = 3;
  /// Least step of a peer, as a share of the channel's own, that explains it.
  /// @threshold [1] 0..1; chosen: a twentieth, because areas and volumes of the chambers differ
  double peer_step_share = 0.05;
  /// Least step of a peer or a command, in standard deviations of its noise, that is a change.
  /// @threshold [1] 3..20; chosen: beyond noise of any usual distribution
  double other_noise = 6.0;
  /// Least change of a command from one sample to the next that is a motion of the lever, beyond
  /// its noise.
  /// @threshold [1] 0..0.05; chosen: full command in 500 samples, ten seconds at 50 Hz, a slow pull; less is the
  /// rounding of a logger with nine bits
  double lever_step = 2e-3;
  /// Least size of the steps beside a step, as a share of it, for them to be one ramp.
  /// @threshold [1] 0..1; chosen: steps of one ramp are equal within a factor of two
  double ramp_share = 0.5;
  /// Number of such steps in a row that make a ramp.
  /// @threshold [steps] 2..10; chosen: a jump has one step, a chamber that fills has several
  int ramp_steps = 3;
  /// Largest share of a step that the mean of the steps on either side of it makes up.
  /// @threshold [1] 0..1; chosen: as jump_alike_share, the signal itself may move on by so much
  double local_slope_share = 0.35;
  /// Longest loss of contact of a pump pressure's sensor while a lever moves.
  /// @threshold [s] 0.05..5; chosen: changes of a pump pressure that a lever causes last longer
  double contact_s = 0.5;
  /// Longest pulse of a command.
  /// @threshold [s] 0.02..2; chosen: shorter than an operator moves a lever to and fro
  double pulse_s = 0.2;
  /// Least height of a command's pulse.
  /// @threshold [1] 0..1; chosen: higher than the dead bands that a controller jumps across
  double pulse_height = 0.3;
  /// Least number of pulses of a command.
  /// @threshold [pulses] 1..100; chosen: a controller may step a command, repeated pulses are
  /// faults
  int pulses = 3;
  /// Least share of wild samples.
  /// @threshold [1] 0..0.1; chosen: a single one may be an impact, many are a fault
  double wild_share = 0.003;
  /// Least number of wild samples.
  /// @threshold [samples] 1..1000; chosen: the same for short logs
  double wild_fewest = 10.0;
  /// Samples either side with which a sample is compared once a channel is known to have wild ones.
  /// @threshold [samples] 2..10; chosen: three wild samples of seven do not move the median
  Eigen::Index wild_reach_samples = 3;
  /// Largest difference of a wild sample's neighbours over its distance to their mean.
  /// @threshold [1] 0..2; chosen: the neighbours agree with each other clearly better than with it
  double wild_neighbours = 0.5;
  /// Least distance of a wild sample, in steps of the channel's resolution.
  /// @threshold [1] 1..20; chosen: the last digit of a logger may alternate
  double wild_resolution = 4.0;

  // Saturation.

  /// Largest share of repetitions away from the limit. It is smaller than `common_repeats`, because
  /// stretches at the limit are counted and not weighed by their length.
  /// @threshold [1] 0..1; derived: as many equal samples as `saturated_shortest` asks for then
  /// repeat by chance with a probability below one percent, 0.3^4
  double saturated_repeats = 0.3;
  /// Least length of a stretch at the limit.
  /// @threshold [samples] 2..100; chosen: a peak that is not cut off is shorter
  Eigen::Index saturated_shortest = 5;
  /// Least number of stretches at the limit.
  /// @threshold [stretches] 1..100; chosen: a relief valve or an end stop may hold a value once
  int saturated_fewest = 3;
  /// Least total duration at the limit.
  /// @threshold [s] 0..60; chosen: shorter times hardly affect the results
  double saturated_s = 0.5;
  /// Least noise of the livelier blocks, over the channel's range.
  /// @threshold [1] 0..0.01; chosen: in a log without noise a standby pressure or a relief valve
  /// looks like a limit of the sensor
  double noiseless_share = 1e-4;
  /// Quantile of the blocks' levels that stands for the livelier blocks.
  /// @threshold [1] 0.5..1; chosen: the blocks away from the limit, if these are at least a quarter
  double lively_quantile = 0.75;

  // Smaller noise or jumps do not affect the results and are not reported.

  /// Least noise of a pressure.
  /// @threshold [Pa] 0..1e5; chosen: 0.05 bar, far below the noise of usual sensors
  double least_pressure = 5e3;
  /// Least jump of a pressure over `least_pressure`.
  /// @threshold [1] 1..100; chosen: 1 bar. A smaller step does no harm to a learned pressure, whose error is of that size;
  /// a larger one should not stay hidden
  double pressure_jump_ratio = 20.0;
  /// Least noise of a command.
  /// @threshold [1] 0..0.2; chosen: noise of less stays within a usual valve's dead band (0.05 to 0.1), so that it moves
  /// nothing; twice of it may cross one
  double least_command = 0.03;
  /// Least jump of a command over `least_command`.
  /// @threshold [1] 1..30; chosen: 0.15 of full command, outside any dead band
  double command_jump_ratio = 5.0;
  /// Least noise of a position, as filtered speed over the joint's limit.
  /// @threshold [1] 0..0.2; chosen: such an error of the speed is small in the flow
  double least_speed_share = 0.02;
  /// Least noise of an oil temperature.
  /// @threshold [K] 0..10; chosen: the viscosity changes by some percent only within 1 K
  double least_oil = 1.0;
  /// Least jump of an oil temperature.
  /// @threshold [K] 0..30; chosen: oil does not warm by 3 K from one sample to the next
  double least_oil_jump = 3.0;

  /// Oscillations of a position that the pressures do not show.
  RippleOptions ripple;
};

/// @param signals of the same log and machine
/// @return the faulty channels, largest share of samples first; at most one entry for each channel
std::vector<BadChannel> find_bad_channels(const Machine& machine, const Log& log,
                                          const MachineSignals& signals,
                                          const BadDataOptions& options = {});

/// Whether a log's columns are those of a motion that the program computed (speed and acceleration of every joint, power):
/// its values have no noise, and a pump that stands by is no stuck sensor. Only missing values are then faults.
bool is_computed_motion(const Machine& machine, const Log& log);

/// @return e.g. "pA_boom is noisy between 12.0 and 38.5 s (22 % of the log): its noise there is 5.1 bar ..."
std::string bad_channel_sentence(const BadChannel& bad);

}  // namespace sparflow
