#include "optimizer/bounds/energy_bound_potential.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/chain/pump_law.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

std::size_t ix(long i) { return static_cast<std::size_t>(i); }

/// Share of the largest rate dx/dq below which a cylinder's length is not used as coordinate (near its dead centre).
/// @threshold [1] 0..1; chosen: there the length hardly changes with the joint, and its inverse is steep
constexpr double kLeastRate = 0.15;

/// Calls function(line, first, count) for every run of consecutive nodes on one line of an axis.
template <class Function>
void over_runs(const Lattice& lattice, int joint, const Function& function) {
  const long stride = lattice.stride[ix(joint)], lines = lattice.lines[ix(joint)].size();
  for (long first = 0; first < lattice.nodes;) {
    for (long line = 0; line < lines; ++line, first += stride) function(line, first, stride);
  }
}

/// Replaces each node's value by the largest of it and its two neighbours along one axis.
void widen(const Lattice& lattice, int joint, std::vector<float>& field) {
  const long lines = lattice.lines[ix(joint)].size();
  const std::vector<float> before = field;
  over_runs(lattice, joint, [&](long line, long first, long count) {
    const auto take = [&](long by) {
      for (long node = first; node < first + count; ++node)
        field[ix(node)] = std::max(field[ix(node)], before[ix(node + by)]);
    };
    if (line > 0) take(-count);
    if (line + 1 < lines) take(count);
  });
}

/// Factor <= 1 by edge for the error of m. The prices are divided by m, which is linear between lines although the
/// prices' mean is curved, so the quotient can be lower inside an edge than at both its ends. The factor is estimated
/// from the second differences of m, with the same fourfold margin as the allowances of edge_costs().
VectorXd chord_factors(const AxisCoordinate& axis) {
  const Eigen::Index lines = axis.x.size();
  VectorXd curve = VectorXd::Zero(lines);
  for (Eigen::Index k = 1; k + 1 < lines; ++k) {
    const double a = axis.x[k] - axis.x[k - 1], b = axis.x[k + 1] - axis.x[k];
    const double second =
        2.0 * ((axis.m[k + 1] - axis.m[k]) / b - (axis.m[k] - axis.m[k - 1]) / a) / (a + b);
    curve[k] = 0.5 * std::max(a, b) * std::max(a, b) * std::max(0.0, second) / axis.m[k];
  }
  if (lines >= 4) {  // the ends of the axis have no second difference: theirs is extrapolated
    const auto grown = [](double next, double after) {
      return next * (after > 0.0 ? std::clamp(next / after, 1.0, 3.0) : 1.0);
    };
    curve[0] = grown(curve[1], curve[2]);
    curve[lines - 1] = grown(curve[lines - 2], curve[lines - 3]);
  }
  VectorXd keep(lines - 1);
  for (Eigen::Index k = 0; k + 1 < lines; ++k) {
    double worst = std::max(curve[k], curve[k + 1]);
    if (k > 0) worst = std::max(worst, curve[k - 1]);
    if (k + 2 < lines) worst = std::max(worst, curve[k + 2]);
    keep[k] = std::max(0.0, 1.0 - worst);
  }
  return keep;
}

}  // namespace

MoveWeights::MoveWeights(const CraneModel& model, const MotionProblem& problem,
                         const Machine& loaded, const std::vector<Range>& force_range)
    : payload_(problem.payload),
      demands_(cylinder_demands(model, problem, force_range)),
      statics_(loaded),
      force_(model.cylinders.size()),
      rate_(model.cylinders.size()) {
  for (const PumpModel& pump : model.pumps) standby_.push_back(pump.standby);
}

void MoveWeights::prices(const double* /*q*/, const double* force, const double* rate,
                         Eigen::MatrixX2d& price) const {
  price.setZero();
  for (const CylinderDemand& d : demands_) {
    for (const int direction : {0, 1}) {
      const int side = (direction == 0) == (rate[d.cylinder] > 0.0) ? 0 : 1;
      double pressure = standby_[ix(d.pump)];
      if (d.load_sensing)
        pressure = pump_pressure(pressure, d.table[side].least(force[d.cylinder]));
      price(d.joint, direction) +=
          std::max(0.0, pressure) * d.area[side] * std::abs(rate[d.cylinder]);
    }
  }
}

void MoveWeights::update(const VectorXd& q) {
  statics_.update(q.data(), payload_, 0);
  for (std::size_t c = 0; c < force_.size(); ++c) {
    force_[c] = statics_.force()[static_cast<Eigen::Index>(c)];
    rate_[c] = statics_.length(static_cast<int>(c)).d1;
  }
}

void MoveWeights::at(const VectorXd& q, Eigen::MatrixX2d& weight) {
  update(q);
  weight.resize(q.size(), 2);
  prices(q.data(), force_.data(), rate_.data(), weight);
}

Lattice bound_lattice(const MotionProblem& problem, const std::vector<int>& cells) {
  std::vector<VectorXd> lines;
  for (std::size_t j = 0; j < cells.size(); ++j) {
    const double start = problem.start[static_cast<Eigen::Index>(j)];
    lines.push_back(axis_lines(problem.limits.position[j], {start}, cells[j]));
  }
  return Lattice(std::move(lines));
}

std::vector<int> balanced_cells(const std::vector<Eigen::Vector2d>& losses, const Lattice& coarse,
                                double nodes) {
  const std::size_t n = losses.size();
  std::vector<double> lines(n);
  for (std::size_t j = 0; j < n; ++j) {
    /// Relative loss by interpolation above which prices vary along an axis.
    /// @threshold [1] 0..1e-6; numerical: rounding of second differences
    constexpr double kNoLoss = 1e-9;
    const bool varies = losses[j][0] > kNoLoss || losses[j][1] > kNoLoss;
    // Two cells suffice along an axis that changes no price; on others second differences must be computable.
    lines[j] = varies ? 7.0 : 3.0;
  }
  const auto gain = [&](std::size_t j) {  // loss that 1 % more lines saves
    const double ratio = static_cast<double>(coarse.lines[j].size() - 1) / (lines[j] - 1.0);
    return losses[j][0] * ratio + 2.0 * losses[j][1] * ratio * ratio;
  };
  double count = 1.0;
  for (const double l : lines) count *= l;
  /// Factor by which an axis' number of lines grows in a step.
  /// @threshold [1] 1.001..1.5; chosen: two per cent, far below a line of any axis
  constexpr double kGrowth = 1.02;
  /// Gain below which no axis gets further lines.
  /// @threshold [1] 0..1e-3; numerical: nothing varies along any axis then
  constexpr double kLeastGain = 1e-7;
  while (count < nodes) {
    std::size_t best = 0;
    for (std::size_t j = 1; j < n; ++j) {
      if (gain(j) > gain(best)) best = j;
    }
    if (!(gain(best) > kLeastGain)) break;
    lines[best] *= kGrowth;
    count *= kGrowth;
  }
  std::vector<int> cells;
  cells.reserve(lines.size());
  for (const double l : lines) cells.push_back(static_cast<int>(std::lround(l)) - 1);
  return cells;
}

EnergyPotential::EnergyPotential(const Machine& loaded, const MotionProblem& problem,
                                 const MoveWeights& weights, Lattice lattice,
                                 const LatticeForces& forces)
    : machine_(&loaded), lattice_(std::move(lattice)) {
  losses_.assign(ix(lattice_.joints()), Eigen::Vector2d::Zero());
  make_costs(forces, weights);
  solve(lattice_.nearest_node(problem.start));
}

void EnergyPotential::make_costs(const LatticeForces& forces, const MoveWeights& weights) {
  const int n = lattice_.joints();
  const std::size_t cylinders = forces.length.size();
  cost_.resize(ix(n));
  axes_.resize(ix(n));
  for (auto& both : cost_) {
    for (auto& field : both) field.resize(ix(lattice_.nodes));
  }
  std::vector<double> force(cylinders), rate(cylinders);
  Eigen::MatrixX2d price(n, 2);
  for (long node = 0; node < lattice_.nodes; ++node) {
    forces.at(*machine_, lattice_, node, force.data(), rate.data());
    const VectorXd q = lattice_.posture(node);
    weights.prices(q.data(), force.data(), rate.data(), price);
    for (int j = 0; j < n; ++j) {
      for (const int direction : {0, 1}) {
        cost_[ix(j)][ix(direction)][ix(node)] = static_cast<float>(price(j, direction));
      }
    }
  }
  for (int j = 0; j < n; ++j) {
    const VectorXd& lines = lattice_.lines[ix(j)];
    AxisCoordinate& axis = axes_[ix(j)];
    int own = 0;  // number of cylinders that drive this joint
    for (const CylinderDemand& d : weights.demands()) {
      if (d.joint != j) continue;
      ++own;
      axis.cylinder = d.cylinder;
    }
    const bool monotone = own == 1 && [&] {
      const auto rates = forces.rate[ix(axis.cylinder)].array();
      return rates.minCoeff() * rates.maxCoeff() > 0.0 &&
             rates.abs().minCoeff() > kLeastRate * rates.abs().maxCoeff();
    }();
    if (!monotone) axis.cylinder = -1;
    axis.x = axis.cylinder < 0 ? lines
                               : VectorXd((forces.length[ix(axis.cylinder)].array() -
                                           forces.length[ix(axis.cylinder)][0])
                                              .abs());
    // From here on the field holds prices per unit of x; m is their mean along the axis.
    std::array<std::vector<float>, 2>& field = cost_[ix(j)];
    VectorXd sum = VectorXd::Zero(lines.size());
    over_runs(lattice_, j, [&](long line, long first, long count) {
      const auto per = static_cast<float>(
          axis.cylinder < 0 ? 1.0 : std::abs(forces.rate[ix(axis.cylinder)][line]));
      for (auto& f : field) {
        for (long node = first; node < first + count; ++node) {
          f[ix(node)] /= per;
          sum[line] += static_cast<double>(f[ix(node)]);
        }
      }
    });
    const double top = sum.maxCoeff();
    axis.m = top > 0.0 ? VectorXd((sum / top).cwiseMax(1e-3)) : VectorXd::Ones(lines.size());
    axis.u.setZero(lines.size());
    for (Eigen::Index k = 1; k < lines.size(); ++k) {
      axis.u[k] = axis.u[k - 1] + (axis.x[k] - axis.x[k - 1]) * 0.5 * (axis.m[k] + axis.m[k - 1]);
    }
    over_runs(lattice_, j, [&](long line, long first, long count) {
      const auto m = static_cast<float>(axis.m[line]);
      for (auto& f : field) {
        for (long node = first; node < first + count; ++node) f[ix(node)] /= m;
      }
    });
  }
  for (int j = 0; j < n; ++j) {
    losses_[ix(j)][1] += (1.0 - chord_factors(axes_[ix(j)]).array()).mean();
    for (const int direction : {0, 1}) edge_costs(j, cost_[ix(j)][ix(direction)]);
    // A cylinder that passes its dead centre within an edge can have price zero there.
    for (std::size_t c = 0; c < cylinders; ++c) {
      if (machine_->cylinders[c].joint != j) continue;
      const VectorXd& r = forces.rate[c];
      over_runs(lattice_, j, [&](long line, long first, long count) {
        if (line + 1 >= r.size() || r[line] * r[line + 1] > 0.0) return;
        for (long node = first; node < first + count; ++node)
          cost_[ix(j)][0][ix(node)] = cost_[ix(j)][1][ix(node)] = 0.0F;
      });
    }
  }
}

void EnergyPotential::edge_costs(int joint, std::vector<float>& field) {
  const int n = lattice_.joints();
  // The allowance covers what linear interpolation along each axis can exceed the price by: h^2/8 times a smooth second
  // derivative; at a kink (standby, tabulated least demand) half the larger of the second differences of the cell's
  // nodes times h^2. The latter is four times the former, so it is used for both.
  /// Factor on the second difference of the nodes.
  /// @threshold [1] 0.125..0.5; derived: a smooth function needs an eighth of it, a kink half
  constexpr double kShare = 0.5;
  std::vector<float> allowance(ix(lattice_.nodes), 0.0F);
  for (int k = 0; k < n; ++k) {
    const VectorXd& u = axes_[ix(k)].u;
    const long stride = lattice_.stride[ix(k)], lines = u.size();
    double total = 0.0;
    std::vector<float> along(ix(lattice_.nodes), 0.0F);
    over_runs(lattice_, k, [&](long line, long first, long count) {
      if (line == 0 || line + 1 == lines) return;
      const double a = u[line] - u[line - 1], b = u[line + 1] - u[line], h = std::max(a, b);
      const double per_left = 2.0 * kShare * h * h / (a * (a + b));
      const double per_right = 2.0 * kShare * h * h / (b * (a + b));
      for (long node = first; node < first + count; ++node) {
        const double f = static_cast<double>(field[ix(node)]);
        const double left = static_cast<double>(field[ix(node - stride)]);
        const double right = static_cast<double>(field[ix(node + stride)]);
        const double off = std::max(0.0, per_right * (right - f) - per_left * (f - left));
        along[ix(node)] = static_cast<float>(off);
        if (off > 0.0 && f > 0.0) total += off / f;
      }
    });
    if (lines >= 4) {  // the ends of the axis have no second difference: theirs is extrapolated
      over_runs(lattice_, k, [&](long line, long first, long count) {
        if (line > 0 && line + 1 < lines) return;
        const long in = line == 0 ? stride : -stride;
        for (long node = first; node < first + count; ++node) {
          const float next = along[ix(node + in)], after = along[ix(node + 2 * in)];
          const float growth = after > 0.0F ? std::clamp(next / after, 1.0F, 3.0F) : 1.0F;
          along[ix(node)] = growth * next;
        }
      });
    }
    for (std::size_t node = 0; node < along.size(); ++node) allowance[node] += along[node];
    losses_[ix(k)][1] += 0.5 * total / static_cast<double>(lattice_.nodes);
  }
  for (int k = 0; k < n; ++k) widen(lattice_, k, allowance);
  const VectorXd& u = axes_[ix(joint)].u;
  const VectorXd keep = chord_factors(axes_[ix(joint)]);
  const long stride = lattice_.stride[ix(joint)], lines = u.size();
  double change = 0.0;
  over_runs(lattice_, joint, [&](long line, long first, long count) {
    if (line + 1 == lines) return;
    const double width = u[line + 1] - u[line];
    for (long node = first; node < first + count; ++node) {
      const float a = field[ix(node)], b = field[ix(node + stride)];
      if (a + b > 0.0F) change += static_cast<double>(std::abs(a - b) / (a + b));
      const double least =
          static_cast<double>(std::min(a, b)) -
          static_cast<double>(std::max(allowance[ix(node)], allowance[ix(node + stride)]));
      const auto cost = static_cast<float>(std::max(0.0, least) * keep[line] * width);
      field[ix(node)] = std::nextafter(cost, 0.0F);
    }
  });
  losses_[ix(joint)][0] += 0.5 * change / static_cast<double>(lattice_.nodes);
}

void EnergyPotential::solve(long start) {
  phi_.assign(ix(lattice_.nodes), std::numeric_limits<double>::infinity());
  phi_[ix(start)] = 0.0;
  const unsigned orders = 1u << lattice_.joints();
  // Once sweeps in all orders find no shorter path, the inequality holds on every edge.
  for (unsigned quiet = 0, order = 0; quiet < orders; order = (order + 1) % orders) {
    quiet = sweep(order) ? 0 : quiet + 1;
  }
}

bool EnergyPotential::sweep(unsigned order) {
  const int n = lattice_.joints();
  bool any = false;
  std::vector<long> line(ix(n)), first(ix(n)), last(ix(n)), by(ix(n));
  for (int j = 0; j < n; ++j) {
    const bool down = order >> j & 1u;
    const long end = lattice_.lines[ix(j)].size() - 1;
    first[ix(j)] = down ? end : 0;
    last[ix(j)] = down ? 0 : end;
    by[ix(j)] = down ? -1 : 1;
    line[ix(j)] = first[ix(j)];
  }
  const int inner = n - 1;
  while (true) {
    long node = 0;
    for (int j = 0; j < n; ++j) node += line[ix(j)] * lattice_.stride[ix(j)];
    for (long k = first[ix(inner)];; k += by[ix(inner)], node += by[ix(inner)]) {
      double best = phi_[ix(node)];
      for (int j = 0; j < n; ++j) {
        const long at = j == inner ? k : line[ix(j)];
        if (at == first[ix(j)]) continue;  // nothing upwind
        const long from = node - by[ix(j)] * lattice_.stride[ix(j)];
        const double step = by[ix(j)] > 0 ? static_cast<double>(cost_[ix(j)][0][ix(from)])
                                          : static_cast<double>(cost_[ix(j)][1][ix(node)]);
        best = std::min(best, phi_[ix(from)] + step);
      }
      if (best < phi_[ix(node)] * (1.0 - 1e-12)) {
        phi_[ix(node)] = best;
        any = true;
      }
      if (k == last[ix(inner)]) break;
    }
    int j = inner - 1;
    for (; j >= 0; --j) {
      if (line[ix(j)] == last[ix(j)]) {
        line[ix(j)] = first[ix(j)];
        continue;
      }
      line[ix(j)] += by[ix(j)];
      break;
    }
    if (j < 0) return any;
  }
}

std::vector<long> EnergyPotential::path_to(long node) const {
  std::vector<long> path = {node};
  while (phi_[ix(node)] > 0.0) {
    long before = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int j = 0; j < lattice_.joints(); ++j) {
      const long stride = lattice_.stride[ix(j)];
      const int line = lattice_.line(node, j);
      const auto consider = [&](long from, double step) {
        if (phi_[ix(from)] + step >= least) return;
        least = phi_[ix(from)] + step;
        before = from;
      };
      if (line > 0)
        consider(node - stride, static_cast<double>(cost_[ix(j)][0][ix(node - stride)]));
      if (line + 1 < lattice_.lines[ix(j)].size())
        consider(node + stride, static_cast<double>(cost_[ix(j)][1][ix(node)]));
    }
    // Edges without cost could lead round in a circle; each step therefore lowers the potential.
    if (before < 0 || !(phi_[ix(before)] < phi_[ix(node)])) break;
    node = before;
    path.push_back(node);
  }
  std::reverse(path.begin(), path.end());
  return path;
}

int EnergyPotential::cell_of(int joint, double q) const {
  const VectorXd& lines = lattice_.lines[ix(joint)];
  const auto* end = lines.data() + lines.size();
  const auto above = std::upper_bound(lines.data(), end, q) - lines.data();
  return static_cast<int>(std::clamp<std::ptrdiff_t>(above - 1, 0, lines.size() - 2));
}

double EnergyPotential::coordinate(int joint, int cell, double q) const {
  const AxisCoordinate& axis = axes_[ix(joint)];
  double x = q;
  if (axis.cylinder >= 0) {
    const double first = lattice_.lines[ix(joint)][0];
    x = std::abs(cylinder_length(*machine_, axis.cylinder, q) -
                 cylinder_length(*machine_, axis.cylinder, first));
  }
  const double width = axis.x[cell + 1] - axis.x[cell];
  const double way = std::clamp(x - axis.x[cell], 0.0, width);
  const double slope = (axis.m[cell + 1] - axis.m[cell]) / width;
  return axis.u[cell] + way * (axis.m[cell] + 0.5 * slope * way);
}

double EnergyPotential::coordinate_rate(int joint, int cell, double q) const {
  const AxisCoordinate& axis = axes_[ix(joint)];
  double x = q, rate = 1.0;
  if (axis.cylinder >= 0) {
    const double first = lattice_.lines[ix(joint)][0];
    const Taylor3 length = linkage_rates(*machine_, axis.cylinder, q);
    x = std::abs(length.value - cylinder_length(*machine_, axis.cylinder, first));
    rate = std::abs(length.d1);
  }
  const double share = (x - axis.x[cell]) / (axis.x[cell + 1] - axis.x[cell]);
  return rate * (axis.m[cell] + std::clamp(share, 0.0, 1.0) * (axis.m[cell + 1] - axis.m[cell]));
}

template <class Function>
void EnergyPotential::over_corners(const VectorXd& q, const Function& function) const {
  const int n = lattice_.joints();
  long base = 0;
  std::array<double, 8> share{};
  // no threshold: size of the array
  SPARFLOW_CHECK(n <= 8, "a grid has at most eight joints");
  for (int j = 0; j < n; ++j) {
    const int cell = cell_of(j, q[j]);
    const VectorXd& u = axes_[ix(j)].u;
    share[ix(j)] = (coordinate(j, cell, q[j]) - u[cell]) / (u[cell + 1] - u[cell]);
    base += cell * lattice_.stride[ix(j)];
  }
  for (unsigned corner = 0; corner < 1u << n; ++corner) {
    double weight = 1.0;
    long node = base;
    for (int j = 0; j < n; ++j) {
      const bool up = corner >> j & 1u;
      weight *= up ? share[ix(j)] : 1.0 - share[ix(j)];
      if (up) node += lattice_.stride[ix(j)];
    }
    if (weight > 0.0) function(node, weight);
  }
}

double EnergyPotential::value(const VectorXd& q) const {
  double sum = 0.0;
  over_corners(q, [&](long node, double weight) { sum += weight * phi_[ix(node)]; });
  return sum;
}

void EnergyPotential::corner_values(const VectorXd& lo, const VectorXd& hi,
                                    std::vector<double>& values) const {
  const int n = lattice_.joints();
  // no threshold: size of the array
  SPARFLOW_CHECK(n <= 8, "a grid has at most eight joints");
  const std::size_t corners = std::size_t{1} << n;
  long base = 0;
  std::array<std::array<double, 2>, 8> share{};
  for (int j = 0; j < n; ++j) {
    const int cell = cell_of(j, 0.5 * (lo[j] + hi[j]));
    const VectorXd& u = axes_[ix(j)].u;
    const double width = u[cell + 1] - u[cell];
    share[ix(j)] = {(coordinate(j, cell, lo[j]) - u[cell]) / width,
                    (coordinate(j, cell, hi[j]) - u[cell]) / width};
    base += cell * lattice_.stride[ix(j)];
  }
  values.resize(corners);
  for (std::size_t corner = 0; corner < corners; ++corner) {
    long node = base;
    for (int j = 0; j < n; ++j) {
      if (corner >> j & 1u) node += lattice_.stride[ix(j)];
    }
    values[corner] = phi_[ix(node)];
  }
  // The cell's values become those of the box along one axis after the other.
  for (int j = 0; j < n; ++j) {
    const auto [at_lo, at_hi] = share[ix(j)];
    for (std::size_t corner = 0; corner < corners; ++corner) {
      if (corner >> j & 1u) continue;
      double& low = values[corner];
      double& high = values[corner | std::size_t{1} << j];
      const double first = low, second = high;
      low = (1.0 - at_lo) * first + at_lo * second;
      high = (1.0 - at_hi) * first + at_hi * second;
    }
  }
}

std::vector<double> EnergyPotential::corner_weights(const VectorXd& q) const {
  std::vector<double> weights(ix(lattice_.nodes), 0.0);
  over_corners(q, [&](long node, double weight) { weights[ix(node)] += weight; });
  return weights;
}

VectorXd EnergyPotential::gradient(const VectorXd& q) const {
  const int n = lattice_.joints();
  VectorXd slope = VectorXd::Zero(n);
  long base = 0;
  VectorXd share(n), per(n);
  for (int j = 0; j < n; ++j) {
    const int cell = cell_of(j, q[j]);
    const VectorXd& u = axes_[ix(j)].u;
    const double width = u[cell + 1] - u[cell];
    share[j] = (coordinate(j, cell, q[j]) - u[cell]) / width;
    per[j] = coordinate_rate(j, cell, q[j]) / width;
    base += cell * lattice_.stride[ix(j)];
  }
  for (unsigned corner = 0; corner < 1u << n; ++corner) {
    long node = base;
    for (int j = 0; j < n; ++j) {
      if (corner >> j & 1u) node += lattice_.stride[ix(j)];
    }
    for (int d = 0; d < n; ++d) {
      double weight = (corner >> d & 1u) != 0 ? 1.0 : -1.0;
      for (int j = 0; j < n; ++j) {
        if (j != d) weight *= (corner >> j & 1u) != 0 ? share[j] : 1.0 - share[j];
      }
      slope[d] += weight * phi_[ix(node)] * per[d];
    }
  }
  return slope;
}

void EnergyPotential::scale(double factor) {
  for (double& value : phi_) value *= factor;
}

}  // namespace sparflow
