#pragma once
/// The page and the JSON of a proposed mapping (`sparflow log`).
#include <string>
#include <vector>

#include "apps/report/page/page.h"
#include "identification/mapping_proposal/channel_summary.h"
#include "identification/mapping_proposal/mapping_proposal.h"

namespace sparflow {

/// Tiles, the proposed mapping with what speaks for it, what is unsure, and what has no channel.
Page proposal_page(const MappingProposal& proposal, const Machine& machine, const std::string& log);

/// The same as JSON: an object for the key "proposal" (docs/commands.md).
std::string proposal_json(const MappingProposal& proposal, const Machine& machine);

/// What each channel of a log looks like; its unit is that of the file, else the one that its name ends with.
std::vector<ChannelSummary> summaries(const TimedChannels& file);

/// What `sparflow log --json` writes. @param guesses one for each channel, or none  @param proposal JSON, or ""
std::string channels_json(const TimedChannels& file, const std::vector<ChannelSummary>& channels,
                          const std::vector<std::string>& guesses, const std::string& proposal);

}  // namespace sparflow
