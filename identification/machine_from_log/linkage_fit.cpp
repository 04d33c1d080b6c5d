#include "identification/machine_from_log/linkage_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "identification/machine_from_log/linkage_plane.h"
#include "identification/machine_from_log/weighted_fit.h"
#include "models/machine/linkage.h"
#include "models/math/linear_algebra.h"
#include "models/math/robust.h"

namespace sparflow::from_log {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows below which no curve is fitted.
/// @threshold [1] 10..1000; chosen: ten for each number of a pinned cylinder
constexpr std::size_t kFewestRows = 50;
/// Rows that choose between starts.
/// @threshold [1] 50..5000; chosen: enough for a smooth curve
constexpr std::size_t kStartRows = 300;
/// Best starts that are followed to their minimum.
/// @threshold [1] 1..200; chosen: each costs a hundredth of a second
constexpr std::size_t kStartsFollowed = 24;
/// Lengths at zero stroke that are tried as start.
/// @threshold [m] 0.05..1; chosen: small cylinders of working machines
constexpr double kShortest = 0.15;
/// The longest of them.
/// @threshold [m] 1..20; chosen: large cylinders of working machines
constexpr double kLongest = 6.0;
/// Number of those lengths.
/// @threshold [1] 5..200; chosen: neighbours differ by a sixth
constexpr int kLengths = 24;
/// Standard deviations that a stroke or position has at least.
/// @threshold [m] 1e-9..1e-4; numerical: digits of a file
constexpr double kLeastNoise = 1e-5;
/// Residual above which a linkage does not explain the strokes, as multiple of the noise.
/// @threshold [1] 1.2..10; chosen: noise is known to some ten percent
constexpr double kUnexplained = 2.0;
/// Residual of a stroke that no warning names.
/// @threshold [m] 1e-4..0.02; chosen: play of pins
constexpr double kPlay = 1e-3;

/// One number of the linkage that is searched.
struct Searched {
  std::string name;
  std::string unit;
  double scale = 1.0;  ///< size for numeric derivatives
};

/// Rows of one cylinder that tell its stroke at a joint position.
struct StrokeRows {
  VectorXd stroke, q;
  Eigen::VectorXi block;
  double stroke_noise = 0.0, position_noise = 0.0;
};

StrokeRows stroke_rows(const SketchRows& rows, const CylinderRows& c, int joint) {
  std::vector<Index> kept;
  kept.reserve(static_cast<std::size_t>(rows.rows()));
  for (Index k = 0; k < rows.rows() && c.stroke.size() > 0; ++k) {
    if (rows.held_out[k] || !std::isfinite(c.stroke[k]) || !std::isfinite(rows.position(k, joint)))
      continue;
    kept.push_back(k);
  }
  StrokeRows out;
  const auto n = static_cast<Index>(kept.size());
  out.stroke.resize(n);
  out.q.resize(n);
  out.block.resize(n);
  for (Index k = 0; k < n; ++k) {
    const Index row = kept[static_cast<std::size_t>(k)];
    out.stroke[k] = c.stroke[row];
    out.q[k] = rows.position(row, joint);
    out.block[k] = rows.block[row];
  }
  out.stroke_noise = std::max(c.stroke_noise, kLeastNoise);
  out.position_noise = rows.position_noise[joint];
  return out;
}

/// Every n-th row.
StrokeRows thinned(const StrokeRows& all, std::size_t count) {
  const Index stride = std::max<Index>(1, all.q.size() / static_cast<Index>(count));
  StrokeRows out = all;
  const Index n = (all.q.size() + stride - 1) / stride;
  out.stroke.resize(n);
  out.q.resize(n);
  out.block.resize(n);
  for (Index k = 0; k < n; ++k) {
    out.stroke[k] = all.stroke[k * stride];
    out.q[k] = all.q[k * stride];
    out.block[k] = all.block[k * stride];
  }
  return out;
}

/// The search of one cylinder's linkage.
class Search {
 public:
  Search(const MachineSketch& sketch, int cylinder, const MachineFromLogOptions& options,
         Machine& machine)
      : sketch_(sketch),
        index_(cylinder),
        options_(options),
        machine_(machine),
        plane_(machine, cylinder) {}

  LinkageFit run(const SketchRows& rows);

 private:
  Cylinder& cylinder() { return machine_.cylinders[static_cast<std::size_t>(index_)]; }
  const Cylinder& cylinder() const { return machine_.cylinders[static_cast<std::size_t>(index_)]; }
  const Joint& joint() const { return machine_.joints[static_cast<std::size_t>(cylinder().joint)]; }
  bool open(OpenKind kind) const { return sketch_.is_open(kind, index_); }
  std::string path(OpenKind kind) const {
    const OpenValue* value = sketch_.find(kind, index_);
    return value != nullptr ? value->path : fmt::format("cylinders[{}].linkage", cylinder().name);
  }
  /// The first open value of this cylinder's linkage, by which a question is named.
  std::string first_path() const {
    for (const OpenValue& v : sketch_.open) {
      if (v.part == index_ && v.kind >= OpenKind::kZeroLength) return v.path;
    }
    return fmt::format("cylinders[{}].linkage", cylinder().name);
  }
  void ask(LinkageFit& fit, const std::string& why) const {
    fit.questions.push_back({first_path(), why});
  }
  bool asked_before_search(const SketchRows& rows, const StrokeRows& data, LinkageFit& fit) const;
  std::vector<Searched> searched() const;
  void apply(const VectorXd& theta);
  std::vector<VectorXd> starts(const StrokeRows& data) const;
  VectorXd pins_start(const StrokeRows& data, double zero) const;
  CurveFit fitted(const StrokeRows& data, const VectorXd& start, int iterations);
  bool both_pins_open() const {
    return open(OpenKind::kBarrelPin) && open(OpenKind::kRodPin) &&
           std::holds_alternative<PinsLinkage>(cylinder().linkage);
  }
  /// Angle of the child pin in the plane when both pins are open: onto the line to the next joint.
  static constexpr double kChildAngle = 0.0;
  void conclude(const StrokeRows& data, const CurveFit& best, LinkageFit& fit);
  double largest_half_width(const Searched& s, double value, const StrokeRows& data) const;

  const MachineSketch& sketch_;
  int index_;
  const MachineFromLogOptions& options_;
  Machine& machine_;
  LinkagePlane plane_;
};

std::vector<Searched> Search::searched() const {
  std::vector<Searched> list;
  const std::string& name = cylinder().name;
  const auto pin = [&](OpenKind kind, const char* words) {
    if (!open(kind)) return;
    list.push_back({fmt::format("{}: {}, along the link", name, words), "m", 1.0});
    list.push_back({fmt::format("{}: {}, across the link", name, words), "m", 1.0});
  };
  if (both_pins_open()) {
    const bool barrel_on_parent = std::get<PinsLinkage>(cylinder().linkage).barrel_on_parent;
    list.push_back({fmt::format("{}: arm of the {} pin", name, barrel_on_parent ? "barrel" : "rod"),
                    "m", 1.0});
    list.push_back({fmt::format("{}: arm of the {} pin", name, barrel_on_parent ? "rod" : "barrel"),
                    "m", 1.0});
    list.push_back({fmt::format("{}: angle between the arms at position 0", name), "rad", 1.0});
  } else {
    pin(OpenKind::kBarrelPin, "barrel pin");
    pin(OpenKind::kRodPin, "rod pin");
    pin(OpenKind::kRockerPin, "rocker pin");
    pin(OpenKind::kCouplerPin, "coupler pin");
    for (const OpenKind kind :
         {OpenKind::kRockerLength, OpenKind::kCouplerLength, OpenKind::kRadius}) {
      if (open(kind)) list.push_back({path(kind), "m", 1.0});
    }
  }
  if (open(OpenKind::kZeroLength)) list.push_back({path(OpenKind::kZeroLength), "m", 1.0});
  return list;
}

void Search::apply(const VectorXd& theta) {
  Index at = 0;
  Cylinder& c = cylinder();
  const auto plane_point = [&](Index k) { return Eigen::Vector2d(theta[k], theta[k + 1]); };
  if (auto* pins = std::get_if<PinsLinkage>(&c.linkage)) {
    if (both_pins_open()) {
      const double parent = kChildAngle - theta[2];
      pins->parent_pin =
          plane_.on_parent(theta[0] * Eigen::Vector2d(std::cos(parent), std::sin(parent)), 0.0);
      pins->child_pin = plane_.on_child({theta[1], 0.0}, 0.0);
      at = 3;
    } else if (open(OpenKind::kBarrelPin) || open(OpenKind::kRodPin)) {
      const bool parent_open = open(OpenKind::kBarrelPin) == pins->barrel_on_parent;
      if (parent_open) {
        pins->parent_pin = plane_.on_parent(plane_point(0), plane_.height_child(pins->child_pin));
      } else {
        pins->child_pin = plane_.on_child(plane_point(0), plane_.height_parent(pins->parent_pin));
      }
      at = 2;
    }
  } else if (auto* bar = std::get_if<FourBarLinkage>(&c.linkage)) {
    for (const OpenKind kind : {OpenKind::kBarrelPin, OpenKind::kRockerPin}) {
      if (!open(kind)) continue;
      (kind == OpenKind::kBarrelPin ? bar->barrel : bar->rocker) =
          plane_.on_parent(plane_point(at), 0.0);
      at += 2;
    }
    if (open(OpenKind::kCouplerPin)) {
      bar->coupler = plane_.on_child(plane_point(at), 0.0);
      at += 2;
    }
    if (open(OpenKind::kRockerLength)) bar->rocker_length = theta[at++];
    if (open(OpenKind::kCouplerLength)) bar->coupler_length = theta[at++];
  } else if (auto* rack = std::get_if<RackLinkage>(&c.linkage)) {
    if (open(OpenKind::kRadius)) rack->radius = theta[at++];
  }
  if (open(OpenKind::kZeroLength)) c.length_at_zero_stroke = theta[at];
}

bool Search::asked_before_search(const SketchRows& rows, const StrokeRows& data,
                                 LinkageFit& fit) const {
  const std::string& name = cylinder().name;
  const int j = cylinder().joint;
  const CylinderRows& c = rows.cylinders[static_cast<std::size_t>(index_)];
  const bool strokes = c.stroke.size() > 0 && c.stroke.array().isFinite().any();
  const bool positions = rows.position.col(j).array().isFinite().any();
  if (!strokes || !positions) {
    ask(fit,
        fmt::format("the linkage of {0} needs its stroke and the position of joint {1} at the same "
                    "time, and the logs have {2}; log x_{0}_m and q_{1}, or give the value",
                    name, joint().name,
                    strokes     ? "only the stroke"
                    : positions ? "only the position"
                                : "neither"));
    return true;
  }
  const auto n = static_cast<std::size_t>(data.q.size());
  const double way = n == 0 ? 0.0 : data.q.maxCoeff() - data.q.minCoeff();
  const double range = joint().position.hi - joint().position.lo;
  const double least =
      std::max(options_.least_way * range, 20.0 * rows.position_noise[j]);  // above the noise
  if (n < kFewestRows || way < least) {
    ask(fit, fmt::format(
                 "joint {} moves by {:.3g} of {:.3g} {} in these logs ({} rows with stroke and "
                 "position), which does not tell its linkage; move it over most of its range, or "
                 "give the value",
                 joint().name, way, range, plane_.turns() ? "rad" : "m", n));
    return true;
  }
  const bool pin_open = open(OpenKind::kBarrelPin) || open(OpenKind::kRodPin);
  if (pin_open && !plane_.turns()) {
    ask(fit, fmt::format("pins of the prismatic joint {} are not searched; give them, or "
                         "`linkage: {{type: direct}}`",
                         joint().name));
    return true;
  }
  if (std::holds_alternative<FourBarLinkage>(cylinder().linkage) &&
      static_cast<int>(searched().size()) > options_.four_bar_values) {
    ask(fit, fmt::format("{} numbers of this four-bar are open, and the curve of stroke over angle "
                         "tells about {}; measure the lengths of rocker and coupler and the pin on "
                         "each link, and leave at most {} numbers open (a pin is two)",
                         searched().size(), options_.four_bar_values, options_.four_bar_values));
    return true;
  }
  return false;
}

VectorXd Search::pins_start(const StrokeRows& data, double zero) const {
  MatrixXd columns(data.q.size(), 3);
  columns.col(0).setOnes();
  columns.col(1) = data.q.array().cos();
  columns.col(2) = data.q.array().sin();
  const VectorXd squared = (data.stroke.array() + zero).square();
  const VectorXd c = least_squares_of_least_norm(columns, squared);
  const double product = 0.5 * std::hypot(c[1], c[2]);
  const double angle = std::atan2(c[2], -c[1]);
  const double sum = std::max(c[0], 2.0 * product);
  const double spread = std::sqrt(std::max(sum * sum - 4.0 * product * product, 0.0));
  const double longer = std::sqrt(0.5 * (sum + spread));
  const double shorter = longer > 0.0 ? product / longer : 0.0;
  const auto& pins = std::get<PinsLinkage>(cylinder().linkage);
  std::vector<double> theta;
  if (both_pins_open()) {
    // Strokes do not tell which arm is at the barrel: the longer one, by rule.
    theta = {pins.barrel_on_parent ? longer : shorter, pins.barrel_on_parent ? shorter : longer,
             angle};
  } else if (open(OpenKind::kBarrelPin) || open(OpenKind::kRodPin)) {
    const bool parent_open = open(OpenKind::kBarrelPin) == pins.barrel_on_parent;
    const Eigen::Vector2d known =
        parent_open ? plane_.of_child(pins.child_pin) : plane_.of_parent(pins.parent_pin);
    const double arm = product / std::max(known.norm(), 1e-6);
    const double at = std::atan2(known.y(), known.x()) + (parent_open ? -angle : angle);
    theta = {arm * std::cos(at), arm * std::sin(at)};
  }
  if (open(OpenKind::kZeroLength)) theta.push_back(zero);
  return VectorXd::Map(theta.data(), static_cast<Index>(theta.size()));
}

std::vector<VectorXd> Search::starts(const StrokeRows& data) const {
  std::vector<VectorXd> list;
  std::vector<double> zeros = {cylinder().length_at_zero_stroke.value_or(0.0)};
  if (open(OpenKind::kZeroLength)) {
    zeros.clear();
    for (int k = 0; k < kLengths; ++k)
      zeros.push_back(kShortest * std::pow(kLongest / kShortest, k / (kLengths - 1.0)));
  }
  if (std::holds_alternative<PinsLinkage>(cylinder().linkage) && plane_.turns()) {
    for (const double zero : zeros) list.push_back(pins_start(data, zero));
    return list;
  }
  const auto count = static_cast<Index>(searched().size());
  if (std::holds_alternative<FourBarLinkage>(cylinder().linkage)) {
    /// Starts, low-discrepancy points (additive recurrence, Roberts 2018) over sizes of a working machine's knuckle.
    /// @threshold [1] 20..2000; chosen: four numbers, each met to a fourth of its range
    constexpr int kStarts = 250;
    double root = 2.0;
    for (int k = 0; k < 30; ++k) root = std::pow(1.0 + root, 1.0 / static_cast<double>(count + 1));
    const std::vector<Searched> names = searched();
    for (int s = 0; s < kStarts; ++s) {
      VectorXd theta(count);
      for (Index p = 0; p < count; ++p) {
        const double u =
            std::fmod(0.5 + (s + 1) * std::pow(1.0 / root, static_cast<double>(p + 1)), 1.0);
        const bool coordinate =
            names[static_cast<std::size_t>(p)].name.find("pin, ") != std::string::npos;
        theta[p] = coordinate ? plane_.reach() * (2.0 * u - 1.0) : kShortest + 1.5 * u;
      }
      list.push_back(theta);
    }
    return list;
  }
  for (const double zero : zeros)
    list.push_back(VectorXd::Constant(count, zero > 0.0 ? zero : 0.1));
  if (std::holds_alternative<RackLinkage>(cylinder().linkage) ||
      std::holds_alternative<DirectLinkage>(cylinder().linkage))
    list.push_back(VectorXd::Constant(count, -0.1));
  return list;
}

CurveFit Search::fitted(const StrokeRows& data, const VectorXd& start, int iterations) {
  const Index n = data.q.size();
  const VectorXd scale = VectorXd::Ones(start.size());
  VectorXd weight(n);  // one over the standard deviation of each row
  const auto stroke = [&](Index k) {
    return cylinder_length(machine_, index_, data.q[k]) -
           cylinder().length_at_zero_stroke.value_or(0.0);
  };
  const Residuals residuals = [&](const VectorXd& theta, VectorXd& residual) {
    apply(theta);
    residual.resize(n);
    try {
      for (Index k = 0; k < n; ++k) residual[k] = (data.stroke[k] - stroke(k)) * weight[k];
    } catch (const std::domain_error&) {
      return false;
    }
    return residual.allFinite();
  };
  CurveFit fit;
  fit.theta = start;
  for (int pass = 0; pass < 3; ++pass) {
    apply(fit.theta);
    try {
      for (Index k = 0; k < n; ++k) {
        const double slope = linkage_rates(machine_, index_, data.q[k]).d1;
        weight[k] = 1.0 / std::hypot(data.stroke_noise, slope * data.position_noise);
      }
    } catch (const std::domain_error&) {
      return fit;
    }
    if (!weight.allFinite()) return fit;
    if (pass > 0) {  // Rows far off count less.
      VectorXd residual;
      if (!residuals(fit.theta, residual)) return fit;
      const double spread = std::max(1.0, robust_std(residual));
      for (Index k = 0; k < n; ++k)
        weight[k] *= std::sqrt(huber_weight(residual[k], 2.0 * kHuberStds * spread));
    }
    fit = fit_curve(residuals, fit.theta, scale, iterations);
    if (!fit.defined) return fit;
  }
  apply(fit.theta);
  return fit;
}

double Search::largest_half_width(const Searched& s, double value, const StrokeRows& data) const {
  if (s.unit == "rad") return options_.largest_width;
  if (s.name.find("pin, ") != std::string::npos) return options_.largest_width * plane_.reach();
  if (s.name == path(OpenKind::kZeroLength))
    return options_.largest_width * std::abs(value + median(data.stroke));  // the cylinder's length
  return options_.largest_width * std::abs(value);
}

void Search::conclude(const StrokeRows& data, const CurveFit& best, LinkageFit& fit) {
  const VectorXd half =
      intervals_of({best.jacobian, best.residual, data.block}, {1, options_.hold_out_blocks}).half;
  const std::vector<Searched> names = searched();
  fit.determined = true;
  const std::string& name = cylinder().name;
  const std::string source =
      fmt::format("strokes of {} and positions of {}, {} rows", name, joint().name, data.q.size());
  for (Index p = 0; p < half.size(); ++p) {
    const Searched& s = names[static_cast<std::size_t>(p)];
    fit.values.push_back({s.name, best.theta[p], half[p], s.unit, source, "", {}, index_});
    if (half[p] <= largest_half_width(s, best.theta[p], data)) continue;
    if (fit.determined) {
      ask(fit, fmt::format(
                   "the logs tell {} only to {:.3g} ± {:.2g} {} (95 %), over {:.3g} of {:.3g} {} "
                   "of {}; move {} over more of its range, or give {}",
                   s.name, best.theta[p], half[p], s.unit, data.q.maxCoeff() - data.q.minCoeff(),
                   joint().position.hi - joint().position.lo, plane_.turns() ? "rad" : "m",
                   joint().name, joint().name,
                   both_pins_open() && open(OpenKind::kZeroLength)
                       ? "length_at_zero_stroke or one of the two pins"
                       : "the value"));
    }
    fit.determined = false;
  }
  VectorXd error(data.q.size());
  for (Index k = 0; k < error.size(); ++k)
    error[k] = data.stroke[k] - stroke_at(machine_, index_, data.q[k]);
  const double rmse = std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
  const double scale = robust_std(best.residual);
  if (scale > kUnexplained && rmse > kPlay) {
    fit.warnings.push_back(fmt::format(
        "the linkage of {} leaves {:.1f} mm of its strokes unexplained, {:.1f} times their noise; "
        "check its type{} and whether stroke and position are logged at the same time",
        name, 1e3 * rmse, scale,
        open(OpenKind::kZeroLength) ? "" : ", length_at_zero_stroke (leave it open)"));
  }
  if (!both_pins_open()) return;
  fit.notes.push_back(fmt::format(
      "{0}: strokes and forces are the same when both pins turn about the joint together and when "
      "their arms are exchanged; by rule the longer arm is at the barrel and the pin on {1} lies "
      "on "
      "the line from its joint to the next. Drawings, collisions and masses of barrel and rod "
      "depend on it, nothing else; give one pin to decide it",
      name, joint().name));
}

LinkageFit Search::run(const SketchRows& rows) {
  LinkageFit fit;
  const StrokeRows data =
      stroke_rows(rows, rows.cylinders[static_cast<std::size_t>(index_)], cylinder().joint);
  if (asked_before_search(rows, data, fit)) return fit;
  const Linkage sketched = cylinder().linkage;
  const StrokeRows few = thinned(data, kStartRows);
  std::vector<CurveFit> found;
  const std::vector<VectorXd> all = starts(few);
  found.reserve(all.size());
  const auto cheaper = [](const CurveFit& a, const CurveFit& b) { return a.cost < b.cost; };
  for (const VectorXd& start : all) {
    CurveFit raw = fitted(few, start, 0);
    if (raw.defined) found.push_back(std::move(raw));
  }
  std::sort(found.begin(), found.end(), cheaper);
  if (found.size() > kStartsFollowed) found.resize(kStartsFollowed);
  for (CurveFit& f : found) {
    CurveFit rough = fitted(few, f.theta, 25);
    if (rough.defined && rough.cost < f.cost) f = std::move(rough);
  }
  std::sort(found.begin(), found.end(), cheaper);
  CurveFit best;
  if (!found.empty()) best = fitted(data, found.front().theta, 60);
  if (!best.defined) {
    cylinder().linkage = sketched;
    ask(fit, fmt::format("no linkage of this type was found that gives the strokes of {} at the "
                         "positions of {}; check its type, or give the value",
                         cylinder().name, joint().name));
    return fit;
  }
  conclude(data, best, fit);
  return fit;
}

}  // namespace

LinkageFit fit_linkage(const MachineSketch& sketch, int cylinder, const SketchRows& rows,
                       const MachineFromLogOptions& options, Machine& machine) {
  return Search(sketch, cylinder, options, machine).run(rows);
}

}  // namespace sparflow::from_log
