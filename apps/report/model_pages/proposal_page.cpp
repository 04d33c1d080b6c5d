#include "apps/report/model_pages/proposal_page.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "identification/comparison/report_numbers.h"
#include "identification/mapping_proposal/channel_words.h"
#include "models/files/model_file.h"

namespace sparflow {
namespace {

Table meanings_table(const MappingProposal& p, const Machine& machine, bool sure) {
  Table table;
  table.columns = {
      {"channel"},           {"meaning"}, {"column"}, {"expression"}, {"confidence", "%", 3},
      {"what speaks for it"}};
  if (!sure) table.columns.push_back({"or"});
  for (const MeaningProposal& m : p.meanings) {
    if (m.channel < 0 || p.sure(m) != sure) continue;
    std::vector<TableCell> row = {m.channel_name,
                                  meaning_words(m.meaning, machine),
                                  m.column.empty() ? "computed by the program" : m.column,
                                  m.expression,
                                  100.0 * m.confidence,
                                  fmt::format("{}", fmt::join(m.reasons, "; "))};
    if (!sure) row.push_back(m.other);
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string missing_words(const MappingProposal& p, const Machine& machine) {
  std::string words;
  for (const MeaningProposal& m : p.meanings) {
    if (m.channel >= 0) continue;
    words += fmt::format("{}{}{}", words.empty() ? "" : ", ", meaning_words(m.meaning, machine),
                         m.required ? " (required)" : "");
  }
  return words;
}

}  // namespace

Page proposal_page(const MappingProposal& p, const Machine& machine, const std::string& log) {
  Page page("Channels of " + log);
  page.subtitle("proposed mapping for " + machine.name);
  int sure = 0, unsure = 0, missing = 0;
  for (const MeaningProposal& m : p.meanings) {
    if (m.channel < 0) {
      ++missing;
    } else if (p.sure(m)) {
      ++sure;
    } else {
      ++unsure;
    }
  }
  page.verdict(unsure == 0 ? Tone::kNeutral : Tone::kWarning,
               fmt::format("{} channels have a meaning, {} are unsure", sure, unsure),
               "A proposal by names, units and physics. Nothing uses it before you do.");
  page.tiles({{fmt::format("{}", sure), "", "meanings proposed", ""},
              {fmt::format("{}", unsure), "", "unsure",
               fmt::format("confidence below {:.0f} %", 100.0 * p.unsure_below)},
              {fmt::format("{}", missing), "", "meanings without a channel", ""},
              {fmt::format("{}", p.left_over.size()), "", "channels without a meaning", ""}});
  page.section("Proposed mapping");
  page.table(meanings_table(p, machine, true));
  if (unsure > 0) {
    page.section("Unsure");
    Table table = meanings_table(p, machine, false);
    table.note = "These stand in the written mapping as comments.";
    page.table(table);
  }
  page.section("What is left");
  page.paragraph("Meanings without a channel: " +
                 (missing > 0 ? missing_words(p, machine) : std::string("none")) + ".");
  page.paragraph("Channels without a meaning: " +
                 (p.left_over.empty() ? std::string("none")
                                      : fmt::format("{}", fmt::join(p.left_over, ", "))) +
                 ".");
  for (const std::string& note : p.notes) page.paragraph(note + ".");
  page.details("Mapping file", mapping_yaml(p, machine));
  page.provenance("log", log);
  page.provenance("program", program_version());
  return page;
}

std::string proposal_json(const MappingProposal& p, const Machine& machine) {
  nlohmann::json out = {{"machine", machine.name},
                        {"unsure_below", p.unsure_below},
                        {"meanings", nlohmann::json::array()},
                        {"channels_without_meaning", p.left_over},
                        {"notes", p.notes}};
  for (const MeaningProposal& m : p.meanings) {
    nlohmann::json row = {{"meaning", meaning_words(m.meaning, machine)},
                          {"column", m.column},
                          {"required", m.required},
                          {"channel", nullptr}};
    if (m.channel >= 0) {
      row["channel"] = m.channel_name;
      row["expression"] = m.expression;
      row["confidence"] = m.confidence;
      row["margin_nat"] = m.margin;
      row["sure"] = p.sure(m);
      row["reasons"] = m.reasons;
      row["other"] = m.other.empty() ? nlohmann::json(nullptr) : nlohmann::json(m.other);
    }
    out["meanings"].push_back(std::move(row));
  }
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<ChannelSummary> summaries(const TimedChannels& file) {
  std::vector<ChannelSummary> channels;
  channels.reserve(file.recording.channels.size());
  for (const RecordedChannel& channel : file.recording.channels) {
    channels.push_back(summarise(channel));
    ChannelSummary& summary = channels.back();
    if (summary.unit.empty()) summary.unit = channel_unit(channel.name, "").word;
  }
  return channels;
}

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

}  // namespace sparflow
