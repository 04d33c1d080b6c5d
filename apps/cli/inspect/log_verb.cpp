#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/console.h"
#include "apps/cli/inspect/log_proposal.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "identification/mapping_proposal/channel_file.h"
#include "identification/mapping_proposal/channel_summary.h"
#include "identification/mapping_proposal/channel_words.h"

namespace sparflow::cli {
namespace {

struct LogArguments {
  std::string log;
  ChannelFileOptions reading;
  LogProposal proposal;
  Outputs outputs;
};

/// A number, or null where there is none.
nlohmann::json json_number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

/// @param guesses one for each channel, or none  @param proposal JSON, or ""
std::string channels_json(const TimedChannels& file, const std::vector<ChannelSummary>& channels,
                          const std::vector<std::string>& guesses, const std::string& proposal) {
  nlohmann::json out = {{"file", file.recording.file},
                        {"format", file.recording.format},
                        {"clock", file.clock_reason},
                        {"warnings", file.recording.warnings},
                        {"channels", nlohmann::json::array()}};
  for (const ChannelSummary& c : channels) {
    out["channels"].push_back({{"name", c.name},
                               {"unit", c.unit},
                               {"group", c.group},
                               {"comment", c.comment},
                               {"samples", c.samples},
                               {"duration_s", json_number(c.duration)},
                               {"rate_Hz", json_number(c.rate)},
                               {"missing_share", json_number(c.missing_share)},
                               {"gaps", c.gaps},
                               {"longest_gap_s", json_number(c.longest_gap)},
                               {"longest_gap_at_s", json_number(c.longest_gap_at)},
                               {"smallest", json_number(c.smallest)},
                               {"largest", json_number(c.largest)},
                               {"mean", json_number(c.mean)},
                               {"resolution", json_number(c.resolution)},
                               {"noise", json_number(c.noise)},
                               {"constant", c.constant}});
  }
  for (std::size_t k = 0; k < guesses.size(); ++k) out["channels"][k]["guess"] = guesses[k];
  if (!proposal.empty()) out["proposal"] = nlohmann::json::parse(proposal);
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

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
  std::vector<ChannelSummary> channels;
  channels.reserve(file.recording.channels.size());
  for (const RecordedChannel& channel : file.recording.channels) {
    channels.push_back(summarise(channel));
    ChannelSummary& summary = channels.back();
    if (summary.unit.empty()) summary.unit = channel_unit(channel.name, "").word;
  }
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
