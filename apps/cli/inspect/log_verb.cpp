#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/inspect/log_proposal.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/proposal_page.h"
#include "identification/mapping_proposal/channel_file.h"
#include "identification/mapping_proposal/channel_summary.h"

namespace sparflow::cli {
namespace {

struct LogArguments {
  std::string log;
  ChannelFileOptions reading;
  LogProposal proposal;
  Outputs outputs;
};

int run(const LogArguments& a) {
  std::vector<NamedFile> inputs = {
      {"FILE", a.log}, {"--mapping", a.reading.mapping_file}, {"--machine", a.proposal.machine}};
  inputs.reserve(inputs.size() + a.reading.dbc_files.size());
  for (const std::string& dbc : a.reading.dbc_files) inputs.push_back({"--dbc", dbc});
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--write-mapping", a.proposal.write_mapping});
  check_outputs_apart("log", outputs, inputs);
  a.proposal.check(a.outputs);
  a.outputs.check();
  begin_work("reading " + a.log);
  const TimedChannels file = read_timed_channels(a.log, a.reading);
  const std::vector<ChannelSummary> channels = summaries(file);
  for (const std::string& w : file.recording.warnings) warn(w);
  const std::vector<std::string> guesses = a.proposal.guesses(file);
  tell(fmt::format("{}: {}; {} channels\n  {}\n{}", file.recording.file, file.recording.format,
                   channels.size(), file.clock_reason, summary_table(channels)));
  for (std::size_t k = 0; k < guesses.size(); ++k) {
    if (!guesses[k].empty()) tell(fmt::format("  {} {}\n", channels[k].name, guesses[k]));
  }
  const std::string proposal = a.proposal.run(file, a.outputs);
  if (!a.outputs.json.empty())
    a.outputs.write_json(channels_json(file, channels, guesses, proposal));
  return kDone;
}

}  // namespace

void add_log_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<LogArguments>();
  CLI::App* verb =
      app.add_subcommand("log",
                         "list the channels of a log: unit, rate, range, gaps, resolution and "
                         "noise; with a machine, propose their mapping");
  verb->add_option("log", a->log, "log (CSV, MAT, or a recording)")->required()->type_name("FILE");
  verb->add_option("--mapping", a->reading.mapping_file,
                   "mapping file (YAML); the columns then bear the program's names")
      ->type_name("FILE");
  verb->add_option("--dbc", a->reading.dbc_files,
                   "database that decodes CAN frames; may be given several times")
      ->type_name("FILE.dbc");
  a->proposal.add_to(*verb);
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
