#include "identification/machine_from_log/flow_areas.h"

#include <cmath>

#include "identification/machine_from_log/weighted_fit.h"
#include "models/machine/linkage.h"
#include "models/math/linear_algebra.h"

namespace sparflow::from_log {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows of one direction below which its area is not estimated.
/// @threshold [1] 10..1000; chosen: half a second to a second of motion
constexpr Index kFewestFlowRows = 40;

struct FlowRows {
  std::vector<double> flow, speed, speed_noise;
  std::vector<int> block;
};

}  // namespace

void areas_from_flow(const Machine& machine, int cylinder, const SketchRows& rows,
                     const MachineFromLogOptions& options, AreaState& area) {
  const CylinderRows& c = rows.cylinders[static_cast<std::size_t>(cylinder)];
  if (c.flow.size() == 0) return;
  const int j = machine.cylinders[static_cast<std::size_t>(cylinder)].joint;
  const Range& limit = machine.joints[static_cast<std::size_t>(j)].acceleration;
  FlowRows sides[2];
  for (Index k = 0; k < rows.rows(); ++k) {
    if (rows.held_out[k] || !rows.usable[k] || !std::isfinite(c.flow[k])) continue;
    // Where the rod gains speed, compressed oil takes part of the flow.
    if (!(rows.qdd(k, j) > options.steady * limit.lo && rows.qdd(k, j) < options.steady * limit.hi))
      continue;
    double rate = 0.0;
    try {
      rate = linkage_rates(machine, cylinder, rows.q(k, j)).d1;
    } catch (const std::domain_error&) {
      continue;
    }
    const double speed = rate * rows.qd(k, j);
    if (!(std::abs(speed) > options.moving)) continue;
    FlowRows& side = sides[speed > 0.0 ? 0 : 1];
    side.flow.push_back(c.flow[k]);
    side.speed.push_back(std::abs(speed));
    side.speed_noise.push_back(rate * rows.rate_noise[j]);
    side.block.push_back(rows.block[k]);
  }
  for (const FlowRows& side : sides) {
    const auto n = static_cast<Index>(side.flow.size());
    if (n < kFewestFlowRows) continue;
    MatrixXd columns(n, 2);
    columns.col(0) = VectorXd::Map(side.speed.data(), n);
    columns.col(1).setOnes();
    const VectorXd flow = VectorXd::Map(side.flow.data(), n);
    // The noise of the speed would make the area too small: it is taken from the moments (Fuller 1987, sec. 2.2).
    MatrixXd moments = transposed_product(columns, columns);
    moments(0, 0) -= VectorXd::Map(side.speed_noise.data(), n).squaredNorm();
    const VectorXd found = solve_symmetric(moments, columns.transpose() * flow);
    const VectorXd residual = flow - columns * found;
    const double spread = std::sqrt(residual.squaredNorm() / static_cast<double>(n - 2));
    if (!(spread > 0.0) || !(found[0] > 0.0)) continue;
    const MatrixXd scaled = columns / spread;
    const VectorXd unit = residual / spread;
    const Eigen::VectorXi block = Eigen::VectorXi::Map(side.block.data(), n);
    const VectorXd half = intervals_of({scaled, unit, block}, {1, options.hold_out_blocks}).half;
    if (!std::isfinite(half[0])) continue;
    const bool extends = &side == &sides[0];
    (extends ? area.flow_piston : area.flow_annulus) = found[0];
    // As standard deviation of a normal estimate with the same interval, and the sensor's gain.
    (extends ? area.flow_piston_std : area.flow_annulus_std) =
        std::hypot(half[0] / 1.96, options.flow_gain_error * found[0]);
  }
}

}  // namespace sparflow::from_log
