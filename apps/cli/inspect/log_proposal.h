#pragma once
/// The part of `sparflow log` that proposes which channel is what.
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "apps/cli/outputs.h"
#include "identification/mapping_proposal/channel_file.h"

namespace sparflow::cli {

struct LogProposal {
  std::string machine;        ///< machine file, "" = none
  std::string write_mapping;  ///< mapping file to write, "" = none
  bool propose = false;

  void add_to(CLI::App& verb);
  /// Checks before any long work. @throws UsageError for options that need --machine
  void check(const Outputs& outputs) const;
  /// Prints the proposal and writes its files. @return JSON for the key "proposal", "" when none is asked for
  /// @throws InputError
  std::string run(const TimedChannels& file, const Outputs& outputs) const;
  /// One sentence for each channel by name, unit and derivatives; empty unless asked for without a machine.
  std::vector<std::string> guesses(const TimedChannels& file) const;
};

}  // namespace sparflow::cli
