#pragma once
/// The figures of a page as plain data. Values are in the unit named beside them; the caller converts them from SI
/// (models/math/units.h). NaN means "no value" everywhere.
#include <Eigen/Dense>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/report/charts/drawing_geometry.h"

namespace sparflow {

/// A quantity on an axis, shown as "label [unit]", or as the label alone when the unit is empty.
struct Quantity {
  std::string label;
  std::string unit;
};

enum class FigureWidth { kFull, kHalf };  ///< two halves stand side by side on a wide screen

/// Members that all figures have.
struct Figure {
  std::string title;
  std::string
      note;  ///< one or two sentences below the figure: what it shows, where the data is from
  FigureWidth width = FigureWidth::kFull;
  int height = 0;     ///< [px] of the drawing, 0 = default of its kind
  std::string group;  ///< charts over time and crane drawings of one group share cursor and zoom
};

/// Measured is drawn as a wide pale line, predicted as a thin full one over it, limits dashed. The model before a change is
/// grey on every page (kBefore), after it kPredicted.
enum class LineStyle { kPlain, kMeasured, kPredicted, kLimit, kBefore };

/// Number of the colour of everything before a change: the grey of notes.
inline constexpr int kBeforeColor = -2;

struct LineSeries {
  std::string name;
  Eigen::VectorXd y;  ///< as long as the chart's x; NaN leaves a gap
  LineStyle style = LineStyle::kPlain;
  int color = -1;  ///< palette number; the curves of one quantity share one. -1 = the next unused
  Eigen::VectorXd band_lower, band_upper;  ///< e.g. prediction +- 2 sigma; empty = no band
};

struct Marker {
  double x = 0.0;
  std::string label;
};

/// A shaded stretch of the abscissa, e.g. one of the worst regions.
struct Span {
  double from = 0.0;
  double to = 0.0;
  std::string label;
};

struct LineChart : Figure {
  Quantity x_axis = {"time", "s"};
  Quantity y_axis;
  Eigen::VectorXd x;      ///< ascending and finite
  bool x_counts = false;  ///< x are whole numbers, so there are no ticks between them
  std::vector<LineSeries> series;
  std::vector<Marker> markers;
  std::vector<Span> spans;
};

struct ScatterGroup {
  std::string name;
  Eigen::VectorXd x, y;  ///< of one length, in any order
  int color = -1;        ///< palette number, kBeforeColor, or -1 = the next
};

struct ScatterChart : Figure {
  Quantity x_axis, y_axis;
  std::vector<ScatterGroup> groups;
  bool trend = false;     ///< of each group, a line through the median of y in 24 bins of x
  bool diagonal = false;  ///< the line y = x, for predicted against measured
};

struct BarSeries {
  std::string name;
  Eigen::VectorXd values;  ///< [categories]
  int color = -1;          ///< palette number, kBeforeColor, or -1 = the next
};

/// Horizontal bars, one row for each category.
struct BarChart : Figure {
  Quantity value_axis;
  std::vector<std::string> categories;
  std::vector<BarSeries> series;
  bool stacked = true;  ///< false: side by side
};

/// An amount that goes from one node of a Sankey diagram to another; nodes by number.
struct SankeyFlow {
  int from = 0, to = 0;
  double amount = 0.0;  ///< >= 0, in the diagram's unit
};

/// Where an amount comes from and where it goes (Sankey 1898): nodes from left to right, bands as wide as what flows.
struct SankeyChart : Figure {
  Quantity amount;
  std::vector<std::string> nodes;  ///< a flow's first node stands left of its second one
  std::vector<SankeyFlow> flows;   ///< in the order in which they leave a node, without a circle
  double scale = 0.0;  ///< amount that fills the height; 0: what this diagram's fullest column has
};

/// A scalar over the crane's working area.
struct HeatMap : Figure {
  Quantity x_axis = {"x", "m"};
  Quantity z_axis = {"z", "m"};
  Quantity value;
  Eigen::VectorXd x_edges, z_edges;  ///< [m] ascending cell borders
  Eigen::MatrixXd
      values;  ///< (z_edges.size()-1) x (x_edges.size()-1), row 0 is the lowest; NaN = empty
  Eigen::MatrixXd counts;  ///< samples of each cell, same shape, shown at the cursor; may be empty
  bool diverging = false;  ///< signed values, white at zero
  std::vector<DrawingPart> crane;  ///< drawn over the map
};

/// An obstacle cut by the drawing's plane: a polygon, or (radius > 0) a circle about its one point.
struct DrawingObstacle {
  std::string name;
  std::vector<Eigen::Vector2d> points;  ///< [m]
  double radius = 0.0;                  ///< [m]
};

struct DrawingPath {
  std::string name;
  std::vector<Eigen::Vector2d> points;  ///< [m]
};

/// What is written beside a marked place of a drawing, with a line to it.
struct DrawingMark {
  std::string name;                ///< of the part
  std::vector<std::string> lines;  ///< below the name
};

/// The crane at several instants, with a slider that moves it.
struct CraneDrawing : Figure {
  Quantity x_axis = {"x", "m"};
  Quantity z_axis = {"z", "m"};
  std::vector<DrawingFrame> frames;  ///< ascending in time; 60 to 120 make a smooth motion
  int stills = 5;                    ///< instants that stay visible; later ones are drawn darker
  std::vector<DrawingObstacle> obstacles;
  std::vector<DrawingPath> paths;  ///< paths of the tip besides that of the frames, e.g. of a seed
  std::optional<Eigen::Vector2d> goal;
  std::optional<double> ground;    ///< [m] height of the ground line
  bool payload = true;             ///< draw a load at the tip
  std::vector<DrawingMark> marks;  ///< of the frames' parts kMark, in their order
};

}  // namespace sparflow
