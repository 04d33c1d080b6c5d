/// The exact law of the chain on arrays of states: one call for all, without Python's lock.
#include <fmt/format.h>

#include <array>

#include "apps/python/bindings.h"
#include "models/chain/chain_derivatives.h"
#include "models/math/error.h"

namespace sparflow::python {
namespace {

using Eigen::Index;
using States = py::array_t<double, py::array::c_style | py::array::forcecast>;

void check_shape(const std::string& verb, const States& given, const char* name, Index rows,
                 Index joints) {
  if (given.ndim() == 2 && given.shape(0) == rows && given.shape(1) == joints) return;
  std::string shape;
  for (py::ssize_t i = 0; i < given.ndim(); ++i)
    shape += fmt::format("{}{}", i > 0 ? ", " : "", given.shape(i));
  throw UsageError(
      fmt::format("{}: {} has the shape ({}), expected ({}, {}): a row for each state, "
                  "a column for each joint",
                  verb, name, shape, rows, joints));
}

/// States as they come, of one shape, in rows that JointState points at.
struct Motion {
  States q, qd, qdd;
  bool accelerated = false;
  Index rows = 0, joints = 0;
  Motion(const std::string& verb, const CraneModel& model, const py::dict& a)
      : q(py::cast<States>(a["q"])), qd(py::cast<States>(a["qd"])) {
    joints = static_cast<Index>(model.machine.joints.size());
    rows = q.ndim() > 0 ? q.shape(0) : 0;
    check_shape(verb, q, "q", rows, joints);
    check_shape(verb, qd, "qd", rows, joints);
    accelerated = !a["qdd"].is_none();
    if (!accelerated) return;
    qdd = py::cast<States>(a["qdd"]);
    check_shape(verb, qdd, "qdd", rows, joints);
  }
  JointState row(Index k) const {
    return {q.data() + k * joints, qd.data() + k * joints,
            accelerated ? qdd.data() + k * joints : nullptr};
  }
};

/// Results as arrays that NumPy owns, and where the loop writes them.
struct Columns {
  py::dict arrays;
  double* add(const char* name, Index rows, Index width) {
    py::array_t<double> values(std::vector<py::ssize_t>{rows, width});
    arrays[name] = values;
    return values.mutable_data();
  }
};

py::dict evaluate(const CraneModel& model, const py::dict& a) {
  const auto payload = py::cast<double>(a["payload_kg"]);
  const auto oil = py::cast<double>(a["oil_C"]);
  const Motion motion("evaluate", model, a);
  const Index rows = motion.rows;
  const auto cylinders = static_cast<Index>(model.machine.cylinders.size());
  const auto pumps = static_cast<Index>(model.machine.pumps.size());
  Columns out;
  double* const speed = out.add("speed", rows, cylinders);
  double* const force = out.add("static_force", rows, cylinders);
  double* const total = out.add("total_force", rows, cylinders);
  double* const flow = out.add("flow", rows, cylinders);
  double* const pressure = out.add("pressure", rows, cylinders);
  double* const pump_flow = out.add("pump_flow", rows, pumps);
  double* const pump_pressure = out.add("pump_pressure", rows, pumps);
  double* const power = out.add("power", rows, 1);
  {
    const py::gil_scoped_release unlocked;
    Chain chain(model);
    chain.oil = oil;
    for (Index k = 0; k < rows; ++k) {
      try {
        const MachineState& s = chain.evaluate(motion.row(k), payload);
        for (Index i = 0; i < cylinders; ++i) {
          const CylinderState& c = s.cylinders[static_cast<std::size_t>(i)];
          const Index to = k * cylinders + i;
          speed[to] = c.speed;
          force[to] = c.force;
          total[to] = c.total_force;
          flow[to] = c.flow;
          pressure[to] = c.pressure;
        }
        for (Index p = 0; p < pumps; ++p) {
          pump_flow[k * pumps + p] = s.pumps[static_cast<std::size_t>(p)].flow;
          pump_pressure[k * pumps + p] = s.pumps[static_cast<std::size_t>(p)].pressure;
        }
        power[k] = s.power;
      } catch (const std::domain_error& e) {
        throw UsageError(fmt::format("evaluate: state {}: {}", k, e.what()));
      }
    }
  }
  return out.arrays;
}

/// Derivatives of one quantity by q, qd and qdd: arrays [states x items x joints] and where the loop writes them.
class Derived {
 public:
  Derived(py::dict& all, const char* name, const Motion& motion, Index items)
      : joints_(motion.joints), items_(items) {
    py::dict by;
    for (std::size_t v = 0; v < kVariables.size(); ++v) {
      py::array_t<double> values(std::vector<py::ssize_t>{motion.rows, items, motion.joints});
      by[kVariables[v]] = values;
      to_[v] = values.mutable_data();
    }
    all[name] = by;
  }
  void set(Index row, Index item, const Jet& value) const {
    const Index at = (row * items_ + item) * joints_;
    for (std::size_t v = 0; v < to_.size(); ++v)
      for (Index j = 0; j < joints_; ++j)
        to_[v][at + j] = value.gradient(static_cast<int>(static_cast<Index>(v) * joints_ + j));
  }
  void set_all(Index row, const std::vector<Jet>& values) const {
    for (std::size_t i = 0; i < values.size(); ++i) set(row, static_cast<Index>(i), values[i]);
  }

 private:
  static constexpr std::array<const char*, 3> kVariables{"q", "qd", "qdd"};
  Index joints_, items_;
  std::array<double*, 3> to_{};
};

py::dict derivatives(const CraneModel& model, const py::dict& a) {
  const auto payload = py::cast<double>(a["payload_kg"]);
  const auto oil = py::cast<double>(a["oil_C"]);
  const Motion motion("derivatives", model, a);
  const auto cylinders = static_cast<Index>(model.machine.cylinders.size());
  const auto pumps = static_cast<Index>(model.machine.pumps.size());
  py::dict all;
  const Derived speed(all, "speed", motion, cylinders);
  const Derived force(all, "static_force", motion, cylinders);
  const Derived total(all, "total_force", motion, cylinders);
  const Derived flow(all, "flow", motion, cylinders);
  const Derived pressure(all, "pressure", motion, cylinders);
  const Derived pump_flow(all, "pump_flow", motion, pumps);
  const Derived pump_pressure(all, "pump_pressure", motion, pumps);
  const Derived power(all, "power", motion, 1);
  const py::gil_scoped_release unlocked;
  ChainDerivatives law(model);
  law.oil = oil;
  for (Index k = 0; k < motion.rows; ++k) {
    try {
      law.evaluate(motion.row(k), payload);
    } catch (const std::domain_error& e) {
      throw UsageError(fmt::format("derivatives: state {}: {}", k, e.what()));
    }
    const Instant<Jet>& s = law.instant();
    speed.set_all(k, s.speed);
    force.set_all(k, s.static_force);
    total.set_all(k, s.force);
    flow.set_all(k, s.flow);
    pressure.set_all(k, s.pressure);
    pump_flow.set_all(k, s.pump_flow);
    for (Index p = 0; p < pumps; ++p)
      pump_pressure.set(k, p, law.pump_pressure(static_cast<int>(p)));
    power.set(k, 0, law.power());
  }
  return all;
}

}  // namespace

void bind_law(py::module_& m) {
  m.def("evaluate", &evaluate);
  m.def("derivatives", &derivatives);
}

}  // namespace sparflow::python
