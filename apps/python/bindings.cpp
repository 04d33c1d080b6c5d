#include "apps/python/bindings.h"

#include <fmt/format.h>

#include <algorithm>

#include "models/math/error.h"

namespace sparflow::python {
namespace {

void forbid_writing(py::array& a) {
  py::detail::array_proxy(a.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
}

template <class Parts>
std::vector<std::string> names_of(const Parts& parts) {
  std::vector<std::string> names;
  names.reserve(parts.size());
  for (const auto& p : parts) names.push_back(p.name);
  return names;
}

}  // namespace

py::array view(const Eigen::VectorXd& values, const py::object& owner) {
  py::array a(py::dtype::of<double>(), {values.size()}, {static_cast<py::ssize_t>(sizeof(double))},
              values.data(), owner);
  forbid_writing(a);
  return a;
}

py::array view(const Eigen::MatrixXd& values, const py::object& owner) {
  constexpr auto size = static_cast<py::ssize_t>(sizeof(double));
  py::array a(py::dtype::of<double>(), {values.rows(), values.cols()}, {size, size * values.rows()},
              values.data(), owner);
  forbid_writing(a);
  return a;
}

py::array view(const Eigen::Array<bool, Eigen::Dynamic, 1>& values, const py::object& owner) {
  py::array a(py::dtype::of<bool>(), {values.size()}, {static_cast<py::ssize_t>(sizeof(bool))},
              values.data(), owner);
  forbid_writing(a);
  return a;
}

std::vector<std::string> joint_names(const Machine& machine) { return names_of(machine.joints); }
std::vector<std::string> cylinder_names(const Machine& machine) {
  return names_of(machine.cylinders);
}
std::vector<std::string> pump_names(const Machine& machine) { return names_of(machine.pumps); }

std::size_t index_of(const std::vector<std::string>& names, const std::string& name,
                     const char* what) {
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) {
    throw py::key_error(
        fmt::format("no {} \"{}\"; there are {}", what, name, fmt::join(names, ", ")));
  }
  return static_cast<std::size_t>(it - names.begin());
}

std::string path_from(const py::object& given) {
  return py::cast<std::string>(py::module_::import("os").attr("fsdecode")(given));
}

void warn(const std::string& sentence) {
  const py::object type = py::module_::import("sparflow._errors").attr("SparflowWarning");
  if (PyErr_WarnEx(type.ptr(), in_python_words(sentence).c_str(), 1) != 0)
    throw py::error_already_set();
}

std::vector<Log> logs_from(const py::object& given, const Machine& machine) {
  std::vector<Log> logs;
  if (given.is_none()) return logs;
  if (py::isinstance<Log>(given)) {
    logs.push_back(given.cast<const Log&>());
    return logs;
  }
  if (py::isinstance<py::str>(given) || py::hasattr(given, "__fspath__")) {
    logs.push_back(load_log(path_from(given), machine));
    for (const std::string& w : logs.back().warnings) warn(logs.back().file + ": " + w);
    return logs;
  }
  if (!py::isinstance<py::iterable>(given) || py::hasattr(given, "columns")) {
    throw py::type_error(
        "expected a Log, the path of one, or a sequence of these; a DataFrame becomes one by "
        "Log.from_frame(frame, machine)");
  }
  for (const py::handle item : given) {
    for (Log& log : logs_from(py::reinterpret_borrow<py::object>(item), machine))
      logs.push_back(std::move(log));
  }
  return logs;
}

}  // namespace sparflow::python
