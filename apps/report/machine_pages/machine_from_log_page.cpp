#include "apps/report/machine_pages/machine_from_log_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/files/model_file.h"
#include "models/machine/linkage_review.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Curves over time beyond which a page gets large.
/// @threshold [1] 1..200; cited: as many as a comparison's page has (compare_charts.cpp)
constexpr std::size_t kMostCurves = 40;
/// Rows further apart are not joined in a curve.
/// @threshold [s] 0.1..5; chosen: shorter than a rest between moves; rods that creep fall below the speed of judged rows
constexpr double kJoinedRows = 1.0;

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
  table.title = "Errors on these motions";
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

/// A value as the terminal shows it, without the part's name before it.
std::string mark_line(const FoundValue& v) {
  std::size_t from = v.name.find("].");
  from = from == std::string::npos ? v.name.find(": ") : from;
  const std::string what = from == std::string::npos ? v.name : v.name.substr(from + 2);
  const std::string interval =
      std::isfinite(v.half_width) ? fmt::format(" ± {:.2g}", v.half_width) : std::string();
  return fmt::format("{}: {:.5g}{} {}", what, v.value, interval, v.unit);
}

/// Draws the machine with a mark at each part that has values from the logs.
void add_drawing(Page& page, const Machine& machine, const std::vector<FoundValue>& values) {
  CraneDrawing drawing;
  std::vector<MarkedPlace> places;
  const auto add = [&](const MarkedPlace& place, const std::string& name) {
    DrawingMark mark{name, {}};
    for (const FoundValue& v : values) {
      if (v.cylinder == place.cylinder && v.link == place.link) mark.lines.push_back(mark_line(v));
    }
    if (mark.lines.empty()) return;
    places.push_back(place);
    drawing.marks.push_back(std::move(mark));
  };
  for (int i = 0; i < machine.cylinder_count(); ++i)
    add({i, -1}, "cylinder " + machine.cylinders[static_cast<std::size_t>(i)].name);
  for (int l = 0; l < static_cast<int>(machine.links.size()); ++l)
    add({-1, l}, "link " + machine.links[static_cast<std::size_t>(l)].name);
  drawing.title = "The machine, and what the logs told of it";
  drawing.note =
      "Marked: cylinders and centres of mass of links that have values from the logs, with 95 % "
      "intervals where the logs tell a value by itself. The slider moves one joint after another "
      "over its range.";
  const VectorXd posture = middle_posture(machine);
  const DrawingPlane plane = drawing_plane(machine, posture);
  drawing.x_axis = {plane.horizontal_name, "m"};
  drawing.z_axis = {plane.vertical_name, "m"};
  drawing.stills = 1;
  drawing.payload = false;
  const Trajectory motion = joint_sweep(machine, posture);
  drawing.frames = drawing_frames(machine, motion, joint_sweep_frames(motion), {}, places);
  page.plot(std::move(drawing));
}

/// Predicted against measured force of a cylinder, all logs together.
ScatterChart force_scatter(const HeldOutError& e, int color) {
  ScatterChart chart;
  chart.title = "Force of " + e.cylinder;
  chart.width = FigureWidth::kHalf;
  chart.x_axis = {"measured", "kN"};
  chart.y_axis = {"predicted", "kN"};
  chart.diagonal = true;
  ScatterGroup group{"moving, nearly steady rows", VectorXd(e.force_rows), VectorXd(e.force_rows),
                     color};
  Index at = 0;
  for (const HeldOutForces& f : e.forces) {
    group.x.segment(at, f.rows()) = f.measured / 1e3;
    group.y.segment(at, f.rows()) = f.predicted / 1e3;
    at += f.rows();
  }
  chart.groups.push_back(std::move(group));
  return chart;
}

/// Both forces over time; no line crosses a longer time without judged rows.
LineChart force_curves(const HeldOutError& e, const HeldOutForces& forces, int color) {
  const Index n = forces.rows();
  std::vector<double> time, measured, predicted;
  const auto append = [&](double t, double m, double p) {
    time.push_back(t);
    measured.push_back(m / 1e3);
    predicted.push_back(p / 1e3);
  };
  for (Index k = 0; k < n; ++k) {
    if (k > 0 && forces.time[k] - forces.time[k - 1] > kJoinedRows)
      append(0.5 * (forces.time[k] + forces.time[k - 1]), kNaN, kNaN);
    append(forces.time[k], forces.measured[k], forces.predicted[k]);
  }
  const auto vector = [](const std::vector<double>& v) {
    return VectorXd(VectorXd::Map(v.data(), static_cast<Index>(v.size())));
  };
  LineChart chart;
  chart.title = "Force of " + e.cylinder;
  chart.width = FigureWidth::kHalf;
  chart.group = forces.log;
  chart.y_axis = {"force", "kN"};
  chart.x = vector(time);
  chart.series = {{"measured", vector(measured), LineStyle::kMeasured, color, {}, {}},
                  {"predicted", vector(predicted), LineStyle::kPredicted, color, {}, {}}};
  return chart;
}

/// @param found held_out is in the order of the machine's cylinders, which is that of their colours
void add_held_out_charts(Page& page, const MachineFromLog& found) {
  std::vector<std::string> logs;
  for (std::size_t i = 0; i < found.held_out.size(); ++i) {
    const HeldOutError& e = found.held_out[i];
    if (e.forces.empty()) continue;
    page.plot(force_scatter(e, static_cast<int>(i)));
    for (const HeldOutForces& f : e.forces) {
      if (std::find(logs.begin(), logs.end(), f.log) == logs.end()) logs.push_back(f.log);
    }
  }
  std::size_t drawn = 0, left_out = 0;
  for (const std::string& log : logs) {
    if (drawn < kMostCurves) {
      page.section("Held-out motions of " + log);
      page.paragraph(
          "Moving, nearly steady rows over time; those more than 1 s apart are not joined.");
    }
    for (std::size_t i = 0; i < found.held_out.size(); ++i) {
      for (const HeldOutForces& f : found.held_out[i].forces) {
        if (f.log != log) continue;
        if (drawn == kMostCurves) {
          ++left_out;
          continue;
        }
        ++drawn;
        page.plot(force_curves(found.held_out[i], f, static_cast<int>(i)));
      }
    }
  }
  if (left_out > 0)
    page.paragraph(fmt::format("{} more charts are left out to keep the page small.", left_out));
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
  if (found.machine) add_drawing(page, *found.machine, found.values);
  add_values(page, "Values in the machine file", found.values);
  add_values(page, "Combinations of masses that the forces determine", found.combinations);
  add_values(page, "Friction, an effect beside the machine", found.friction);
  for (const std::string& note : found.notes) page.paragraph(note + ".");
  page.section("Motions that took no part in the estimate");
  add_held_out(page, found);
  add_held_out_charts(page, found);
  page.section("The machine file");
  page.details("Its text", found.text);
  page.provenance("program", std::string("sparflow ") + program_version());
  return page;
}

}  // namespace sparflow
