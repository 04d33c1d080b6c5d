// Writes what logs told about a machine: a screen of text, a sentence, JSON.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "identification/machine_from_log/machine_from_log.h"

namespace sparflow {
namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson finite_or_null(double value) {
  return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr);
}

OrderedJson values_json(const std::vector<FoundValue>& values) {
  OrderedJson list = OrderedJson::array();
  for (const FoundValue& v : values) {
    OrderedJson one = {{"name", v.name}, {"value", finite_or_null(v.value)}, {"unit", v.unit}};
    one["ci95"] = std::isfinite(v.half_width)
                      ? OrderedJson({v.value - v.half_width, v.value + v.half_width})
                      : OrderedJson(nullptr);
    one["source"] = v.source;
    if (!v.remark.empty()) one["remark"] = v.remark;
    list.push_back(std::move(one));
  }
  return list;
}

std::string value_lines(const std::string& heading, const std::vector<FoundValue>& values) {
  if (values.empty()) return "";
  std::string text = heading + "\n";
  for (const FoundValue& v : values) {
    const std::string interval =
        std::isfinite(v.half_width) ? fmt::format(" ± {:.2g}", v.half_width) : "";
    text += fmt::format("  {}: {:.5g}{} {}  ({}{}{})\n", v.name, v.value, interval, v.unit,
                        v.source, v.remark.empty() ? "" : "; ", v.remark);
  }
  return text;
}

std::string held_out_lines(const std::vector<HeldOutError>& errors) {
  std::string text = fmt::format("{:<14}{:>12}{:>14}{:>16}{:>10}{:>13}\n", "held out", "force [N]",
                                 "static [N]", "variation [N]", "rows", "stroke [mm]");
  const auto cell = [](double value, int digits) {
    return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string("-");
  };
  for (const HeldOutError& e : errors) {
    text += fmt::format("  {:<12}{:>12}{:>14}{:>16}{:>10}{:>13}\n", e.cylinder,
                        cell(e.force_rmse, 0), cell(e.force_static, 0), cell(e.force_variation, 0),
                        e.force_rows, cell(1e3 * e.stroke_rmse, 2));
  }
  return text +
         "  force: measured minus static force, inertia and friction, RMS; static: minus static "
         "force alone\n";
}

}  // namespace

std::string machine_from_log_headline(const MachineFromLog& found) {
  if (found.complete()) {
    return fmt::format("{}: the machine is complete, {} value{} from the logs", found.name,
                       found.values.size(), found.values.size() == 1 ? "" : "s");
  }
  return fmt::format("{}: {} question{} before the machine is complete", found.name,
                     found.questions.size(), found.questions.size() == 1 ? "" : "s");
}

std::string machine_from_log_table(const MachineFromLog& found) {
  std::string text = machine_from_log_headline(found) + "\n";
  text += value_lines("values, with 95 % intervals", found.values);
  text += value_lines("combinations of masses that the forces determine", found.combinations);
  text += value_lines("friction (an effect: `diagnose` and `extend` add it to a model)",
                      found.friction);
  text += held_out_lines(found.held_out);
  for (const std::string& note : found.notes) text += fmt::format("note: {}\n", note);
  for (const MachineQuestion& q : found.questions)
    text += fmt::format("open: {}: {}\n", q.path, q.sentence);
  return text;
}

std::string machine_from_log_json(const MachineFromLog& found) {
  OrderedJson out = {{"machine", found.name},
                     {"complete", found.complete()},
                     {"headline", machine_from_log_headline(found)},
                     {"values", values_json(found.values)},
                     {"combinations", values_json(found.combinations)},
                     {"friction", values_json(found.friction)},
                     {"questions", OrderedJson::array()},
                     {"held_out", OrderedJson::array()},
                     {"notes", found.notes},
                     {"warnings", found.warnings}};
  for (const MachineQuestion& q : found.questions)
    out["questions"].push_back({{"path", q.path}, {"question", q.sentence}});
  for (const HeldOutError& e : found.held_out) {
    out["held_out"].push_back({{"cylinder", e.cylinder},
                               {"force_rmse_N", finite_or_null(e.force_rmse)},
                               {"force_static_rmse_N", finite_or_null(e.force_static)},
                               {"force_variation_N", finite_or_null(e.force_variation)},
                               {"force_rows", e.force_rows},
                               {"stroke_rmse_m", finite_or_null(e.stroke_rmse)},
                               {"stroke_rows", e.stroke_rows}});
  }
  return out.dump(2, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

}  // namespace sparflow
