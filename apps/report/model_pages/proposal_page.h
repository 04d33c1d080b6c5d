#pragma once
/// The page and the JSON of a proposed mapping (`sparflow log`).
#include <string>

#include "apps/report/page/page.h"
#include "identification/mapping_proposal/mapping_proposal.h"

namespace sparflow {

/// Tiles, the proposed mapping with what speaks for it, what is unsure, and what has no channel.
Page proposal_page(const MappingProposal& proposal, const Machine& machine, const std::string& log);

/// The same as JSON: an object for the key "proposal" (docs/commands.md).
std::string proposal_json(const MappingProposal& proposal, const Machine& machine);

}  // namespace sparflow
