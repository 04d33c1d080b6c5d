#include "tests/apps/sample_page.h"

#include <cmath>
#include <numbers>
#include <random>

#include "models/math/nan.h"
#include "tests/models/test_machines.h"

namespace sparflow::test_support {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// A motion of eight seconds from low and near to high and far.
Trajectory reach() {
  Trajectory motion;
  motion.t = VectorXd::LinSpaced(81, 0.0, 8.0);
  motion.q.resize(81, 3);
  for (Index i = 0; i < 81; ++i) {
    const double s = 0.5 - 0.5 * std::cos(std::numbers::pi * motion.t[i] / 8.0);
    motion.q.row(i) << 0.35 + 0.6 * s, -1.75 + 1.15 * s, 0.5 + 2.8 * s * s;
  }
  return motion;
}

LineChart pressures() {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 1.2);
  const Index n = 12000;
  LineChart chart;
  chart.title = "Boom cylinder: working pressure";
  chart.note = "Pale: measured. Thin line: predicted, with its band of \u00b12\u03c3.";
  chart.group = "log";
  chart.y_axis = {"pressure", "bar"};
  chart.x.resize(n);
  VectorXd measured(n), predicted(n), sigma(n);
  for (Index i = 0; i < n; ++i) {
    const double t = 0.02 * static_cast<double>(i);
    chart.x[i] = t;
    const bool moving = std::fmod(t, 30.0) > 4.0;
    const double p = 120.0 + 45.0 * std::sin(0.11 * t) + 12.0 * std::sin(0.9 * t);
    predicted[i] = moving ? p : kNaN;
    sigma[i] = 2.0 + 4.0 * std::pow(std::sin(0.05 * t), 2);
    measured[i] = (moving ? p + (t > 150 && t < 168 ? 14.0 : 0.0) : 60.0) + noise(random);
  }
  chart.series.push_back({"measured", measured, LineStyle::kMeasured, 0, {}, {}});
  chart.series.push_back({"predicted", predicted, LineStyle::kPredicted, 0, predicted - 2.0 * sigma,
                          predicted + 2.0 * sigma});
  chart.markers = {{30.0, "lifting"}, {34.0, "too close to the first"}, {121.5, "jib joins"}};
  chart.spans = {{150.0, 168.0, "largest error"}};
  return chart;
}

LineChart flows() {
  LineChart chart;
  chart.title = "Flows of all cylinders";
  chart.group = "log";
  chart.y_axis = {"flow", "l/min"};
  chart.x = VectorXd::LinSpaced(600, 0.0, 240.0);
  const char* names[] = {"boom", "jib", "extension"};
  for (int k = 0; k < 3; ++k) {
    const Eigen::ArrayXd wave = (chart.x.array() * (0.11 + 0.05 * k) + k).sin();
    chart.series.push_back(
        {names[k], (60.0 - 12.0 * k) * wave.matrix(), LineStyle::kPlain, -1, {}, {}});
  }
  chart.series.push_back(
      {"pump's limit", VectorXd::Constant(600, 80.0), LineStyle::kLimit, -1, {}, {}});
  return chart;
}

ScatterChart residuals() {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 1.5);
  std::uniform_real_distribution<double> rate(-55.0, 55.0);
  ScatterChart chart;
  chart.title = "Residual against velocity";
  chart.note = "A step at zero: dry friction is missing.";
  chart.width = FigureWidth::kHalf;
  chart.x_axis = {"cylinder velocity", "mm/s"};
  chart.y_axis = {"force residual", "kN"};
  chart.trend = true;
  for (const char* name : {"boom alone", "with jib"}) {
    ScatterGroup group{name, VectorXd(9000), VectorXd(9000)};
    for (Index i = 0; i < 9000; ++i) {
      group.x[i] = rate(random);
      group.y[i] = (group.x[i] > 0 ? 3.9 : -3.9) + noise(random);
    }
    chart.groups.push_back(group);
  }
  return chart;
}

BarChart throttling() {
  BarChart chart;
  chart.title = "Throttling loss per cylinder";
  chart.width = FigureWidth::kHalf;
  chart.value_axis = {"energy", "kJ"};
  chart.categories = {"sequential", "simultaneous", "energy-optimal"};
  chart.series = {{"boom", Eigen::Vector3d(12.1, 18.3, 6.2)},
                  {"jib", Eigen::Vector3d(8.4, 21.9, 5.1)},
                  {"extension", Eigen::Vector3d(3.3, 9.7, 2.9)}};
  return chart;
}

BarChart rmse() {
  BarChart chart;
  chart.title = "Force error before and after";
  chart.width = FigureWidth::kHalf;
  chart.stacked = false;
  chart.value_axis = {"RMSE", "kN"};
  chart.categories = {"main", "jib"};
  chart.series = {{"CAD only", Eigen::Vector2d(20.35, 5.66)},
                  {"+ tip mass", Eigen::Vector2d(4.51, 4.03)},
                  {"+ Coulomb friction", Eigen::Vector2d(2.25, 2.0)}};
  return chart;
}

HeatMap error_map() {
  HeatMap map;
  map.title = "Pressure error over the working area";
  map.note = "Each cell: RMS of all moving samples with the tip in it. Empty: never visited.";
  map.value = {"RMS error", "bar"};
  map.x_edges = VectorXd::LinSpaced(41, 0.0, 12.0);
  map.z_edges = VectorXd::LinSpaced(31, -2.0, 9.0);
  map.values.setConstant(30, 40, kNaN);
  map.counts.setZero(30, 40);
  for (Index r = 0; r < 30; ++r) {
    for (Index c = 0; c < 40; ++c) {
      const Vector2d at(0.5 * (map.x_edges[c] + map.x_edges[c + 1]),
                        0.5 * (map.z_edges[r] + map.z_edges[r + 1]));
      const double distance = (at - Vector2d(0.0, 2.0)).norm();
      if (distance < 2.5 || distance > 9.5 || at.y() < 2.0 - 0.6 * at.x()) continue;
      map.values(r, c) = 1.2 + 0.9 * std::exp(0.22 * distance) + 0.8 * std::sin(3 * at.x());
      map.counts(r, c) = std::round(40 + 30 * std::sin(at.y()));
    }
  }
  map.crane = drawing_frame(loader_crane(), reach().q.row(50)).parts;
  return map;
}

CraneDrawing motion() {
  CraneDrawing drawing;
  drawing.title = "The motion";
  drawing.note = "Five instants, the later the stronger; dashed: the planner's path.";
  drawing.group = "motion";
  drawing.frames = drawing_frames(loader_crane(), reach(), 81);
  drawing.obstacles = {{"wall", {{4.6, 0.0}, {5.4, 0.0}, {5.4, 2.6}, {4.6, 2.6}}, 0.0},
                       {"tank", {{1.9, 0.6}}, 0.6}};
  drawing.paths = {{"seed", {drawing.frames.front().tip, {6.5, 3.0}, drawing.frames.back().tip}}};
  drawing.goal = drawing.frames.back().tip;
  drawing.ground = 0.0;
  return drawing;
}

LineChart power() {
  LineChart chart;
  chart.title = "Pump power";
  chart.group = "motion";
  chart.height = 180;
  chart.y_axis = {"power", "kW"};
  chart.x = VectorXd::LinSpaced(200, 0.0, 8.0);
  const Eigen::ArrayXd wave = (chart.x.array() * 3.14159 / 8.0).sin();
  chart.series.push_back({"optimal", (14.0 * wave).matrix(), LineStyle::kPlain, -1, {}, {}});
  chart.series.push_back({"seed", (18.0 * wave.square()).matrix(), LineStyle::kPlain, -1, {}, {}});
  return chart;
}

}  // namespace

Page sample_page() {
  Page page("Sample: loader crane");
  page.subtitle("Every kind of figure with made-up data");
  page.verdict(
      Tone::kWarning, "Dry friction is missing on the boom cylinder",
      "With it the force error falls from 4.5 kN to 2.2 kN; nothing else is found (p = 0.003).");
  page.tiles({{"12.4", "kJ", "energy of the motion", "18 % less than the seed", Tone::kGood},
              {"8.00", "s", "duration"},
              {"1.3", "bar", "pressure error (RMS)", "noise of the sensors: 0.8 bar"},
              {"98.6", "%", "fit on the test log", "", Tone::kGood}});
  page.section("Motion");
  page.paragraph("The crane moves from low and near to high and far without touching the wall.");
  page.plot(motion());
  page.plot(power());
  page.section("Model against measurement");
  page.plot(pressures());
  page.plot(flows());
  page.plot(residuals());
  page.plot(throttling());
  page.plot(rmse());
  page.plot(error_map());
  page.section("Figures");
  Table table;
  table.title = "Pressure error per cylinder and direction";
  table.columns = {
      {"cylinder"}, {"direction"}, {"RMSE", "bar", 3}, {"fit", "%", 3}, {"samples", "", 6}};
  table.rows = {{"boom", "extend", 1.214, 98.6, 11250.0},
                {"boom", "retract", 0.97, 97.9, 9841.0},
                {"jib", "extend", 2.3, 95.1, 402.0},
                {"jib", "retract", kNaN, kNaN, 0.0}};
  table.highlighted_row = 1;
  table.note = "Moving samples only; a dash: the log does not measure it.";
  page.table(table);
  page.details("Options used", "kernel: squared exponential, ARD\nseed: 1\n");
  page.provenance("program", "sparflow 0.1.0");
  page.provenance("log", "sample.csv, sha256 5891b5b522d5df08");
  return page;
}

}  // namespace sparflow::test_support
