#include "simulator/sensors/log_writer.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

namespace sparflow::plant {

LogWriter::LogWriter(const Machine& machine, const PlantParameters& parameters, std::uint64_t seed,
                     const std::string& remark)
    : sensors_(machine, parameters, seed) {
  if (!remark.empty()) text_ = "# " + remark + "\n";
  text_ += "t_s";
  for (const SensedChannel& c : sensors_.channels()) text_ += "," + c.name;
  text_ += "\n";
}

void LogWriter::add(const Record& record) {
  const std::vector<double> told = sensors_.sense(record);
  fmt::format_to(std::back_inserter(text_), "{:.4f}", record.t);
  for (std::size_t c = 0; c < told.size(); ++c) {
    text_ += ',';
    if (std::isnan(told[c])) continue;
    fmt::format_to(std::back_inserter(text_), "{:.6g}", told[c] / sensors_.channels()[c].scale);
  }
  text_ += '\n';
  ++rows_;
}

std::string LogWriter::text(const std::string& cut) const {
  return cut.empty() ? text_ : text_ + "# " + cut + "\n";
}

}  // namespace sparflow::plant
