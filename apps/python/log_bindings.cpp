#include <fmt/format.h>

#include "apps/python/bindings.h"
#include "identification/signals/signals.h"

namespace sparflow::python {
namespace {

LogOptions options_with(const py::object& mapping) {
  LogOptions options;
  if (!mapping.is_none()) options.mapping_file = path_from(mapping);
  return options;
}

std::shared_ptr<Log> telling(Log&& log) {
  auto kept = std::make_shared<Log>(std::move(log));
  for (const std::string& w : kept->warnings) warn(kept->file + ": " + w);
  return kept;
}

std::shared_ptr<Log> log_from_arrays(const py::dict& columns, const Machine& machine,
                                     const std::string& name, const py::object& mapping) {
  return telling(log_from_columns(name, columns_from(columns), machine, options_with(mapping)));
}

std::vector<std::string> signal_names(const Log& log) {
  std::vector<std::string> names;
  names.reserve(log.channels.size());
  for (const Channel& c : log.channels) names.push_back(c.signal);
  return names;
}

const Channel& channel_of(const Log& log, const std::string& signal) {
  return log.channels[index_of(signal_names(log), signal, "signal")];
}

/// A property that gives a view of a member; None where the log does not measure it.
template <class Class, class Member>
auto viewed(Member Class::*member) {
  return [member](const py::object& self) -> py::object {
    const Member& values = self.cast<const Class&>().*member;
    if (values.size() == 0) return py::none();
    return view(values, self);
  };
}

void bind_signals(py::module_& m) {
  using C = CylinderSignals;
  py::class_<C>(m, "CylinderSignals",
                "One cylinder of a log, [samples] each: views, None where it is not measured.")
      .def_property_readonly("length", viewed(&C::length), "[m] pin to pin")
      .def_property_readonly("rate", viewed(&C::rate), "dx/dq [m/rad] or [-]")
      .def_property_readonly("speed", viewed(&C::speed), "dx/dt [m/s], positive extending")
      .def_property_readonly("acceleration", viewed(&C::acceleration), "[m/s^2]")
      .def_property_readonly("static_force", viewed(&C::static_force),
                             "[N] by virtual work, positive when the load pushes the rod in")
      .def_property_readonly("force", viewed(&C::force), "[N] measured")
      .def_property_readonly("command", viewed(&C::command), "[-] -1..1")
      .def_property_readonly("pressure_a", viewed(&C::pressure_a), "[Pa] bore side, as logged")
      .def_property_readonly("pressure_b", viewed(&C::pressure_b), "[Pa] rod side, as logged")
      .def_property_readonly("flow", viewed(&C::flow), "[m^3/s] into the supply chamber")
      .def_property_readonly("working_pressure", viewed(&C::working_pressure),
                             "[Pa] in the supply chamber, NaN at rest")
      .def_property_readonly("moving", viewed(&C::moving), "whether force errors count the sample");
  py::class_<PumpSignals>(m, "PumpSignals", "One pump of a log.")
      .def_property_readonly("pressure", viewed(&PumpSignals::pressure), "[Pa] as logged");
  using S = MachineSignals;
  py::class_<S, std::shared_ptr<S>>(m, "Signals",
                                    "A log seen through its machine: motion, forces and measured "
                                    "quantities of every sample, as views.")
      .def(py::init([](const Machine& machine, const Log& log) {
             return std::make_shared<S>(make_signals(machine, log));
           }),
           py::arg("machine"), py::arg("log"))
      .def_property_readonly("time", viewed(&S::time), "[s]")
      .def_property_readonly("q", viewed(&S::q), "[samples x joints] smoothed, [rad] or [m]")
      .def_property_readonly("qd", viewed(&S::qd), "[samples x joints] [rad/s] or [m/s]")
      .def_property_readonly("qdd", viewed(&S::qdd), "[samples x joints] [rad/s^2] or [m/s^2]")
      .def_property_readonly("tip", viewed(&S::tip), "[samples x 3] [m] in the base frame")
      .def_property_readonly("payload", viewed(&S::payload), "[kg]")
      .def_property_readonly("oil", viewed(&S::oil), "[degC]")
      .def_property_readonly("usable", viewed(&S::usable), "pose, speed and payload are known")
      .def_property_readonly(
          "cylinders",
          [](const py::object& self) {
            py::list all;
            for (const C& c : self.cast<const S&>().cylinders)
              all.append(py::cast(&c, py::return_value_policy::reference_internal, self));
            return all;
          },
          "In the machine's order.")
      .def_property_readonly(
          "pumps",
          [](const py::object& self) {
            py::list all;
            for (const PumpSignals& p : self.cast<const S&>().pumps)
              all.append(py::cast(&p, py::return_value_policy::reference_internal, self));
            return all;
          },
          "In the machine's order.")
      .def_readonly("notes", &S::notes, "What was missing, converted or left out.");
}

}  // namespace

std::vector<LogColumn> columns_from(const py::dict& columns) {
  std::vector<LogColumn> given;
  given.reserve(columns.size());
  for (const auto& [key, value] : columns) {
    const auto values =
        py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
    const std::string column = py::cast<std::string>(py::str(key));
    if (!values || values.ndim() != 1) {
      PyErr_Clear();
      throw py::type_error(
          fmt::format("column {}: expected an array of one dimension that holds numbers", column));
    }
    given.push_back({column, {values.data(), values.data() + values.size()}});
  }
  return given;
}

void bind_log(py::module_& m) {
  py::class_<Log, std::shared_ptr<Log>>(
      m, "Log", "Measurements, checked and in SI. `log['pA_boom']` is a view, not a copy.")
      .def_static(
          "load",
          [](const py::object& path, const Machine& machine, const py::object& mapping) {
            const LogOptions options = options_with(mapping);
            const std::string file = path_from(path);
            Log log;
            {
              const py::gil_scoped_release release;
              log = load_log(file, machine, options);
            }
            return telling(std::move(log));
          },
          py::arg("path"), py::arg("machine"), py::arg("mapping") = py::none(),
          "Reads a log: CSV, MAT to v7.3 (docs/log_format.md), MDF 4, MCAP, traces of CAN\n"
          "(docs/recordings.md). `mapping`: path of a mapping file for other column names and the "
          "database\nof CAN frames. Raises InputError.")
      .def_static(
          "from_arrays", &log_from_arrays, py::arg("columns"), py::arg("machine"),
          py::arg("name") = "arrays", py::arg("mapping") = py::none(),
          "Makes a log of arrays by column name, with its unit as in a file: {'t_s': ...,\n"
          "'q_boom_rad': ..., 'pA_boom_bar': ...}. Checked as a file is. Raises InputError.")
      .def_readonly("file", &Log::file, "Name without folder.")
      .def_readonly("sha256", &Log::sha256, "Of the file's bytes.")
      .def_readonly("step", &Log::step, "[s] median sampling interval")
      .def_readonly("warnings", &Log::warnings, "Sentences on what is unusual in it.")
      .def_property_readonly("duration", &Log::duration, "[s] from the first to the last sample")
      .def_property_readonly("time", viewed(&Log::time), "[s] view")
      .def_property_readonly("signals", &signal_names, "Names of the signals, without units.")
      .def(
          "unit", [](const Log& log, const std::string& s) { return channel_of(log, s).unit; },
          py::arg("signal"), "Unit of a signal's values; '' when unknown.")
      .def(
          "__getitem__",
          [](const py::object& self, const std::string& s) {
            return view(channel_of(self.cast<const Log&>(), s).values, self);
          },
          py::arg("signal"), "Values [SI] of a signal as a view, NaN where not valid.")
      .def("__contains__",
           [](const Log& log, const std::string& s) { return log.find(s) != nullptr; })
      .def("__len__", [](const Log& log) { return log.samples(); })
      .def("__repr__", [](const Log& log) {
        return fmt::format("<sparflow.Log {}: {} samples, {:.1f} s, {} signals>", log.file,
                           log.samples(), log.duration(), log.channels.size());
      });
  bind_signals(m);
}

}  // namespace sparflow::python
