#include "diagnosis/extension/improve_round.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace sparflow {
namespace {

std::string part_name(int number) { return fmt::format("round {}", number); }

}  // namespace

std::optional<ImproveRound> round_of(const Journal* journal, int number) {
  const std::string* bytes = journal == nullptr ? nullptr : journal->find(part_name(number));
  if (bytes == nullptr) return std::nullopt;
  const nlohmann::json read = nlohmann::json::parse(*bytes);
  return ImproveRound{read.at("wanted"), read.at("removed"), read.at("notes")};
}

void keep_round(Journal* journal, int number, const ImproveRound& round) {
  if (journal == nullptr) return;
  const nlohmann::json written = {
      {"wanted", round.wanted}, {"removed", round.removed}, {"notes", round.notes}};
  journal->keep(part_name(number), written.dump());
}

}  // namespace sparflow
