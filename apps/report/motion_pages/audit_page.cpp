#include "apps/report/motion_pages/audit_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "apps/report/motion_pages/motion_page.h"
#include "models/files/model_file.h"

namespace sparflow {
namespace {

using Eigen::Index;
using nlohmann::json;

constexpr double kJoulesPerKWh = 3.6e6;
constexpr double kLitresPerCubicMetre = 1e3;
/// Moves that are listed and drawn.
constexpr std::size_t kDrawn = 10;

json number(double v) { return std::isfinite(v) ? json(v) : json(nullptr); }

/// Share of a motion's moving time in which several cylinders move.
double overlap(const MotionEnergy& e) {
  if (e.share_moving.size() < 2) return 0.0;
  const double several = std::accumulate(e.share_moving.begin() + 2, e.share_moving.end(), 0.0);
  const double any = several + e.share_moving[1];
  return any > 0.0 ? several / any : 0.0;
}

std::string name_of(const AuditedMove& m) {
  return fmt::format("{}, {:.1f} to {:.1f} s", m.log, m.from, m.to);
}

/// Where most of a saving arises, in words.
std::string reason(const Machine& machine, const MoveAudit& a) {
  if (a.saving() <= 0.0) return "nothing to save";
  std::string words = a.by_way >= a.by_pace ? "way and overlap of the cylinders" : "uneven pace";
  std::size_t at = 0;
  double most = 0.0;
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    const double less = a.recorded.throttling[i] - a.optimum.throttling[i];
    if (less > most) {
      most = less;
      at = i;
    }
  }
  if (most > 0.0)
    words +=
        fmt::format("; {:.1f} kJ less throttling at {}", most / 1e3, machine.cylinders[at].name);
  return words;
}

std::string energy_words(const AuditResult& result, double joules) {
  std::string words = fmt::format("{:.1f} kJ", joules / 1e3);
  /// @threshold [J] 0..1e9; chosen: a fifth of a kWh
  constexpr double kTellKWh = 0.72e6;
  if (joules >= kTellKWh) words += fmt::format(" ({:.2f} kWh)", joules / kJoulesPerKWh);
  if (result.litres_per_kWh > 0.0)
    words +=
        fmt::format(" ({:.3g} litres of fuel)", joules / kJoulesPerKWh * result.litres_per_kWh);
  return words;
}

std::string headline(const AuditResult& result, const AuditSums& s) {
  if (s.judged == 0) return fmt::format("None of {} moves could be judged", result.moves.size());
  return fmt::format("{} of {} moves judged: of {} the optimum in the same time saves {}, {:.0f} %",
                     s.judged, result.moves.size(), energy_words(result, s.recorded),
                     energy_words(result, s.saving()),
                     100.0 * s.saving() / std::max(s.recorded, 1e-9));
}

std::string explanation(const AuditResult& result, const AuditSums& s) {
  std::string text = fmt::format(
      "The saving's standard deviation from the pressure models is {:.1f} kJ. {:.1f} kJ of it "
      "arise "
      "from the pace along the way, {:.1f} kJ from way and overlap of the cylinders.",
      std::sqrt(s.variance) / 1e3, s.by_pace / 1e3, s.by_way / 1e3);
  if (s.by_posture > 0.0)
    text += fmt::format(
        " Another posture at the end of a move, with the tip at the same place, would save a "
        "further "
        "{:.1f} kJ at most and leave {:.1f} kJ {} potential energy for the next move.",
        s.by_posture / 1e3, std::abs(s.by_posture_potential) / 1e3,
        s.by_posture_potential > 0.0 ? "less" : "more");
  if (std::isfinite(s.measured) && s.measured > 0.0)
    text += fmt::format(" The model's energy of the recorded moves is {:+.1f} % off the measured.",
                        100.0 * (s.recorded / s.measured - 1.0));
  text += fmt::format(" No cylinder moves in {:.0f} of {:.0f} s.", result.at_rest, result.seconds);
  if (!result.engine_map) return text;
  if (std::isfinite(result.fuel))
    text += fmt::format(
        " By the map of engine and pump the logs took {:.3g} litres of fuel, {:.3g} of them while "
        "no "
        "cylinder moved.",
        result.fuel * kLitresPerCubicMetre, result.fuel_at_rest * kLitresPerCubicMetre);
  text +=
      fmt::format(" The judged moves take {:.3g} litres by the model, the optimum {:.3g}.",
                  s.fuel_recorded * kLitresPerCubicMetre, s.fuel_optimum * kLitresPerCubicMetre);
  return text;
}

Table table_of_causes(const Machine& machine, const AuditSums& s) {
  Table table;
  table.title = "Where the difference arises";
  table.note =
      "Recorded less optimum, over all judged moves, by the model. The first two rows add up to "
      "the "
      "saving, and so do the rows of the cylinders together: work on a cylinder that the optimum "
      "does "
      "not do (a way up and down again), and pressure lost in its valve.";
  table.columns = {{"cause"}, {"energy", "kJ", 4}, {"of the saving", "%", 3}};
  const auto add = [&](const std::string& what, double joules) {
    table.rows.push_back({what, joules / 1e3, 100.0 * joules / s.saving()});
  };
  add("uneven pace along the recorded way", s.by_pace);
  add("way and overlap of the cylinders", s.by_way);
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    add("throttling at " + machine.cylinders[i].name, s.throttling[i]);
    add("work on " + machine.cylinders[i].name, s.useful[i]);
  }
  return table;
}

Table table_of_moves(const AuditResult& result) {
  Table table;
  table.title = "All moves";
  table.note =
      "Measured: logged pump pressure times the flows of the measured speeds. Model: the same "
      "motion "
      "by the model. Saving: model less optimum, with one standard deviation of the pressure "
      "models. "
      "Overlap: share of the moving time in which several cylinders move.";
  table.columns = {{"", "", 3},
                   {"move"},
                   {"measured", "kJ", 4},
                   {"model", "kJ", 4},
                   {"optimum", "kJ", 4},
                   {"bound", "kJ", 4},
                   {"saving", "%", 3},
                   {"std", "%", 2},
                   {"overlap", "%", 2},
                   {"optimum's", "%", 2},
                   {"remark"}};
  const double none = std::nan("");
  for (const AuditedMove& m : result.moves) {
    const MoveAudit& a = m.audit;
    const bool j = a.judged();
    const double share = 100.0 / std::max(a.recorded.total, 1e-9);
    table.rows.push_back({static_cast<double>(table.rows.size() + 1), name_of(m), m.measured / 1e3,
                          a.recorded.total > 0.0 ? a.recorded.total / 1e3 : none,
                          j ? a.optimum.total / 1e3 : none, m.bound / 1e3,
                          j ? share * a.saving() : none, j ? share * a.saving_std() : none,
                          j ? 100.0 * overlap(a.recorded) : none,
                          j ? 100.0 * overlap(a.optimum) : none, a.not_judged});
  }
  return table;
}

/// Energies of the moves worth changing first.
BarChart bars(const AuditResult& result) {
  BarChart chart;
  chart.title = "The moves worth changing first";
  chart.note = "By the model, with the same time, payload, start and end.";
  chart.value_axis = {"energy", "kJ"};
  chart.stacked = false;
  const std::vector<std::size_t> order = result.by_saving();
  const auto n = static_cast<Index>(std::min(order.size(), kDrawn));
  Eigen::VectorXd recorded(n), optimum(n);
  for (Index k = 0; k < n; ++k) {
    const AuditedMove& m = result.moves[order[static_cast<std::size_t>(k)]];
    chart.categories.push_back(fmt::format("{:.1f} s", m.from));
    recorded[k] = m.audit.recorded.total / 1e3;
    optimum[k] = m.audit.optimum.total / 1e3;
  }
  chart.series = {{"recorded", recorded}, {"optimum", optimum}};
  return chart;
}

void draw_move(Page& page, const Machine& machine, const AuditedMove& m) {
  const MoveAudit& a = m.audit;
  page.section(name_of(m));
  page.paragraph(
      fmt::format("{:.0f} kg, {:.1f} s. The recorded motion takes {:.1f} kJ by the model, the "
                  "optimum {:.1f} kJ: "
                  "{:.1f} kJ less (\u00b1 {:.1f}). Mostly: {}.",
                  m.payload, m.to - m.from, a.recorded.total / 1e3, a.optimum.total / 1e3,
                  a.saving() / 1e3, a.saving_std() / 1e3, reason(machine, a)));
  add_views(page, machine, a.problem, a.best, {{"the recorded motion", m.recorded}});
}

}  // namespace

std::vector<std::size_t> AuditResult::by_saving() const {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < moves.size(); ++i)
    if (moves[i].audit.judged()) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return moves[a].audit.saving() > moves[b].audit.saving();
  });
  return order;
}

AuditSums sums_of(const Machine& machine, const AuditResult& result) {
  AuditSums s;
  s.throttling.assign(machine.cylinders.size(), 0.0);
  s.useful.assign(machine.cylinders.size(), 0.0);
  for (const AuditedMove& m : result.moves) {
    const MoveAudit& a = m.audit;
    if (!a.judged()) continue;
    ++s.judged;
    s.recorded += a.recorded.total;
    s.optimum += a.optimum.total;
    s.variance += a.saving_std() * a.saving_std();
    s.by_pace += a.by_pace;
    s.by_way += a.by_way;
    s.by_posture += a.by_posture;
    s.by_posture_potential += a.by_posture_potential;
    s.measured += m.measured;
    s.fuel_recorded += m.fuel_recorded;
    s.fuel_optimum += m.fuel_optimum;
    for (std::size_t i = 0; i < s.useful.size(); ++i) {
      s.throttling[i] += a.recorded.throttling[i] - a.optimum.throttling[i];
      s.useful[i] += a.recorded.useful[i] - a.optimum.useful[i];
    }
  }
  return s;
}

std::string audit_json(const CraneModel& model, const AuditResult& result) {
  const Machine& machine = model.machine;
  const AuditSums s = sums_of(machine, result);
  const auto by_cylinder = [&](const std::vector<double>& values) {
    json out = json::object();
    for (std::size_t i = 0; i < values.size(); ++i) out[machine.cylinders[i].name] = values[i];
    return out;
  };
  json out = {{"machine", machine.name},
              {"headline", headline(result, s)},
              {"interrupted", result.interrupted},
              {"seconds", result.seconds},
              {"at_rest_s", result.at_rest},
              {"not_examined", result.not_examined},
              {"notes", result.notes}};
  out["total"] = {{"moves", result.moves.size()},
                  {"judged", s.judged},
                  {"measured_J", number(s.measured)},
                  {"model_J", s.recorded},
                  {"optimum_J", s.optimum},
                  {"saving_J", s.saving()},
                  {"saving_std_J", std::sqrt(s.variance)},
                  {"saving_kWh", s.saving() / kJoulesPerKWh},
                  {"by", {{"pace", s.by_pace}, {"way", s.by_way}}},
                  {"end_posture_J", s.by_posture},
                  {"end_posture_potential_J", s.by_posture_potential},
                  {"throttling_J", by_cylinder(s.throttling)},
                  {"work_J", by_cylinder(s.useful)}};
  if (result.litres_per_kWh > 0.0)
    out["total"]["saving_litres"] = s.saving() / kJoulesPerKWh * result.litres_per_kWh;
  if (result.engine_map) {
    out["fuel_litres"] = number(result.fuel * kLitresPerCubicMetre);
    out["fuel_at_rest_litres"] = number(result.fuel_at_rest * kLitresPerCubicMetre);
    out["total"]["model_litres"] = s.fuel_recorded * kLitresPerCubicMetre;
    out["total"]["optimum_litres"] = s.fuel_optimum * kLitresPerCubicMetre;
    out["total"]["saving_litres"] = (s.fuel_recorded - s.fuel_optimum) * kLitresPerCubicMetre;
  }
  out["moves"] = json::array();
  for (const AuditedMove& m : result.moves) {
    const MoveAudit& a = m.audit;
    json move = {{"log", m.log},
                 {"t_s", {m.from, m.to}},
                 {"payload_kg", m.payload},
                 {"measured_J", number(m.measured)},
                 {"model_J", a.recorded.total},
                 {"outside_data", a.recorded.moving_share_outside_data},
                 {"judged", a.judged()}};
    if (a.judged()) {
      move["optimum_J"] = a.optimum.total;
      move["bound_J"] = number(m.bound);
      move["saving_J"] = a.saving();
      move["saving_std_J"] = a.saving_std();
      move["by"] = {{"pace", a.by_pace}, {"way", a.by_way}};
      if (result.engine_map) {
        move["model_litres"] = m.fuel_recorded * kLitresPerCubicMetre;
        move["optimum_litres"] = m.fuel_optimum * kLitresPerCubicMetre;
      }
      move["end_posture_J"] = a.by_posture;
      move["end_posture_potential_J"] = a.by_posture_potential;
      move["overlap"] = {{"recorded", overlap(a.recorded)}, {"optimum", overlap(a.optimum)}};
    } else {
      move["reason"] = a.not_judged;
    }
    out["moves"].push_back(std::move(move));
  }
  return out.dump(2);
}

std::string audit_table(const CraneModel& model, const AuditResult& result) {
  const AuditSums s = sums_of(model.machine, result);
  std::string text = headline(result, s) + ".\n";
  if (s.judged > 0) text += explanation(result, s) + "\n";
  std::size_t wide = 0;
  for (const AuditedMove& m : result.moves) wide = std::max(wide, name_of(m).size());
  text += fmt::format("\n{:<{}} {:>9} {:>9} {:>9} {:>16}  {}\n", "move", wide, "measured", "model",
                      "optimum", "saving", "mostly");
  text += fmt::format("{:<{}} {:>9} {:>9} {:>9} {:>16}\n", "", wide, "kJ", "kJ", "kJ", "kJ");
  std::size_t shown = 0;
  for (const std::size_t i : result.by_saving()) {
    if (++shown > kDrawn) break;
    const AuditedMove& m = result.moves[i];
    const MoveAudit& a = m.audit;
    text +=
        fmt::format("{:<{}} {:>9} {:>9.1f} {:>9.1f} {:>8.1f} \u00b1 {:>5.1f}  {}\n", name_of(m),
                    wide, std::isfinite(m.measured) ? fmt::format("{:.1f}", m.measured / 1e3) : "-",
                    a.recorded.total / 1e3, a.optimum.total / 1e3, a.saving() / 1e3,
                    a.saving_std() / 1e3, reason(model.machine, a));
  }
  shown = 0;
  for (const AuditedMove& m : result.moves) {
    if (m.audit.judged()) continue;
    if (++shown > kDrawn) continue;
    text += fmt::format("not judged: {}: {}\n", name_of(m), m.audit.not_judged);
  }
  if (shown > kDrawn)
    text += fmt::format("and {} more; --json and --report have all\n", shown - kDrawn);
  if (result.not_examined > 0)
    text +=
        fmt::format("{} further moves with less way were not examined; --moves asks for more.\n",
                    result.not_examined);
  for (const std::string& n : result.notes) text += n + "\n";
  return text;
}

Page audit_page(const CraneModel& model, const AuditResult& result) {
  const Machine& machine = model.machine;
  const AuditSums s = sums_of(machine, result);
  Page page("Audit: " + machine.name);
  page.subtitle(
      "Each recorded move beside the energy-optimal motion from its start to its posture at the "
      "end, in the same time and with the same payload");
  if (result.interrupted)
    page.banner("Interrupted: the moves that were not examined are left out.");
  page.verdict(s.judged > 0 ? Tone::kNeutral : Tone::kWarning, headline(result, s),
               s.judged > 0 ? explanation(result, s) : std::string());
  if (s.judged > 0) {
    const double share = 100.0 * s.saving() / std::max(s.recorded, 1e-9);
    page.tiles(
        {{display_number(s.recorded / 1e3, 4), "kJ", "energy of the judged moves", "by the model"},
         {display_number(s.saving() / 1e3, 3), "kJ", "saved by the optimum",
          fmt::format("\u00b1 {:.1f} kJ, {:.0f} %", std::sqrt(s.variance) / 1e3, share)},
         {display_number(100.0 * result.at_rest / std::max(result.seconds, 1e-9), 3), "%",
          "of the time no cylinder moves"}});
    page.plot(bars(result));
    page.table(table_of_causes(machine, s));
  }
  page.table(table_of_moves(result));
  for (const std::string& n : result.notes) page.paragraph(n);
  const std::vector<std::size_t> order = result.by_saving();
  for (std::size_t k = 0; k < std::min(order.size(), kDrawn); ++k)
    draw_move(page, machine, result.moves[order[k]]);
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("machine", machine.name);
  for (const DataSource& d : model.data)
    page.provenance(d.use + " log", d.file + ", sha256 " + d.sha256.substr(0, 16));
  return page;
}

}  // namespace sparflow
