/// The exact law of the chain on arrays of states: one call for all, without Python's lock.
#include <fmt/format.h>

#include "apps/python/bindings.h"
#include "models/math/error.h"

namespace sparflow::python {
namespace {

using Eigen::Index;
using States = py::array_t<double, py::array::c_style | py::array::forcecast>;

void check_shape(const States& given, const char* name, Index rows, Index joints) {
  if (given.ndim() == 2 && given.shape(0) == rows && given.shape(1) == joints) return;
  std::string shape;
  for (py::ssize_t i = 0; i < given.ndim(); ++i)
    shape += fmt::format("{}{}", i > 0 ? ", " : "", given.shape(i));
  throw UsageError(
      fmt::format("evaluate: {} has the shape ({}), expected ({}, {}): a row for each state, "
                  "a column for each joint",
                  name, shape, rows, joints));
}

/// Results as arrays that NumPy owns, and where the loop writes them.
struct Columns {
  py::dict arrays;
  double* add(const char* name, Index rows, Index width) {
    py::array_t<double> values(std::vector<py::ssize_t>{rows, width});
    arrays[name] = values;
    return values.mutable_data();
  }
};

py::dict evaluate(const CraneModel& model, const States& q, const States& qd,
                  const py::object& qdd_given, const py::dict& options) {
  const auto payload = py::cast<double>(options["payload_kg"]);
  const auto oil = py::cast<double>(options["oil_C"]);
  const auto joints = static_cast<Index>(model.machine.joints.size());
  const Index rows = q.ndim() > 0 ? q.shape(0) : 0;
  check_shape(q, "q", rows, joints);
  check_shape(qd, "qd", rows, joints);
  const States qdd = qdd_given.is_none() ? States() : py::cast<States>(qdd_given);
  if (!qdd_given.is_none()) check_shape(qdd, "qdd", rows, joints);
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
  const double *at = q.data(), *rate = qd.data();
  const double* second = qdd_given.is_none() ? nullptr : qdd.data();
  {
    const py::gil_scoped_release unlocked;
    Chain chain(model);
    chain.oil = oil;
    for (Index k = 0; k < rows; ++k) {
      const JointState state{at + k * joints, rate + k * joints,
                             second == nullptr ? nullptr : second + k * joints};
      try {
        const MachineState& s = chain.evaluate(state, payload);
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

}  // namespace

void bind_law(py::module_& m) { m.def("evaluate", &evaluate); }

}  // namespace sparflow::python
