#include "identification/machine_from_log/area_answers.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace sparflow::from_log {
namespace {

// Diameters that are made: ISO 3320:2013 and, below it, DIN 24554. [mm]
constexpr double kBores[] = {25,  32,  40,  50,  63,  80,  90,  100, 110,
                             125, 140, 160, 180, 200, 220, 250, 280, 320};
constexpr double kRods[] = {12, 14, 16, 18, 20, 22,  25,  28,  32,  36,  40,  45,  50,
                            56, 63, 70, 80, 90, 100, 110, 125, 140, 160, 180, 200, 220};

/// A standard diameter inside the interval, as a remark: what was measured stays.
template <std::size_t N>
std::string standard_remark(const double (&list)[N], double value, double half, const char* word) {
  double nearest = list[0] * 1e-3;
  for (const double d : list) {
    if (std::abs(1e-3 * d - value) < std::abs(nearest - value)) nearest = 1e-3 * d;
  }
  if (std::abs(nearest - value) > half) return "";
  return fmt::format("nearest {} of ISO 3320 in the interval: {:g} m", word, nearest);
}

std::string payload_words(const SketchRows& rows) {
  if (!rows.payload_logged) return "the payload is not logged";
  double lo = INFINITY, hi = -INFINITY;
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    if (rows.held_out[k] || !std::isfinite(rows.payload[k])) continue;
    lo = std::min(lo, rows.payload[k]);
    hi = std::max(hi, rows.payload[k]);
  }
  if (hi - lo > 1e-6) return fmt::format("the payload ({:g} to {:g} kg) does not load it", lo, hi);
  return fmt::format("the payload does not change ({:g} kg)", hi);
}

/// Why an area is not known at all.
std::string why_not(const Known& known, int i, const LoadRows& load, const std::string& obstacle) {
  const Machine& machine = known.machine;
  const SketchRows& rows = known.rows;
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(i)];
  const CylinderRows& measured = rows.cylinders[static_cast<std::size_t>(i)];
  const bool pressures = measured.pressure_a.size() > 0 && measured.pressure_b.size() > 0;
  if (load.load_cell)
    return fmt::format(
        "the logs have the force of {0} itself, which tells no area, and no measured "
        "flow (Q_{0}_lpm); give it",
        c.name);
  if (!pressures) {
    return fmt::format(
        "the logs do not have both pressures of {0} (pA_{0}_bar, pB_{0}_bar), nor a "
        "measured flow (Q_{0}_lpm); give it, or log them",
        c.name);
  }
  if (!known.resolved[static_cast<std::size_t>(i)])
    return fmt::format(
        "forces and speeds of {} follow from its linkage, which is asked for too; "
        "answer that, or give it",
        c.name);
  if (!obstacle.empty()) return obstacle + "; give it, or log that";
  if (load.rows() == 0)
    return fmt::format("{} never moves steadily in these logs; give it, or a log in which it moves",
                       c.name);
  return fmt::format(
      "pressures tell areas only as multiples of masses, and nothing that loads {0} is "
      "known: {1}, no mass that it carries is given{2}; give it, or a log with a known "
      "payload_kg that changes or with the flow Q_{0}_lpm",
      c.name, payload_words(rows),
      measured.flow.size() > 0 ? " and its flow tells no area"
                               : " and no flow is "
                                 "measured");
}

}  // namespace

AreaAnswers answer_areas(const Known& known, const std::vector<LoadRows>& loads, const LoadFit& fit,
                         const std::string& obstacle) {
  const MachineSketch& sketch = known.sketch;
  const Machine& machine = known.machine;
  const MachineFromLogOptions& options = known.options;
  AreaAnswers out;
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const AreaState& area = fit.areas[index];
    const Cylinder& c = machine.cylinders[index];
    struct Side {
      OpenKind kind;
      double area, half;
      const char* word;
    };
    for (const Side& side : {Side{OpenKind::kBore, area.piston, area.piston_half, "bore"},
                             Side{OpenKind::kRod, area.rod, area.rod_half, "rod"}}) {
      const OpenValue* open = sketch.find(side.kind, i);
      if (open == nullptr) continue;
      if (!area.has_scale) {
        out.questions.push_back({open->path, why_not(known, i, loads[index], obstacle)});
        continue;
      }
      const double diameter =
          std::sqrt(4.0 * std::max(side.area, 0.0) / (std::numbers::pi * c.parallel));
      const double half =
          diameter > 0.0 ? 2.0 * side.half / (std::numbers::pi * c.parallel * diameter) : side.half;
      if (!(half <= options.largest_width * diameter)) {
        out.questions.push_back(
            {open->path,
             fmt::format(
                 "the logs tell the {} of {} only to {:.3g} ± {:.2g} m (95 %); give it, or a "
                 "log in which {} carries more different loads{}",
                 side.word, c.name, diameter, half, c.name,
                 side.kind == OpenKind::kRod ? " with pressure on its rod side" : "")});
        continue;
      }
      const std::string remark = side.kind == OpenKind::kBore
                                     ? standard_remark(kBores, diameter, half, "bore")
                                     : standard_remark(kRods, diameter, half, "rod");
      out.values.push_back({open->path, diameter, half, "m", area.source, remark, {}, i});
      out.diameters.push_back(
          {side.kind, i, diameter,
           fmt::format("from the log ({}): {} {:.5g} ± {:.2g} m{}{}", area.source, side.word,
                       diameter, half, remark.empty() ? "" : "; ", remark)});
    }
  }
  return out;
}

}  // namespace sparflow::from_log
