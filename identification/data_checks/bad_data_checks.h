#pragma once
/// The single checks behind identification/data_checks/bad_data.h; used by bad_data.cpp only.
#include <optional>
#include <string>
#include <vector>

#include "identification/data_checks/bad_data.h"

namespace sparflow {

/// What a channel can be judged by.
struct CheckedChannel {
  const Channel* channel = nullptr;
  int cylinder = -1;   ///< the cylinder it belongs to, -1 = none
  std::string family;  ///< channels of one family are twins: "position", "pressure"; "" = has none
  double scale = 1.0;  ///< values over scale are comparable among twins
  double field = 1.0;  ///< SI value of one `field_unit`
  std::string field_unit;
  double least_noise = 0.0;  ///< [unit of values] below it noise does no harm
  double least_jump = 0.0;   ///< [unit of values]
  /// [unit/s] the fastest that the machine can change it; 0 = no limit is known
  double fastest = 0.0;
};

/// Noise of one channel in blocks of about a second.
struct NoiseProfile {
  std::vector<SampleRange> blocks;  ///< within runs
  Eigen::VectorXd level;            ///< [unit] standard deviation of its white part, one a block
  Eigen::VectorXd whiteness;  ///< sixth over third differences: 1 = white, small = oscillation
  double typical = 0.0;       ///< median over blocks
  double quiet = 0.0;         ///< lower quartile over blocks
};

/// From the median magnitude of third differences, which smooth motion does not reach.
NoiseProfile noise_profile(const Eigen::VectorXd& values, const Log& log);

struct CheckContext {
  const Machine& machine;
  const Log& log;
  const MachineSignals& signals;
  const BadDataOptions& options;
  std::vector<CheckedChannel> channels;
  std::vector<NoiseProfile> noise;  ///< by channel
};

/// The channel's samples that are affected, and why.
struct Finding {
  BadDataKind kind = BadDataKind::kStuck;
  Mask affected;
  std::string evidence;
  std::string remedy;
};

std::optional<Finding> check_missing(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_noise(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_stuck(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_stuck_command(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_saturated(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_wild(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_jumps(const CheckContext& context, std::size_t channel);

/// Stretches of one value, longer than one sample, inside runs.
std::vector<SampleRange> constant_stretches(const Eigen::VectorXd& values, const Log& log);

/// Without the missing ones.
Eigen::VectorXd finite_values(const Eigen::VectorXd& values);

/// "4.1 bar"
std::string in_field(const CheckedChannel& channel, double value);

}  // namespace sparflow
