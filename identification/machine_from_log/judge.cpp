#include "identification/machine_from_log/judge.h"

#include <cmath>

#include "models/machine/linkage.h"
#include "models/math/nan.h"

namespace sparflow::from_log {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// The rows of each log by themselves, because logs have clocks of their own.
std::vector<HeldOutForces> by_log(const SketchRows& rows, const LoadRows& load,
                                  const VectorXd& measured, const VectorXd& predicted) {
  std::vector<HeldOutForces> out;
  for (std::size_t l = 0; l < rows.files.size(); ++l) {
    std::vector<Index> own;  // of the load's rows
    for (Index k = 0; k < load.rows(); ++k) {
      if (rows.log[load.row[static_cast<std::size_t>(k)]] == static_cast<int>(l)) own.push_back(k);
    }
    if (own.empty()) continue;
    const auto n = static_cast<Index>(own.size());
    HeldOutForces forces{rows.files[l], VectorXd(n), measured(own), predicted(own)};
    for (Index k = 0; k < n; ++k)
      forces.time[k] =
          rows.time[load.row[static_cast<std::size_t>(own[static_cast<std::size_t>(k)])]];
    out.push_back(std::move(forces));
  }
  return out;
}

}  // namespace

HeldOutError held_out_error(const Known& known, int cylinder, bool linkage, const LoadRows* load,
                            const FoundLoads& found) {
  const Machine& machine = known.machine;
  const SketchRows& rows = known.rows;
  const auto i = static_cast<std::size_t>(cylinder);
  const Cylinder& c = machine.cylinders[i];
  HeldOutError e;
  e.cylinder = c.name;
  e.force_rmse = e.force_static = e.force_variation = e.stroke_rmse = kNaN;
  const VectorXd& stroke = rows.cylinders[i].stroke;
  double sum = 0.0;
  for (Index k = 0; linkage && k < stroke.size(); ++k) {
    const double q = rows.position(k, c.joint);
    if (!rows.held_out[k] || !std::isfinite(stroke[k]) || !std::isfinite(q)) continue;
    try {
      sum += std::pow(stroke[k] - stroke_at(machine, cylinder, q), 2.0);
      ++e.stroke_rows;
    } catch (const std::domain_error&) {
      continue;
    }
  }
  if (e.stroke_rows > 0) e.stroke_rmse = std::sqrt(sum / static_cast<double>(e.stroke_rows));
  if (load == nullptr || load->rows() == 0) return e;
  const AreaState& area = found.fit.areas[i];
  const FrictionState& friction = found.fit.friction[i];
  const VectorXd measured = load->load_cell
                                ? load->force
                                : VectorXd(area.piston * (load->pressure_a - load->pressure_b) +
                                           area.rod * load->pressure_b);
  VectorXd expected = load->known;
  if (found.masses.size() > 0) expected += load->masses * found.masses;
  const auto n = static_cast<double>(load->rows());
  e.force_rows = load->rows();
  e.force_static = std::sqrt((measured - expected).squaredNorm() / n);
  expected += load->inertia + force_beside_load(*load, expected, friction, known.options);
  e.force_rmse = std::sqrt((measured - expected).squaredNorm() / n);
  e.forces = by_log(rows, *load, measured, expected);
  e.force_variation = std::sqrt((measured.array() - measured.mean()).square().mean());
  return e;
}

}  // namespace sparflow::from_log
