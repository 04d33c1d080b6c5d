#include "optimizer/grid/energy_grid_lattice.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "models/machine/static_force.h"
#include "models/math/error.h"

namespace sparflow {

Lattice::Lattice(std::vector<Eigen::VectorXd> axis_lines) : lines(std::move(axis_lines)) {
  stride.assign(lines.size(), 1);
  nodes = 1;
  for (std::size_t j = lines.size(); j-- > 0;) {
    SPARFLOW_CHECK(lines[j].size() >= 2, "a grid axis has at least two lines");
    stride[j] = nodes;
    nodes *= lines[j].size();
  }
}

Eigen::VectorXd Lattice::posture(long node) const {
  Eigen::VectorXd q(joints());
  for (int j = 0; j < joints(); ++j) q[j] = lines[static_cast<std::size_t>(j)][line(node, j)];
  return q;
}

int Lattice::nearest_line(int joint, double q) const {
  Eigen::Index best = 0;
  (lines[static_cast<std::size_t>(joint)].array() - q).abs().minCoeff(&best);
  return static_cast<int>(best);
}

long Lattice::nearest_node(const Eigen::VectorXd& q) const {
  long node = 0;
  for (int j = 0; j < joints(); ++j) {
    node += nearest_line(j, q[j]) * stride[static_cast<std::size_t>(j)];
  }
  return node;
}

Eigen::VectorXd axis_lines(const Range& range, const std::vector<double>& on_line, int cells) {
  const double width = range.hi - range.lo;
  std::vector<double> stops = {range.lo, range.hi};
  for (const double q : on_line) stops.push_back(std::clamp(q, range.lo, range.hi));
  std::sort(stops.begin(), stops.end());
  std::vector<double> lines = {stops.front()};
  for (const double stop : stops) {
    const double gap = stop - lines.back();
    /// Gap, as share of the range, up to which two lines are one.
    /// @threshold [1] 0..1e-3; numerical: rounding
    constexpr double kSameLine = 1e-9;
    if (gap <= kSameLine * width) continue;
    const double from = lines.back();
    const int parts =
        std::max(1, static_cast<int>(std::lround(gap / width * static_cast<double>(cells))));
    for (int k = 1; k < parts; ++k) lines.push_back(from + gap * k / parts);
    lines.push_back(stop);
  }
  if (lines.size() < 2) lines.push_back(lines.front() + 1e-9);  // a joint that cannot move
  return Eigen::Map<const Eigen::VectorXd>(lines.data(), static_cast<Eigen::Index>(lines.size()));
}

void LatticeForces::at(const Machine& machine, const Lattice& lattice, long node,
                       double* force_there, double* rate_there) const {
  for (std::size_t c = 0; c < length.size(); ++c) {
    force_there[c] = static_cast<double>(force(static_cast<Eigen::Index>(c), node));
    rate_there[c] = rate[c][lattice.line(node, machine.cylinders[c].joint)];
  }
}

LatticeForces lattice_forces(const Machine& machine, const Lattice& lattice, double payload) {
  LatticeForces result;
  const int cylinders = machine.cylinder_count();
  for (int c = 0; c < cylinders; ++c) {
    const int joint = machine.cylinders[static_cast<std::size_t>(c)].joint;
    const Eigen::VectorXd& lines = lattice.lines[static_cast<std::size_t>(joint)];
    Eigen::VectorXd length(lines.size()), rate(lines.size());
    for (Eigen::Index k = 0; k < lines.size(); ++k) {
      const Taylor3 x = linkage_rates(machine, c, lines[k]);
      length[k] = x.value;
      rate[k] = x.d1;
    }
    result.length.push_back(std::move(length));
    result.rate.push_back(std::move(rate));
  }
  result.force.resize(cylinders, lattice.nodes);
  StaticForce statics(machine);
  Eigen::VectorXd q(lattice.joints());
  for (long node = 0; node < lattice.nodes; ++node) {
    for (int j = 0; j < lattice.joints(); ++j) {
      q[j] = lattice.lines[static_cast<std::size_t>(j)][lattice.line(node, j)];
    }
    statics.update(q.data(), payload, 0);
    result.force.col(node) = statics.force().cast<float>();
  }
  for (int c = 0; c < cylinders; ++c) {
    const double lo = result.force.row(c).minCoeff(), hi = result.force.row(c).maxCoeff();
    const double slack = 0.02 * (hi - lo) + 1.0;
    result.range.push_back({lo - slack, hi + slack});
  }
  return result;
}

}  // namespace sparflow
