#pragma once
/// Machines, models, logs and the user's own effects, read with their warnings on stderr.
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "identification/log/log.h"
#include "models/chain/crane_model.h"

namespace sparflow::cli {

/// Option --effects: files with effects of the user's own (docs/user_effects.md).
struct OwnEffects {
  std::vector<std::string> files;
  void add_to(CLI::App& verb);
  /// Registers them in the catalogue. @param machine against which their joints and units are checked; may be null
  /// @throws InputError
  std::vector<const Effect*> load(const Machine* machine) const;
  /// Registers them and adds them to the model, whose file then stores them. @throws InputError
  void load_into(CraneModel& model) const;
};

/// Reads a machine file and prints warnings about unusual values on stderr. @throws InputError
Machine load_machine_with_warnings(const std::string& path);
/// Reads a model file and prints the same warnings about its machine. @throws InputError
CraneModel load_model_with_warnings(const std::string& path);

/// Reads the logs and prints their warnings on stderr. @param mapping path of a mapping file, or empty
std::vector<Log> load_logs(const std::vector<std::string>& paths, const Machine& machine,
                           const std::string& mapping);

}  // namespace sparflow::cli
