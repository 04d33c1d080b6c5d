#pragma once
/// What the files of the Python module share: arrays without copies, inputs in the forms that Python has them.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <Eigen/Dense>
#include <memory>
#include <string>
#include <vector>

#include "identification/log/log.h"
#include "models/chain/crane_model.h"

namespace sparflow::python {

namespace py = pybind11;

/// A view of numbers that `owner` holds: NumPy reads them where they are and keeps the owner alive; it cannot write.
py::array view(const Eigen::VectorXd& values, const py::object& owner);
py::array view(const Eigen::MatrixXd& values, const py::object& owner);
py::array view(const Eigen::Array<bool, Eigen::Dynamic, 1>& values, const py::object& owner);

/// Joints or cylinders by name for an index that Python gives. @throws KeyError with what there is
std::size_t index_of(const std::vector<std::string>& names, const std::string& name,
                     const char* what);
std::vector<std::string> joint_names(const Machine& machine);
std::vector<std::string> cylinder_names(const Machine& machine);
std::vector<std::string> pump_names(const Machine& machine);

/// Logs given as one log, a path, or a sequence of these. Warnings of files that are read become Python's.
std::vector<Log> logs_from(const py::object& given, const Machine& machine);
/// Columns of numbers by their names. @throws TypeError for one that is no array of one dimension
std::vector<LogColumn> columns_from(const py::dict& columns);
/// A path given as text or as os.PathLike.
std::string path_from(const py::object& given);
/// The effects of the user's own, as objects or paths of YAML files, added to the model.
void add_effects(const py::object& effects, CraneModel& model);

/// A sentence of the program whose options are named as the module's arguments.
std::string in_python_words(const std::string& sentence);

/// Gives a sentence to Python's warnings.
void warn(const std::string& sentence);

// Each file binds one part.
void bind_errors(py::module_& m);
void bind_result(py::module_& m);
void bind_machine(py::module_& m);
void bind_log(py::module_& m);
void bind_mapping(py::module_& m);
void bind_learning(py::module_& m);
void bind_diagnosis(py::module_& m);
void bind_motion(py::module_& m);
void bind_comparison(py::module_& m);
void bind_plant(py::module_& m);
void bind_law(py::module_& m);

}  // namespace sparflow::python
