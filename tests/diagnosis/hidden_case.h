#pragma once
/// Simulated logs with a hidden effect, in memory. The simulator shares no law with the catalogue.
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/log/log.h"
#include "models/files/machine_file.h"
#include "simulator/hidden_effects/hidden_effect.h"

namespace sparflow::testing_support {

inline Machine drawn_machine(const std::string& name) {
  return load_machine(SPARFLOW_SOURCE_DIR "/problems/machines/" + name + ".yaml");
}

struct HiddenCase {
  simulator::GeneratedCase logs;
  Log train, reference;
  Log test;  ///< warm oil, one payload, other motions

  double truth(const std::string& id, const std::string& parameter) const {
    for (const simulator::HiddenTruth& t : logs.train.truth) {
      if (t.id != id) continue;
      for (const simulator::HiddenParameter& p : t.parameters) {
        if (p.name == parameter) return p.equivalent;
      }
    }
    throw std::logic_error("no hidden " + id + " " + parameter);
  }
};

/// What is recorded of a machine.
struct Recording {
  std::uint64_t seed = 0;  ///< of the machine's parameters and of its motions
  double seconds = 0.0;    ///< of the suspect and of the reference log
  simulator::LogChannels channels = {};
  double test_seconds = 5.0;
};

inline HiddenCase hidden_case(const Machine& machine,
                              const std::vector<simulator::HiddenEffect>& effects,
                              const Recording& recording) {
  simulator::CaseRequest request;
  request.log.machine = machine;
  request.log.effects = effects;
  request.log.crane_seed = request.log.motion_seed = recording.seed;
  request.log.seconds = recording.seconds;
  request.log.channels = recording.channels;
  request.test_seconds = recording.test_seconds;
  HiddenCase c;
  c.logs = simulator::generate_case(request);
  c.train = log_from_text("train.csv", simulator::csv_text(c.logs.train), machine);
  c.reference = log_from_text("reference.csv", simulator::csv_text(c.logs.reference), machine);
  c.test = log_from_text("test.csv", simulator::csv_text(c.logs.test), machine);
  return c;
}

}  // namespace sparflow::testing_support
