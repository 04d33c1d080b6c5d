#include <fmt/format.h>

#include "apps/python/bindings.h"
#include "apps/tasks/inputs.h"
#include "apps/tasks/machine_from_log_task.h"
#include "models/effects/effect_text.h"
#include "models/effects/formula/user_effect.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"

namespace sparflow::python {
namespace {

Listener python_listener() { return {warn, warn, {}, {}}; }

std::shared_ptr<Machine> load_machine_telling(const py::object& path) {
  return std::make_shared<Machine>(read_machine(path_from(path), python_listener()));
}

/// Paths given as one path or a sequence of them; None: no path.
std::vector<std::string> paths_from(const py::object& given) {
  if (given.is_none()) return {};
  if (py::isinstance<py::str>(given) || py::hasattr(given, "__fspath__")) return {path_from(given)};
  std::vector<std::string> paths;
  for (const py::handle item : given)
    paths.push_back(path_from(py::reinterpret_borrow<py::object>(item)));
  return paths;
}

/// Finds the open values of a sketch; a machine that lacks some is an error that names all of them.
std::shared_ptr<Machine> machine_from_log(const py::object& sketch, const py::object& logs,
                                          const py::object& test, const py::object& mapping) {
  const MachineFromLogTask task{path_from(sketch), paths_from(logs), paths_from(test),
                                mapping.is_none() ? "" : path_from(mapping)};
  std::vector<std::string> told;
  const Listener listener{[&told](const std::string& s) { told.push_back(s); }, {}, {}, {}};
  MachineFromLog found;
  {
    const py::gil_scoped_release release;
    found = machine_from_log_task(task, listener);
  }
  for (const std::string& sentence : told) warn(sentence);
  if (!found.complete()) throw InputError({task.sketch, 0, 0}, "", questions_in_words(found));
  return std::make_shared<Machine>(*std::move(found.machine));
}

std::shared_ptr<CraneModel> load_model_telling(const py::object& path) {
  return std::make_shared<CraneModel>(read_model(path_from(path), python_listener()));
}

std::vector<std::string> effect_keys(const CraneModel& model) {
  std::vector<std::string> keys;
  keys.reserve(model.effects.size());
  for (const AppliedEffect& e : model.effects) keys.push_back(e.key(model.machine));
  return keys;
}

/// Values of an effect of the model by parameter, in the units of the catalogue.
py::dict effect_values(const CraneModel& model, const std::string& key) {
  const std::size_t k = index_of(effect_keys(model), key, "effect of this model");
  const AppliedEffect& e = model.effects[k];
  py::dict values;
  const std::vector<EffectParameter>& parameters = e.effect->info().parameters;
  for (std::size_t i = 0; i < parameters.size() && i < e.values.size(); ++i) {
    values[py::str(parameters[i].name)] =
        py::make_tuple(e.values[i] / parameters[i].si, parameters[i].unit);
  }
  return values;
}

}  // namespace

void add_effects(const py::object& effects, CraneModel& model) {
  if (effects.is_none()) return;
  if (py::isinstance<py::str>(effects) || py::hasattr(effects, "__fspath__") ||
      py::hasattr(effects, "definition")) {
    add_effects(py::make_tuple(effects), model);
    return;
  }
  for (const py::handle item : effects) {
    const std::vector<const Effect*> added =
        py::hasattr(item, "definition")
            ? register_user_effects(py::cast<std::string>(item.attr("definition")),
                                    py::cast<std::string>(item.attr("place")), model.machine)
            : register_user_effects_file(path_from(py::reinterpret_borrow<py::object>(item)),
                                         &model.machine);
    add_own_effects(added, python_listener(), model);
  }
}

void bind_machine(py::module_& m) {
  py::class_<Machine, std::shared_ptr<Machine>>(
      m, "Machine", "Joints, masses, cylinders with their linkages, pumps and valves. SI.")
      .def_static("load", &load_machine_telling, py::arg("path"),
                  "Reads a machine file (YAML, docs/machine_file.md). Raises InputError.")
      .def_static(
          "from_log", &machine_from_log, py::arg("sketch"), py::arg("logs"),
          py::arg("test") = py::none(), py::arg("mapping") = py::none(),
          "Finds what a machine file leaves open (`unknown`) from logs: pins and lengths [m] "
          "from strokes and joint\npositions, bores [m], masses [kg] and centres [m] from "
          "pressures (docs/machine_from_log.md). `logs`, `test`: paths; `test`\nlogs judge. "
          "Raises InputError with all that the logs do not determine.")
      .def_static(
          "parse",
          [](const std::string& text, const std::string& name, const std::string& folder) {
            std::vector<std::string> warnings;
            auto machine = std::make_shared<Machine>(parse_machine(text, name, folder, &warnings));
            for (const std::string& w : warnings) warn(w);
            return machine;
          },
          py::arg("text"), py::arg("name") = "text", py::arg("folder") = ".",
          "Reads the text of a machine file. `folder` is the base of relative paths in it.")
      .def_readonly("name", &Machine::name, "Name in its file.")
      .def_property_readonly("joints", &joint_names, "Names of the joints, base to tip.")
      .def_property_readonly("cylinders", &cylinder_names, "Names of the cylinders.")
      .def_property_readonly("pumps", &pump_names, "Names of the pumps.")
      .def("to_yaml", &write_machine, "The text of a machine file with all digits.")
      .def("__repr__", [](const Machine& machine) {
        return fmt::format("<sparflow.Machine {}: joints {}; cylinders {}; pumps {}>", machine.name,
                           fmt::join(joint_names(machine), ", "),
                           fmt::join(cylinder_names(machine), ", "),
                           fmt::join(pump_names(machine), ", "));
      });

  py::class_<CraneModel, std::shared_ptr<CraneModel>>(
      m, "Model", "A machine and what was learned about it; `fit` makes it. It does not change.")
      .def_static("load", &load_model_telling, py::arg("path"),
                  "Reads a model file (JSON, docs/model_file.md). Raises InputError.")
      .def_static(
          "untrained",
          [](const Machine& machine) {
            return std::make_shared<CraneModel>(CraneModel::untrained(machine));
          },
          py::arg("machine"), "A model before anything is learned: geometry and static forces.")
      .def(
          "save",
          [](const CraneModel& model, const py::object& path) {
            save_model(model, path_from(path));
          },
          py::arg("path"), "Writes the model file, whole or not at all. Raises InputError.")
      .def("json", &model_to_json, "The text of the model file.")
      .def_property_readonly(
          "machine",
          [](const CraneModel& model) { return std::make_shared<Machine>(model.machine); },
          "Machine as in its file.")
      .def_property_readonly("complete", &CraneModel::complete,
                             "Whether every cylinder has a pressure model in both directions.")
      .def_property_readonly("missing", &CraneModel::missing,
                             "Movements without a pressure model, e.g. 'boom retract'.")
      .def_property_readonly("effects", &effect_keys,
                             "Keys of the model's physical effects, e.g. 'coulomb_friction:boom'.")
      .def("effect", &effect_values, py::arg("key"),
           "Parameters of one of its effects: {name: (value, unit)}.")
      .def("__repr__", [](const CraneModel& model) {
        return fmt::format("<sparflow.Model of {}, {}, effects: {}>", model.machine.name,
                           model.complete() ? "complete" : "incomplete",
                           model.effects.empty()
                               ? "none"
                               : fmt::format("{}", fmt::join(effect_keys(model), ", ")));
      });
}

}  // namespace sparflow::python
