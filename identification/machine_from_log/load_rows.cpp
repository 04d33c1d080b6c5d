#include "identification/machine_from_log/load_rows.h"

#include <cmath>

#include "models/machine/inertial_torque.h"
#include "models/machine/static_force.h"
#include "models/math/nan.h"

namespace sparflow::from_log {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

double value_or_nan(const VectorXd& values, Index row) {
  return values.size() > 0 ? values[row] : kNaN;
}

/// The machine with nothing but a unit of one unknown.
Machine unit_machine(const Machine& machine, const MassUnknown& unknown, bool at_axis) {
  Machine unit = machine;
  for (Link& link : unit.links) link.mass = 0.0;
  for (Cylinder& c : unit.cylinders) {
    c.barrel_mass = c.rod_mass = 0.0;
    if (auto* bar = std::get_if<FourBarLinkage>(&c.linkage))
      bar->rocker_mass = bar->coupler_mass = 0.0;
  }
  Link& link = unit.links[static_cast<std::size_t>(unknown.link)];
  link.mass = 1.0;
  if (unknown.axis >= 0) {
    link.cog.setZero();
    if (at_axis) link.cog[unknown.axis] = 1.0;
  }
  return unit;
}

/// Rows of a cylinder that are a static balance with a known direction of friction.
std::vector<Index> balanced_rows(const Machine& machine, int cylinder, const SketchRows& rows,
                                 bool held_out, const MachineFromLogOptions& options) {
  const CylinderRows& c = rows.cylinders[static_cast<std::size_t>(cylinder)];
  std::vector<Index> kept;
  kept.reserve(static_cast<std::size_t>(rows.rows()));
  for (Index k = 0; k < rows.rows(); ++k) {
    if (rows.held_out[k] != held_out || !rows.usable[k]) continue;
    const bool measured =
        std::isfinite(value_or_nan(c.force, k)) || (std::isfinite(value_or_nan(c.pressure_a, k)) &&
                                                    std::isfinite(value_or_nan(c.pressure_b, k)));
    bool steady = measured;
    for (int j = 0; j < machine.joint_count() && steady; ++j) {
      const Range& limit = machine.joints[static_cast<std::size_t>(j)].acceleration;
      steady = std::isfinite(rows.q(k, j)) && rows.qdd(k, j) >= options.steady * limit.lo &&
               rows.qdd(k, j) <= options.steady * limit.hi;
    }
    if (!steady) continue;
    try {
      for (int i = 0; i < machine.cylinder_count(); ++i) {  // every linkage must close
        const int j = machine.cylinders[static_cast<std::size_t>(i)].joint;
        const Taylor3 x = linkage_rates(machine, i, rows.q(k, j));
        steady = steady && std::isfinite(x.d1) && x.d1 != 0.0;
        if (i == cylinder) steady = steady && std::abs(x.d1 * rows.qd_least(k, j)) > options.moving;
      }
      if (steady) kept.push_back(k);
    } catch (const std::domain_error&) {
      continue;
    }
  }
  return kept;
}

}  // namespace

std::vector<MassUnknown> mass_unknowns(const MachineSketch& sketch) {
  std::vector<MassUnknown> list;
  for (int l = 0; l < static_cast<int>(sketch.machine.links.size()); ++l) {
    if (sketch.is_open(OpenKind::kMass, l)) list.push_back({l, -1});
    if (!sketch.is_open(OpenKind::kCog, l)) continue;
    for (int axis = 0; axis < 3; ++axis) list.push_back({l, axis});
  }
  return list;
}

LoadRows load_rows(const Known& given, int cylinder, bool held_out) {
  const MachineSketch& sketch = given.sketch;
  const Machine& machine = given.machine;
  const SketchRows& rows = given.rows;
  const std::vector<Index> kept = balanced_rows(machine, cylinder, rows, held_out, given.options);
  const CylinderRows& c = rows.cylinders[static_cast<std::size_t>(cylinder)];
  const Cylinder& part = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const auto n = static_cast<Index>(kept.size());
  LoadRows out;
  out.cylinder = cylinder;
  out.load_cell = c.force.size() > 0 && c.force.array().isFinite().any();
  for (VectorXd* v : {&out.pressure_a, &out.pressure_b, &out.force, &out.known, &out.direction,
                      &out.speed, &out.acceleration})
    v->resize(n);
  out.block.resize(n);
  out.row = kept;
  out.inertia = VectorXd::Zero(n);
  // The known part: open masses weigh nothing, open centres are at their frame's origin.
  Machine known = machine;
  for (int l = 0; l < static_cast<int>(known.links.size()); ++l) {
    Link& link = known.links[static_cast<std::size_t>(l)];
    if (sketch.is_open(OpenKind::kMass, l)) link.mass = 0.0;
    if (sketch.is_open(OpenKind::kCog, l)) link.cog.setZero();
  }
  const std::vector<MassUnknown> unknowns = mass_unknowns(sketch);
  out.masses.resize(n, static_cast<Index>(unknowns.size()));
  StaticForce statics(known);
  std::vector<double> q(machine.joints.size());
  const auto at = [&](Index row) {
    for (int j = 0; j < machine.joint_count(); ++j) q[static_cast<std::size_t>(j)] = rows.q(row, j);
    return q.data();
  };
  for (Index k = 0; k < n; ++k) {
    const Index row = kept[static_cast<std::size_t>(k)];
    out.pressure_a[k] = value_or_nan(c.pressure_a, row);
    out.pressure_b[k] = value_or_nan(c.pressure_b, row);
    out.force[k] = value_or_nan(c.force, row);
    out.block[k] = rows.block[row];
    statics.update(at(row), rows.payload[row], 0);
    out.known[k] = statics.force()[cylinder];
    const Taylor3& x = statics.length(cylinder);
    const double rate = rows.qd(row, part.joint);
    out.speed[k] = x.d1 * rate;
    out.direction[k] = out.speed[k] > 0.0 ? 1.0 : -1.0;
    out.acceleration[k] = x.d1 * rows.qdd(row, part.joint) + x.d2 * rate * rate;
  }
  for (std::size_t u = 0; u < unknowns.size(); ++u) {
    const Machine there = unit_machine(machine, unknowns[u], true);
    const Machine origin = unit_machine(machine, unknowns[u], false);
    StaticForce unit(there), zero(origin);
    for (Index k = 0; k < n; ++k) {
      const double* position = at(kept[static_cast<std::size_t>(k)]);
      unit.update(position, 0.0, 0);
      double force = unit.force()[cylinder];
      if (unknowns[u].axis >= 0) {
        zero.update(position, 0.0, 0);
        force -= zero.force()[cylinder];
      }
      out.masses(k, static_cast<Index>(u)) = force;
    }
  }
  return out;
}

void add_inertia(const Machine& machine, const SketchRows& rows, LoadRows& load) {
  if (load.rows() == 0) return;
  const int joint = machine.cylinders[static_cast<std::size_t>(load.cylinder)].joint;
  for (Index k = 0; k < load.rows(); ++k) {
    const Index row = load.row[static_cast<std::size_t>(k)];
    const VectorXd q = rows.q.row(row), qd = rows.qd.row(row), qdd = rows.qdd.row(row);
    const VectorXd torque = inertial_torque<double>(machine, q, qd, qdd, rows.payload[row]);
    load.inertia[k] = torque[joint] / linkage_rates(machine, load.cylinder, q[joint]).d1;
  }
}

}  // namespace sparflow::from_log
