#include "identification/machine_from_log/load_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "identification/machine_from_log/flow_areas.h"
#include "identification/machine_from_log/weighted_fit.h"
#include "models/math/linear_algebra.h"
#include "models/math/robust.h"

namespace sparflow::from_log {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows of a cylinder below which its forces tell nothing.
/// @threshold [1] 10..1000; chosen: a second of motion at 50 Hz
constexpr Index kFewestLoadRows = 50;
/// Passes of Gauss-Newton with new weights.
/// @threshold [1] 3..100; numerical: the areas converge quadratically
constexpr int kPasses = 15;
/// Residual of a cylinder, as share of its load, that it has at least.
/// @threshold [1] 1e-6..0.01; numerical: digits of a log
constexpr double kLeastResidual = 1e-4;
/// Share of the known force's square below which what is left of it beside free masses is rounding.
/// @threshold [1] 1e-14..1e-4; numerical: a ten-thousandth of the force
constexpr double kRoundedForce = 1e-8;
constexpr double kUnknown = std::numeric_limits<double>::infinity();

/// Places of a cylinder's unknowns in the vector; -1: known.
struct Places {
  Index piston = -1, rod = -1;
  Index coulomb = -1, viscous = -1, inertia = -1;
  Index errors = -1;  // the first of error_count(); -1: none
};

class Balance {
 public:
  Balance(const std::vector<LoadRows>& loads, LoadFit& fit, Index unknowns,
          const MachineFromLogOptions& options)
      : loads_(loads), fit_(fit), unknowns_(unknowns), options_(options) {}

  /// Estimates everything from the cylinders that take part.
  void solve();

 private:
  void place_unknowns();
  void evaluate();
  void evaluate_cylinder(std::size_t i, Index& at);
  void step();
  void store(const VectorXd& theta);
  void free_directions(const MatrixXd& information);
  double load_over_noise() const;
  void intervals();

  const std::vector<LoadRows>& loads_;
  LoadFit& fit_;
  Index unknowns_;
  const MachineFromLogOptions& options_;
  std::vector<Places> places_;
  Index size_ = 0, rows_ = 0;
  Index measured_ = 0;  // rows that are no prior value
  VectorXd theta_;
  MatrixXd jacobian_;  // of residuals of unit variance
  VectorXd residual_;  // of unit variance
  Eigen::VectorXi block_;
  double correlated_ = 1.0;  // rows that count as one
};

void Balance::place_unknowns() {
  places_.assign(loads_.size(), {});
  size_ = unknowns_;
  rows_ = 0;
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    const AreaState& area = fit_.areas[i];
    if (!fit_.used[i]) continue;
    Places& p = places_[i];
    if (!loads_[i].load_cell) {
      if (area.bore_open) p.piston = size_++;
      if (area.rod_open) p.rod = size_++;
    }
    p.coulomb = size_++;
    p.viscous = size_++;
    p.inertia = size_++;
    rows_ += loads_[i].rows();
    if (options_.model_error > 0.0) {
      p.errors = size_;
      size_ += error_count();
    }
  }
  measured_ = rows_;
  // Areas by flow are rows of their own.
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    if (!fit_.used[i]) continue;
    if (places_[i].errors >= 0) rows_ += error_count();
    if (places_[i].piston >= 0 && fit_.areas[i].flow_piston_std > 0.0) ++rows_;
    if (places_[i].rod >= 0 && fit_.areas[i].flow_annulus_std > 0.0) ++rows_;
  }
  theta_ = VectorXd::Zero(size_);
  theta_.head(unknowns_) = fit_.masses;
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    if (places_[i].piston >= 0) theta_[places_[i].piston] = fit_.areas[i].piston;
    if (places_[i].rod >= 0) theta_[places_[i].rod] = fit_.areas[i].rod;
    if (places_[i].coulomb < 0) continue;
    theta_[places_[i].coulomb] = fit_.friction[i].coulomb;
    theta_[places_[i].viscous] = fit_.friction[i].viscous;
    theta_[places_[i].inertia] = fit_.friction[i].inertia;
    if (places_[i].errors >= 0 && fit_.friction[i].errors.size() > 0)
      theta_.segment(places_[i].errors, error_count()) = fit_.friction[i].errors;
  }
  std::set<int> blocks;
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    if (fit_.used[i]) blocks.insert(loads_[i].block.begin(), loads_[i].block.end());
  }
  /// Residuals of a block that count as independent of each other.
  /// @threshold [1] 1..50; chosen: what is left after smoothing swings a few times in two seconds
  constexpr double kInBlock = 4.0;
  correlated_ = std::max(1.0, static_cast<double>(measured_) /
                                  (kInBlock * std::max(1.0, static_cast<double>(blocks.size()))));
}

void Balance::evaluate() {
  jacobian_ = MatrixXd::Zero(rows_, size_);
  residual_ = VectorXd::Zero(rows_);
  block_ = Eigen::VectorXi::Constant(rows_, -1);
  Index at = 0;
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    if (fit_.used[i]) evaluate_cylinder(i, at);
  }
  // A prior value counts as one independent value, of which rows have fewer than their number.
  const double weight = std::sqrt(correlated_);
  const auto put_prior = [&](double value, double std) {
    residual_[at] = weight * value / std;
    return weight / std;
  };
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    if (!fit_.used[i]) continue;
    const AreaState& area = fit_.areas[i];
    const Places& p = places_[i];
    for (Index k = 0; p.errors >= 0 && k < error_count(); ++k, ++at)
      jacobian_(at, p.errors + k) = put_prior(theta_[p.errors + k], 1.0);
    if (p.piston >= 0 && area.flow_piston_std > 0.0) {
      jacobian_(at, p.piston) = -put_prior(area.flow_piston - area.piston, area.flow_piston_std);
      ++at;
    }
    if (p.rod >= 0 && area.flow_annulus_std > 0.0) {
      const double slope =
          put_prior(area.flow_annulus - (area.piston - area.rod), area.flow_annulus_std);
      if (p.piston >= 0) jacobian_(at, p.piston) = -slope;
      jacobian_(at, p.rod) = slope;
      ++at;
    }
  }
}

/// Rows of one cylinder, from `at` on.
void Balance::evaluate_cylinder(std::size_t i, Index& at) {
  const LoadRows& l = loads_[i];
  const Places& p = places_[i];
  const AreaState& area = fit_.areas[i];
  FrictionState& friction = fit_.friction[i];
  const double piston = area.piston, rod = area.rod;
  const Index n = l.rows();
  const VectorXd weight_force = l.known + l.masses * theta_.head(unknowns_);
  if (friction.scale.speed == 0.0) friction.scale = error_scale(l, piston, weight_force);
  MatrixXd errors;
  VectorXd load = weight_force + l.inertia + theta_[p.coulomb] * l.direction +
                  theta_[p.viscous] * l.speed + theta_[p.inertia] * l.acceleration;
  if (p.errors >= 0) {
    errors = error_columns(l, weight_force, friction.scale, options_);
    load += errors * theta_.segment(p.errors, error_count());
  }
  const VectorXd r =
      l.load_cell ? VectorXd(l.force - load)
                  : VectorXd(l.pressure_a - l.pressure_b + (rod * l.pressure_b - load) / piston);
  const double by_force = l.load_cell ? -1.0 : -1.0 / piston;
  const double typical =
      (l.load_cell ? l.force : l.pressure_a).norm() / std::sqrt(static_cast<double>(n));
  const double spread = std::max(robust_std(r), kLeastResidual * typical);
  MatrixXd j = MatrixXd::Zero(n, size_);
  j.leftCols(unknowns_) = by_force * l.masses;
  j.col(p.coulomb) = by_force * l.direction;
  j.col(p.viscous) = by_force * l.speed;
  j.col(p.inertia) = by_force * l.acceleration;
  if (p.errors >= 0) j.middleCols(p.errors, error_count()) = by_force * errors;
  // A rod that is known keeps its section while the piston's area moves.
  if (p.piston >= 0) j.col(p.piston) = (load - rod * l.pressure_b) / (piston * piston);
  if (p.rod >= 0) j.col(p.rod) = l.pressure_b / piston;
  for (Index k = 0; k < n; ++k) {
    const double weight = std::sqrt(huber_weight(r[k], 2.0 * kHuberStds * spread)) / spread;
    residual_[at + k] = weight * r[k];
    jacobian_.row(at + k) = weight * j.row(k);
    block_[at + k] = l.block[k];
  }
  at += n;
}

/// One Gauss-Newton step in the directions that the rows determine.
void Balance::step() {
  VectorXd scale(size_);
  for (Index k = 0; k < size_; ++k) {
    scale[k] = jacobian_.col(k).norm();
    if (!(scale[k] > 0.0)) scale[k] = 1.0;
  }
  const MatrixXd scaled = jacobian_ * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(transposed_product(scaled, scaled));
  const VectorXd along = eigen.eigenvectors().transpose() * (scaled.transpose() * residual_);
  VectorXd move = VectorXd::Zero(size_);
  /// Eigenvalue of the scaled information below which a direction is left where it is.
  /// @threshold [1] 1e-14..1e-6; numerical: rounding of sums over thousands of rows
  constexpr double kRounding = 1e-11;
  for (Index k = 0; k < size_; ++k) {
    if (eigen.eigenvalues()[k] > kRounding)
      move -= along[k] / eigen.eigenvalues()[k] * eigen.eigenvectors().col(k);
  }
  store(theta_ + scale.cwiseInverse().asDiagonal() * move);
}

void Balance::store(const VectorXd& theta) {
  theta_ = theta;
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    const Places& p = places_[i];
    AreaState& area = fit_.areas[i];
    // An area falls at most to half and rises at most to the double of its last value in a step.
    if (p.piston >= 0) {
      area.piston = theta_[p.piston] =
          std::clamp(theta_[p.piston], 0.5 * area.piston, 2.0 * area.piston);
    }
    if (p.rod >= 0) {
      area.rod = theta_[p.rod] = std::clamp(theta_[p.rod], 0.0, 0.98 * area.piston);
    }
    if (p.coulomb < 0) continue;
    fit_.friction[i].coulomb = theta_[p.coulomb];
    fit_.friction[i].viscous = theta_[p.viscous];
    fit_.friction[i].inertia = theta_[p.inertia];
    if (p.errors >= 0) fit_.friction[i].errors = theta_.segment(p.errors, error_count());
  }
  fit_.masses = theta_.head(unknowns_);
}

/// Load of the rows in units of their noise: what counts as large.
double Balance::load_over_noise() const {
  double load = 0.0;
  Index count = 0;
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    if (!fit_.used[i]) continue;
    const LoadRows& l = loads_[i];
    const VectorXd all = l.known + l.inertia + l.masses * fit_.masses;
    const VectorXd r = l.load_cell ? VectorXd(l.force - all)
                                   : VectorXd((l.pressure_a - l.pressure_b) * fit_.areas[i].piston +
                                              fit_.areas[i].rod * l.pressure_b - all);
    load += all.squaredNorm() / std::max(std::pow(robust_std(r), 2.0), 1e-12);
    count += l.rows();
  }
  return std::sqrt(load / static_cast<double>(std::max<Index>(count, 1)));
}

/// Directions of the masses that the rows do not determine beside all else.
void Balance::free_directions(const MatrixXd& information) {
  if (unknowns_ == 0) return;
  const Index others = size_ - unknowns_;
  MatrixXd own = information.topLeftCorner(unknowns_, unknowns_);
  if (others > 0) {
    const MatrixXd cross = information.topRightCorner(unknowns_, others);
    const MatrixXd rest = information.bottomRightCorner(others, others);
    own -= cross * solve_symmetric_columns(rest, cross.transpose());
  }
  // Each unknown in the unit in which it gives as much as the rows' noise.
  VectorXd unit(unknowns_);
  double largest = 0.0;
  for (Index k = 0; k < unknowns_; ++k) {
    unit[k] = std::sqrt(std::max(information(k, k) / static_cast<double>(rows_), 0.0));
    largest = std::max(largest, unit[k]);
  }
  std::vector<VectorXd> free;
  std::vector<Index> live;
  for (Index k = 0; k < unknowns_; ++k) {
    if (unit[k] > 1e-9 * largest && largest > 0.0) {
      live.push_back(k);
    } else {
      free.push_back(VectorXd::Unit(unknowns_, k));
    }
  }
  const auto n = static_cast<Index>(live.size());
  MatrixXd scaled(n, n);
  for (Index a = 0; a < n; ++a) {
    for (Index b = 0; b < n; ++b) {
      const Index i = live[static_cast<std::size_t>(a)], j = live[static_cast<std::size_t>(b)];
      scaled(a, b) = own(i, j) / (unit[i] * unit[j]);
    }
  }
  const double limit = options_.undetermined * std::max(load_over_noise(), 10.0);
  const auto undetermined = [&](double along) {
    return 1.0 / std::sqrt(std::max(along / correlated_, 1e-300)) >= limit;
  };
  std::vector<VectorXd> confounded;
  if (n > 0) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scaled);
    Index open = 0;  // eigenvalues ascend
    while (open < n && undetermined(eigen.eigenvalues()[open])) ++open;
    // Of what is free, turned so that its forces are apart: what has a force that would be determined alone.
    MatrixXd alone(n, n);
    for (Index a = 0; a < n; ++a) {
      for (Index b = 0; b < n; ++b) {
        const Index i = live[static_cast<std::size_t>(a)], j = live[static_cast<std::size_t>(b)];
        alone(a, b) = information(i, j) / (unit[i] * unit[j]);
      }
    }
    const MatrixXd within = eigen.eigenvectors().leftCols(open);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> forces =
        open > 0 ? Eigen::SelfAdjointEigenSolver<MatrixXd>(within.transpose() * alone * within)
                 : Eigen::SelfAdjointEigenSolver<MatrixXd>();
    for (Index k = 0; k < open; ++k) {
      VectorXd direction = VectorXd::Zero(unknowns_);
      const VectorXd turned = within * forces.eigenvectors().col(k);
      for (Index a = 0; a < n; ++a) {
        const Index i = live[static_cast<std::size_t>(a)];
        direction[i] = turned[a] / unit[i];
      }
      free.push_back(direction / direction.norm());
      if (!undetermined(forces.eigenvalues()[k])) confounded.push_back(free.back());
    }
  }
  const auto columns = [&](const std::vector<VectorXd>& list) {
    MatrixXd all(unknowns_, static_cast<Index>(list.size()));
    for (std::size_t k = 0; k < list.size(); ++k) all.col(static_cast<Index>(k)) = list[k];
    return all;
  };
  fit_.free = columns(free);
  fit_.confounded = columns(confounded);
}

void Balance::intervals() {
  const Intervals found =
      intervals_of({jacobian_, residual_, block_, correlated_}, {1, options_.hold_out_blocks});
  const VectorXd& half = found.half;
  fit_.squared_half.clear();
  for (const MatrixXd& all : found.squared)
    fit_.squared_half.emplace_back(all.topLeftCorner(unknowns_, unknowns_));
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    const Places& p = places_[i];
    if (p.piston >= 0) fit_.areas[i].piston_half = half[p.piston];
    if (p.rod >= 0) fit_.areas[i].rod_half = half[p.rod];
    if (p.coulomb >= 0) fit_.friction[i].coulomb_half = half[p.coulomb];
  }
}

void Balance::solve() {
  place_unknowns();
  if (rows_ == 0) {
    fit_.free = MatrixXd::Identity(unknowns_, unknowns_);
    fit_.squared_half.clear();
    return;
  }
  for (int pass = 0; pass < kPasses; ++pass) {
    evaluate();
    step();
  }
  evaluate();
  free_directions(transposed_product(jacobian_, jacobian_));
  intervals();
}

/// Start of a cylinder's areas from the balance written as force, where what is known explains enough of it.
/// @return whether its scale is set
bool start_areas(const LoadRows& l, const LoadFit& fit, const MachineFromLogOptions& options,
                 AreaState& area) {
  const Index n = l.rows();
  if (n < kFewestLoadRows || l.load_cell) return false;
  // F = A_A (pA - pB) + A_D pB; what is known goes to the right side, what is free beside the areas to the left.
  std::vector<VectorXd> pressures;
  // Static forces alone: what a payload's inertia adds is too small to set a scale.
  VectorXd known = l.known + l.masses * fit.masses;
  if (area.bore_open) {
    pressures.push_back(l.pressure_a - l.pressure_b);
  } else {
    known -= area.piston * (l.pressure_a - l.pressure_b);
  }
  if (area.rod_open) {
    pressures.push_back(l.pressure_b);
  } else {
    known -= area.rod * l.pressure_b;
  }
  const auto areas = static_cast<Index>(pressures.size());
  MatrixXd free(n, fit.free.cols() + 3);
  free.leftCols(fit.free.cols()) = l.masses * fit.free;
  free.col(fit.free.cols()) = l.direction;
  free.col(fit.free.cols() + 1) = l.speed;
  free.col(fit.free.cols() + 2).setOnes();
  MatrixXd all(n, areas + free.cols());
  for (Index k = 0; k < areas; ++k) all.col(k) = pressures[static_cast<std::size_t>(k)];
  all.rightCols(free.cols()) = free;
  VectorXd scale(all.cols());
  for (Index k = 0; k < all.cols(); ++k) {
    scale[k] = std::max(all.col(k).norm(), 1e-300);
    all.col(k) /= scale[k];
  }
  const MatrixXd beside = all.rightCols(free.cols());
  const VectorXd alone = known - beside * least_squares_of_least_norm(beside, known);
  const VectorXd found = least_squares_of_least_norm(all, known);
  const double left = (known - all * found).squaredNorm(), before = alone.squaredNorm();
  const bool explained = before > kRoundedForce * known.squaredNorm() && before > 0.0 &&
                         1.0 - left / before >= options.least_explained;
  if (!explained) return false;
  Index at = 0;
  if (area.bore_open) area.piston = found[at] / scale[at], ++at;
  if (area.rod_open) area.rod = found[at] / scale[at];
  if (!(area.piston > 0.0)) return false;
  area.rod = std::clamp(area.rod, 0.0, 0.95 * area.piston);
  return true;
}

}  // namespace

double LoadFit::half_of(const VectorXd& weights) const {
  double largest = 0.0;
  for (const MatrixXd& s : squared_half) largest = std::max(largest, weights.dot(s * weights));
  return std::sqrt(largest);
}

VectorXd force_beside_load(const LoadRows& rows, const VectorXd& load,
                           const FrictionState& friction, const MachineFromLogOptions& options) {
  VectorXd force = friction.coulomb * rows.direction + friction.viscous * rows.speed +
                   friction.inertia * rows.acceleration;
  if (friction.errors.size() > 0)
    force += error_columns(rows, load, friction.scale, options) * friction.errors;
  return force;
}

LoadFit fit_loads(const Known& known, const std::vector<LoadRows>& loads) {
  const MachineSketch& sketch = known.sketch;
  const Machine& machine = known.machine;
  const SketchRows& rows = known.rows;
  const MachineFromLogOptions& options = known.options;
  const auto unknowns = static_cast<Index>(mass_unknowns(sketch).size());
  LoadFit fit;
  fit.masses = VectorXd::Zero(unknowns);
  fit.free = MatrixXd::Identity(unknowns, unknowns);
  fit.areas.resize(loads.size());
  fit.friction.resize(loads.size());
  fit.used.assign(loads.size(), false);
  for (std::size_t i = 0; i < loads.size(); ++i) {
    const Cylinder& c = machine.cylinders[i];
    AreaState& area = fit.areas[i];
    area.bore_open = sketch.is_open(OpenKind::kBore, static_cast<int>(i));
    area.rod_open = sketch.is_open(OpenKind::kRod, static_cast<int>(i));
    area.piston = area.bore_open ? 0.0 : c.area_piston();
    area.rod = area.rod_open ? 0.0 : std::numbers::pi / 4.0 * c.rod * c.rod * c.parallel;
    const bool pressures = loads[i].rows() >= kFewestLoadRows;
    if (!area.bore_open && !area.rod_open) {
      fit.used[i] = pressures && (loads[i].load_cell || c.hydraulic());
      continue;
    }
    if (known.resolved[i]) areas_from_flow(machine, static_cast<int>(i), rows, options, area);
    area.has_scale = false;
    fit.used[i] = pressures && loads[i].load_cell;  // areas take no part then
    const bool piston = !area.bore_open || area.flow_piston_std > 0.0;
    const bool rod = !area.rod_open || area.flow_annulus_std > 0.0;
    if (!piston || (!rod && !pressures)) continue;
    if (area.bore_open) {
      area.piston = area.flow_piston;
      area.piston_half = 1.96 * area.flow_piston_std;
      area.source = "flow and speed";
    }
    if (area.rod_open && rod) {
      area.rod = std::clamp(area.piston - area.flow_annulus, 0.0, 0.98 * area.piston);
      area.rod_half = std::hypot(area.piston_half, 1.96 * area.flow_annulus_std);
    } else if (area.rod_open) {
      area.rod = 0.5 * area.piston;
    }
    area.has_scale = true;
    fit.used[i] = pressures;
    if (fit.used[i] && !loads[i].load_cell) area.source = "flow, pressures and static force";
  }
  Balance(loads, fit, unknowns, options).solve();
  // What is known about the masses now may set the scale of further cylinders.
  for (bool more = true; more;) {
    more = false;
    for (std::size_t i = 0; i < loads.size(); ++i) {
      if (fit.areas[i].has_scale || fit.used[i]) continue;
      if (!start_areas(loads[i], fit, options, fit.areas[i])) continue;
      fit.areas[i].has_scale = fit.used[i] = more = true;
      fit.areas[i].source = "pressures and static force";
    }
    if (more) Balance(loads, fit, unknowns, options).solve();
  }
  for (AreaState& area : fit.areas) {
    if (area.has_scale) continue;
    if (area.bore_open) area.piston_half = kUnknown;
    if (area.rod_open) area.rod_half = kUnknown;
  }
  return fit;
}

}  // namespace sparflow::from_log
