#pragma once
/// A position that oscillates while the pressures do not: such an oscillation of the rod would need a force that
/// accelerates the masses, and would compress the oil in the chambers, so that the sensor alone ripples.
///   X_allowed(f) = F(f) / (m_least (2 pi f)^2) + s p(f) / E_least + v_full u(f) / (2 pi f)
/// with the amplitudes F of the cylinder's force, p of its chamber pressures, u of its command, the stroke s, the speed v_full
/// of full command, the softest oil and hoses E_least, and the least mass about the cylinder: all other joints free, no payload.
/// Spectra are those of blocks of time, in Hz and seconds, so that the verdict does not depend on the sampling. An oscillation
/// of the load shows in the pressures and is none. Without pressures or force of the cylinder nothing is judged.
/// Discrete spectrum with Hann's window: F. J. Harris (1978), Proc. IEEE 66(1), 51-83.
#include <Eigen/Dense>

namespace sparflow {

struct RippleOptions {
  /// Length of the blocks in which amplitudes are estimated; they overlap by half.
  /// @threshold [s] 0.5..4; chosen: a few periods of the lowest frequency, while a ripple's frequency, which follows the rod's
  /// speed, hardly changes
  double block_s = 1.0;
  /// Lowest frequency of the band.
  /// @threshold [Hz] 2..10; derived: three periods in a block, so that Hann's window separates it from the motion
  double lowest_hz = 3.0;
  /// Highest frequency of the band.
  /// @threshold [Hz] 10..100; chosen: differentiation filters remove faster oscillations, and 50 Hz of sampling
  /// contain it
  double highest_hz = 22.0;
  /// Highest frequency over the sampling rate.
  /// @threshold [1] 0.3..0.5; chosen: a little below half the sampling rate, where two samples make a period
  double sampling_share = 0.45;
  /// Least number of frequencies of the band.
  /// @threshold [frequencies] 4..50; chosen: fewer do not tell a line from noise
  Eigen::Index fewest_frequencies = 6;
  /// Least amplitude of the position over what pressures, force and command allow at that frequency.
  /// @threshold [1] 2..100; chosen: friction, a soft structure between rod and masses and errors of the masses change what is
  /// allowed by a factor of several; a faulty sensor exceeds it by twenty and more
  double allowed_ratio = 8.0;
  /// The same ratio in blocks beside such a block, in which the ripple begins or ends.
  /// @threshold [1] 1..100; chosen: a block that the ripple fills by half has half the amplitude; blocks without ripple on
  /// simulated machines, with the noise of their sensors, stay below 1
  double edge_ratio = 3.0;
  /// Softest effective bulk modulus of oil and hoses.
  /// @threshold [Pa] 5e7..1e9; chosen: 0.2 GPa, a fifth of oil with some air in rigid pipes
  double softest_oil = 2e8;
  /// Least amplitude over that of the channel's own noise: the smaller one of the lower quartile over the blocks and of the
  /// noise between the lines of the block's spectrum.
  /// @threshold [1] 2..20; derived: band amplitudes of white noise scatter by a seventh, so 4 is far above them
  double noise_ratio = 4.0;
  /// Quantile of the blocks' amplitudes that stands for the channel's quiet state.
  /// @threshold [1] 0..0.5; chosen: stays quiet with ripple in up to three quarters of the blocks
  double quiet_quantile = 0.25;
  /// Least speed of the ripple (2 pi f X) over the joint's limit of speed.
  /// @threshold [1] 0.02..1; chosen: a filter for the speed leaves a tenth and more of it, which is then 2 % of the limit,
  /// as BadDataOptions::least_speed_share
  double least_speed_share = 0.2;
  /// Largest mean flatness of the blocks' spectra (geometric over arithmetic mean of the powers); a flatter one is noise, which
  /// another check finds.
  /// @threshold [1] 0.1..0.55; derived: 0.56 for white noise, below 0.2 for a line
  double flattest = 0.4;
  /// Longest time between two rippling stretches that belongs to the ripple.
  /// @threshold [s] 0..20; chosen: the rod's speed changes sign or its ripple leaves the band for a few seconds
  double longest_pause_s = 3.0;
  /// Least duration of a stretch, without its pauses.
  /// @threshold [s] 0.5..60; chosen: as BadDataOptions::noise_bursts_s; a single stop or impact disturbs two blocks, 1.5 s
  double least_s = 2.0;
};

}  // namespace sparflow
