#include "apps/cli/inspect/log_proposal.h"

#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/report/model_pages/proposal_page.h"
#include "identification/mapping_proposal/mapping_proposal.h"
#include "models/math/error.h"

namespace sparflow::cli {

void LogProposal::add_to(CLI::App& verb) {
  verb.add_option("-m,--machine", machine,
                  "machine file (YAML): propose which channel is which of its strokes, pressures, "
                  "commands, pumps")
      ->type_name("FILE");
  verb.add_flag(
      "--propose", propose,
      "say what the channels look like; without a machine by names, units and derivatives alone");
  verb.add_option("--write-mapping", write_mapping,
                  "write the proposed mapping (YAML) for --mapping of the other verbs; needs -m")
      ->type_name("FILE");
}

void LogProposal::check(const Outputs& outputs) const {
  if (machine.empty() && (!write_mapping.empty() || !outputs.report.empty())) {
    throw UsageError(
        fmt::format("log: {} needs -m MACHINE, because a mapping is proposed for a machine",
                    write_mapping.empty() ? "--report" : "--write-mapping"));
  }
  if (!write_mapping.empty()) check_writable(write_mapping);
}

std::vector<std::string> LogProposal::guesses(const TimedChannels& file) const {
  return propose && machine.empty() ? channel_guesses(file) : std::vector<std::string>{};
}

std::string LogProposal::run(const TimedChannels& file, const Outputs& outputs) const {
  if (machine.empty()) return "";
  const Machine parts = load_machine_with_warnings(machine);
  begin_work("proposing a mapping for " + parts.name);
  const MappingProposal proposal = propose_mapping(file, parts);
  if (!write_mapping.empty()) {
    write_file_atomically(write_mapping, mapping_yaml(proposal, parts));
    note(fmt::format("wrote {}; check it before you use it", write_mapping));
  }
  if (!outputs.report.empty())
    proposal_page(proposal, parts, file.recording.file).write(outputs.report);
  tell(proposal_table(proposal, parts));
  return proposal_json(proposal, parts);
}

}  // namespace sparflow::cli
