#pragma once
/// The page of `simulate`: what the plant did over time, beside a recording where its commands or motion were given by one.
#include <string>
#include <utility>
#include <vector>

#include "apps/report/page/page.h"

namespace sparflow {

struct SimulatedChannel {
  std::string part;   ///< cylinder or pump
  std::string chart;  ///< channels of one part that share a chart share this word
  std::string name, unit;
  std::string label() const { return part + ": " + name; }
  Eigen::VectorXd simulated;  ///< [samples]
  Eigen::VectorXd recorded;   ///< [samples], NaN where nothing was recorded; empty: no recording
};

struct SimulationView {
  std::string machine;
  Eigen::VectorXd t;  ///< [s]
  std::vector<SimulatedChannel> channels;
  std::vector<std::pair<std::string, double>>
      balance_kJ;  ///< work put in, heat, stored, not accounted for
  std::vector<std::pair<std::string, double>> losses_kJ;  ///< by part and place
  std::string headline, text;
  std::vector<std::pair<std::string, std::string>> provenance;
};

/// Root mean square of simulated less recorded, and the recording's standard deviation; NaN without common samples.
struct RecordingError {
  double rmse = 0.0, spread = 0.0;
};
RecordingError recording_error(const SimulatedChannel& channel);

Page simulation_page(const SimulationView& view);

}  // namespace sparflow
