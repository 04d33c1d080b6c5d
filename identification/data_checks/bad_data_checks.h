#pragma once
/// The single checks behind identification/data_checks/bad_data.h; used by bad_data.cpp only.
#include <optional>
#include <string>
#include <vector>

#include "identification/data_checks/bad_data.h"

namespace sparflow {

/// A channel with the scales and limits that the checks use.
struct CheckedChannel {
  const Channel* channel = nullptr;
  int cylinder = -1;   ///< the cylinder it belongs to, -1 = none
  std::string family;  ///< channels of one family are peers: "position", "pressure"; "" = no peers
  double scale = 1.0;  ///< values over scale are comparable among peers
  double field = 1.0;  ///< SI value of one `field_unit`
  std::string field_unit;
  double least_noise = 0.0;  ///< [unit of values] smaller noise is not reported
  double least_jump = 0.0;   ///< [unit of values] smaller jumps are not reported
  /// [unit/s] largest rate of change that the machine allows; 0 = unknown
  double fastest = 0.0;
};

/// Noise of one channel in blocks of BadDataOptions::block_s.
struct NoiseProfile {
  std::vector<SampleRange> blocks;  ///< within runs
  Eigen::VectorXd level;            ///< [unit] [blocks] standard deviation of the white part
  Eigen::VectorXd
      whiteness;         ///< [blocks] sixth over third differences: 1 = white, small = oscillation
  double typical = 0.0;  ///< median over blocks
  double quiet = 0.0;    ///< BadDataOptions::quiet_quantile over blocks
};

/// Estimates the noise from the median magnitude of third differences, to which smooth motion contributes little.
NoiseProfile noise_profile(const Eigen::VectorXd& values, const Log& log,
                           const BadDataOptions& options);

struct CheckContext {
  const Machine& machine;
  const Log& log;
  const MachineSignals& signals;
  const BadDataOptions& options;
  std::vector<CheckedChannel> channels;
  std::vector<NoiseProfile> noise;  ///< by channel
};

/// A fault of one channel with the affected samples.
struct Finding {
  BadDataKind kind = BadDataKind::kStuck;
  Mask affected;
  std::string evidence;
  std::string remedy;
};

std::optional<Finding> check_missing(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_ripple(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_noise(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_stuck(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_stuck_command(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_saturated(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_wild(const CheckContext& context, std::size_t channel);
std::optional<Finding> check_jumps(const CheckContext& context, std::size_t channel);

/// @return the stretches of equal values, longer than one sample, within runs
std::vector<SampleRange> constant_stretches(const Eigen::VectorXd& values, const Log& log);

/// @return the values that are not missing
Eigen::VectorXd finite_values(const Eigen::VectorXd& values);

/// @return the value in the channel's usual unit, e.g. "4.1 bar"
std::string in_field(const CheckedChannel& channel, double value);

}  // namespace sparflow
