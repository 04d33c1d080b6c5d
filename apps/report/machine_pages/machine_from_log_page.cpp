#include "apps/report/machine_pages/machine_from_log_page.h"

#include <fmt/format.h>

#include <cmath>

#include "models/files/model_file.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

void add_values(Page& page, const std::string& title, const std::vector<FoundValue>& values) {
  if (values.empty()) return;
  Table table;
  table.title = title;
  table.columns = {{"value"}, {"found", "", 5}, {"± (95 %)", "", 2}, {"unit"}, {"from"}, {""}};
  table.rows.reserve(values.size());
  for (const FoundValue& v : values)
    table.rows.push_back({v.name, v.value, v.half_width, v.unit, v.source, v.remark});
  page.table(std::move(table));
}

void add_held_out(Page& page, const MachineFromLog& found) {
  Table table;
  table.title = "Motions that took no part in the estimate";
  table.columns = {{"cylinder"},
                   {"force error", "kN", 3},
                   {"of static force alone", "kN", 3},
                   {"force varies by", "kN", 3},
                   {"rows"},
                   {"stroke error", "mm", 3},
                   {"rows"}};
  for (const HeldOutError& e : found.held_out) {
    table.rows.push_back({e.cylinder, e.force_rmse / 1e3, e.force_static / 1e3,
                          e.force_variation / 1e3, static_cast<double>(e.force_rows),
                          1e3 * e.stroke_rmse, static_cast<double>(e.stroke_rows)});
  }
  table.note =
      "Root mean squares. Force error: measured minus static force and the friction found, of "
      "moving "
      "and nearly steady rows.";
  page.table(std::move(table));
}

}  // namespace

Page machine_from_log_page(const MachineFromLog& found) {
  Page page("Machine from logs: " + found.name);
  const Tone tone = !found.complete()        ? Tone::kBad
                    : found.warnings.empty() ? Tone::kGood
                                             : Tone::kWarning;
  page.verdict(tone, machine_from_log_headline(found),
               found.warnings.empty() ? "Every value states what it came from."
                                      : fmt::format("{}", fmt::join(found.warnings, ". ")));
  if (!found.questions.empty()) {
    Table table;
    table.title = "Questions: what these logs do not determine";
    table.columns = {{"value"}, {"why, and what would answer it"}};
    for (const MachineQuestion& q : found.questions) table.rows.push_back({q.path, q.sentence});
    page.table(std::move(table));
  }
  add_values(page, "Values in the machine file", found.values);
  add_values(page, "Combinations of masses that the forces determine", found.combinations);
  add_values(page, "Friction, an effect beside the machine", found.friction);
  add_held_out(page, found);
  for (const std::string& note : found.notes) page.paragraph(note + ".");
  page.details("The machine file", found.text);
  page.provenance("program", std::string("sparflow ") + program_version());
  return page;
}

}  // namespace sparflow
