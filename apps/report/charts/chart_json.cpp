#include "apps/report/charts/chart_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "apps/report/charts/decimate.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

using Index = Eigen::Index;
using nlohmann::json;

// Significant digits that suffice for a chart and a saved CSV: time keeps 1 ms in a three-hour log.
constexpr int kValueDigits = 5;
constexpr int kAbscissaDigits = 8;

json base(const char* kind, const Figure& figure) {
  return {
      {"kind", kind}, {"title", figure.title}, {"height", figure.height}, {"group", figure.group}};
}

json quantity(const Quantity& q) { return {{"label", q.label}, {"unit", q.unit}}; }

json picked(const Eigen::VectorXd& values, const std::vector<Index>& rows, int digits) {
  json out = json::array();
  for (const Index i : rows) out.push_back(number_json(values[i], digits));
  return out;
}

json numbers(const Eigen::VectorXd& values, int digits) {
  json out = json::array();
  for (const double v : values) out.push_back(number_json(v, digits));
  return out;
}

json matrix(const Eigen::MatrixXd& values) {
  json out = json::array();
  for (Index r = 0; r < values.rows(); ++r) out.push_back(numbers(values.row(r), kValueDigits));
  return out;
}

/// Rounds metres to the millimetre.
json metre(double value) {
  if (!std::isfinite(value)) return nullptr;
  return std::round(value * 1e3) / 1e3;
}

json flat(const std::vector<Eigen::Vector2d>& points) {
  json out = json::array();
  for (const Eigen::Vector2d& p : points) {
    out.push_back(metre(p.x()));
    out.push_back(metre(p.y()));
  }
  return out;
}

const char* part_name(PartKind kind) {
  switch (kind) {
    case PartKind::kLink:
      return "link";
    case PartKind::kTelescope:
      return "telescope";
    case PartKind::kBarrel:
      return "barrel";
    case PartKind::kRod:
      return "rod";
    case PartKind::kRocker:
      return "rocker";
    case PartKind::kCoupler:
      return "coupler";
    case PartKind::kMark:
      return "mark";
    case PartKind::kPin:
      return "pin";
  }
  return "link";
}

json parts_json(const std::vector<DrawingPart>& parts) {
  json out = json::array();
  for (const DrawingPart& part : parts) {
    out.push_back({{"kind", part_name(part.kind)}, {"points", flat(part.points)}});
  }
  return out;
}

/// Number of a colour for the scripts, in which -1 is grey.
int color_number(int color, int& next) {
  if (color == kBeforeColor) return -1;
  return color >= 0 ? color : next++;
}

const char* style_name(LineStyle style) {
  switch (style) {
    case LineStyle::kBefore:
      return "before";
    case LineStyle::kPlain:
      return "plain";
    case LineStyle::kMeasured:
      return "measured";
    case LineStyle::kPredicted:
      return "predicted";
    case LineStyle::kLimit:
      return "limit";
  }
  return "plain";
}

void check_lines(const LineChart& chart) {
  for (Index i = 0; i < chart.x.size(); ++i) {
    SPARFLOW_CHECK(std::isfinite(chart.x[i]) && (i == 0 || chart.x[i] >= chart.x[i - 1]),
                   fmt::format("chart \"{}\": the abscissa must ascend", chart.title));
  }
  for (const LineSeries& s : chart.series) {
    const Index n = chart.x.size();
    SPARFLOW_CHECK(s.y.size() == n && (s.band_lower.size() == 0 || s.band_lower.size() == n) &&
                       s.band_lower.size() == s.band_upper.size(),
                   fmt::format("chart \"{}\": series \"{}\" is not as long as the abscissa",
                               chart.title, s.name));
  }
}

/// Column of each node: one more than the last of those from which something comes.
std::vector<int> sankey_columns(const SankeyChart& chart) {
  const auto nodes = static_cast<int>(chart.nodes.size());
  std::vector<int> columns(chart.nodes.size(), 0);
  bool moved = true;
  for (int round = 0; moved; ++round) {
    SPARFLOW_CHECK(round <= nodes, fmt::format("diagram \"{}\": flows in a circle", chart.title));
    moved = false;
    for (const SankeyFlow& f : chart.flows) {
      SPARFLOW_CHECK(
          f.from >= 0 && f.to >= 0 && f.from < nodes && f.to < nodes && f.amount >= 0.0,
          fmt::format("diagram \"{}\": a flow without nodes or below zero", chart.title));
      int& to = columns[static_cast<std::size_t>(f.to)];
      const int from = columns[static_cast<std::size_t>(f.from)];
      if (to > from) continue;
      to = from + 1;
      moved = true;
    }
  }
  return columns;
}

}  // namespace

json number_json(double value, int digits) {
  if (!std::isfinite(value)) return nullptr;
  const double rounded = std::strtod(fmt::format("{:.{}g}", value, digits).c_str(), nullptr);
  // Whole numbers are printed without ".0", which saves a tenth of the page's size.
  if (rounded == std::trunc(rounded) && std::abs(rounded) < 1e9) return std::lround(rounded);
  return rounded;
}

json chart_json(const LineChart& chart, Index most_points) {
  check_lines(chart);
  std::vector<const Eigen::VectorXd*> columns;
  for (const LineSeries& s : chart.series) columns.push_back(&s.y);
  if (columns.empty()) columns.push_back(&chart.x);
  const std::vector<Index> rows = decimate_rows(columns, most_points);

  json out = base("lines", chart);
  out["x_counts"] = chart.x_counts;
  out["x_axis"] = quantity(chart.x_axis);
  out["y_axis"] = quantity(chart.y_axis);
  out["x"] = picked(chart.x, rows, kAbscissaDigits);
  out["shown"] = rows.size();
  out["of"] = chart.x.size();
  out["series"] = json::array();
  int next_color = 0;
  for (const LineSeries& s : chart.series) {
    json one = {{"name", s.name}, {"style", style_name(s.style)}};
    if ((s.style == LineStyle::kLimit && s.color < 0) || s.style == LineStyle::kBefore) {
      one["color"] = -1;
    } else {
      one["color"] = s.color >= 0 ? s.color : next_color++;
    }
    one["y"] = picked(s.y, rows, kValueDigits);
    if (s.band_lower.size() > 0) {
      one["lower"] = picked(s.band_lower, rows, kValueDigits);
      one["upper"] = picked(s.band_upper, rows, kValueDigits);
    }
    out["series"].push_back(std::move(one));
  }
  out["markers"] = json::array();
  for (const Marker& m : chart.markers) {
    out["markers"].push_back({{"x", number_json(m.x, kAbscissaDigits)}, {"label", m.label}});
  }
  out["spans"] = json::array();
  for (const Span& s : chart.spans) {
    out["spans"].push_back({{"from", number_json(s.from, kAbscissaDigits)},
                            {"to", number_json(s.to, kAbscissaDigits)},
                            {"label", s.label}});
  }
  return out;
}

json chart_json(const ScatterChart& chart, Index most_points) {
  json out = base("scatter", chart);
  out["x_axis"] = quantity(chart.x_axis);
  out["y_axis"] = quantity(chart.y_axis);
  out["diagonal"] = chart.diagonal;
  out["groups"] = json::array();
  Index total = 0, shown = 0;
  int next_color = 0;
  const Index share = most_points / std::max<Index>(1, static_cast<Index>(chart.groups.size()));
  for (const ScatterGroup& group : chart.groups) {
    SPARFLOW_CHECK(
        group.x.size() == group.y.size(),
        fmt::format("chart \"{}\": group \"{}\" needs as many x as y", chart.title, group.name));
    const std::vector<Index> points = decimate_cloud(group.x, group.y, share);
    total += group.x.size();
    shown += static_cast<Index>(points.size());
    out["groups"].push_back({{"name", group.name},
                             {"color", color_number(group.color, next_color)},
                             {"x", picked(group.x, points, kValueDigits)},
                             {"y", picked(group.y, points, kValueDigits)}});
  }
  out["shown"] = shown;
  out["of"] = total;
  if (chart.trend) {
    out["trends"] = json::array();
    for (const ScatterGroup& group :
         chart.groups) {  // The medians are of all points, so they are computed before decimation.
      const BinnedMedian trend = binned_median(group.x, group.y, 24);
      out["trends"].push_back(
          {{"x", numbers(trend.x, kValueDigits)}, {"y", numbers(trend.y, kValueDigits)}});
    }
  }
  return out;
}

json chart_json(const BarChart& chart, Index /*most_points*/) {
  json out = base("bars", chart);
  out["value_axis"] = quantity(chart.value_axis);
  out["categories"] = chart.categories;
  out["stacked"] = chart.stacked;
  out["series"] = json::array();
  int next_color = 0;
  for (const BarSeries& s : chart.series) {
    SPARFLOW_CHECK(
        s.values.size() == static_cast<Index>(chart.categories.size()),
        fmt::format("chart \"{}\": series \"{}\" needs one value a category", chart.title, s.name));
    out["series"].push_back({{"name", s.name},
                             {"color", color_number(s.color, next_color)},
                             {"values", numbers(s.values, kValueDigits)}});
  }
  return out;
}

json chart_json(const SankeyChart& chart, Index /*most_points*/) {
  json out = base("sankey", chart);
  out["amount"] = quantity(chart.amount);
  out["nodes"] = chart.nodes;
  out["scale"] = number_json(chart.scale, kValueDigits);
  out["flows"] = json::array();
  const std::vector<int> columns = sankey_columns(chart);
  out["columns"] = columns;
  for (const SankeyFlow& f : chart.flows)
    out["flows"].push_back(
        {{"from", f.from}, {"to", f.to}, {"amount", number_json(f.amount, kValueDigits)}});
  return out;
}

json chart_json(const HeatMap& chart, Index /*most_points*/) {
  const bool empty = chart.values.size() == 0;
  SPARFLOW_CHECK(empty || (chart.values.rows() + 1 == chart.z_edges.size() &&
                           chart.values.cols() + 1 == chart.x_edges.size()),
                 fmt::format("map \"{}\": values do not fit the cell borders", chart.title));
  SPARFLOW_CHECK(chart.counts.size() == 0 || (chart.counts.rows() == chart.values.rows() &&
                                              chart.counts.cols() == chart.values.cols()),
                 fmt::format("map \"{}\": counts need the shape of the values", chart.title));
  json out = base("heat", chart);
  out["x_axis"] = quantity(chart.x_axis);
  out["z_axis"] = quantity(chart.z_axis);
  out["value"] = quantity(chart.value);
  out["x_edges"] = numbers(chart.x_edges, kValueDigits);
  out["z_edges"] = numbers(chart.z_edges, kValueDigits);
  out["values"] = matrix(chart.values);
  if (chart.counts.size() > 0) out["counts"] = matrix(chart.counts);
  out["diverging"] = chart.diverging;
  out["crane"] = parts_json(chart.crane);
  return out;
}

json chart_json(const CraneDrawing& chart, Index /*most_points*/) {
  json out = base("crane", chart);
  out["x_axis"] = quantity(chart.x_axis);
  out["z_axis"] = quantity(chart.z_axis);
  out["stills"] = chart.stills;
  out["payload"] = chart.payload;
  out["goal"] = chart.goal ? flat({*chart.goal}) : json(nullptr);
  out["ground"] = chart.ground ? metre(*chart.ground) : json(nullptr);
  out["kinds"] =
      json::array();  // The parts are the same at every instant, so their kinds are written once.
  out["frames"] = json::array();
  for (const DrawingFrame& frame : chart.frames) {
    if (out["kinds"].empty()) {
      for (const DrawingPart& part : frame.parts) out["kinds"].push_back(part_name(part.kind));
    }
    SPARFLOW_CHECK(frame.parts.size() == out["kinds"].size(),
                   fmt::format("drawing \"{}\": the parts differ between instants", chart.title));
    json points = json::array();
    for (const DrawingPart& part : frame.parts) points.push_back(flat(part.points));
    out["frames"].push_back(
        {{"t", number_json(frame.time, 6)}, {"tip", flat({frame.tip})}, {"points", points}});
  }
  out["obstacles"] = json::array();
  for (const DrawingObstacle& o : chart.obstacles) {
    out["obstacles"].push_back(
        {{"name", o.name}, {"points", flat(o.points)}, {"radius", metre(o.radius)}});
  }
  if (!chart.marks.empty()) {
    if (!chart.frames.empty()) {
      const auto& parts = chart.frames.front().parts;
      const auto marked = std::count_if(parts.begin(), parts.end(), [](const DrawingPart& p) {
        return p.kind == PartKind::kMark;
      });
      SPARFLOW_CHECK(static_cast<std::size_t>(marked) == chart.marks.size(),
                     fmt::format("drawing \"{}\": each mark needs a place", chart.title));
    }
    out["marks"] = json::array();
    for (const DrawingMark& mark : chart.marks)
      out["marks"].push_back({{"name", mark.name}, {"lines", mark.lines}});
  }
  out["paths"] = json::array();
  for (const DrawingPath& p : chart.paths) {
    out["paths"].push_back({{"name", p.name}, {"points", flat(p.points)}});
  }
  return out;
}

}  // namespace sparflow
