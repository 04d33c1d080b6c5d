#include <algorithm>
#include <array>
#include <cctype>
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "apps/python/bindings.h"
#include "apps/python/long_call.h"
#include "models/math/error.h"
#include "simulator/controllers/controller.h"

namespace sparflow::python {
namespace {

/// Words of the command line and the module's words for the same; an option that is not among them has the same name.
constexpr std::array<std::pair<std::string_view, std::string_view>, 17> kWords{{
    {"--model MODEL.json", "model="},
    {"--idle KW", "idle_kW="},
    {"`sparflow simulate --list-effects` names them", "sparflow.plant_effects() names them"},
    {"--track, --replay, --motion", "track, replay, motion, controller"},
    {"--payload", "payload_kg="},
    {"--reference", "references="},
    {"--idle", "idle_kW="},
    {"--gain", "gains="},
    {"--process ", "processes= "},
    {"--log", "logs="},
    {"--pause", "pause_s="},
    {"--step-budget", "step_budget_s="},
    {"--litres-per-kwh", "litres_per_kWh="},
    {"in --json", "in to_dict()"},
    {"--no-bound", "bound=False"},
    {"--sway", "sway_deg="},
    {"--no-optimum", "optimum=False"},
}};

/// Sets an exception of sparflow._errors as the current one of Python.
void set_error(const char* type, const std::string& sentence, const FilePlace& place = {},
               const std::string& key = "") {
  const py::object cls = py::module_::import("sparflow._errors").attr(type);
  py::object error = cls(in_python_words(sentence));
  if (!place.file.empty() || !key.empty()) {
    error.attr("file") = place.file;
    error.attr("line") = place.line;
    error.attr("column") = place.column;
    error.attr("key") = key;
  }
  PyErr_SetObject(cls.ptr(), error.ptr());
}

}  // namespace

std::string in_python_words(const std::string& sentence) {
  std::string text;
  text.reserve(sentence.size());
  const std::string_view all = sentence;
  for (std::size_t at = 0; at < all.size();) {
    const std::string_view rest = all.substr(at);
    const auto word = std::find_if(kWords.begin(), kWords.end(),
                                   [&](const auto& w) { return rest.starts_with(w.first); });
    if (word != kWords.end()) {
      text += word->second;
      at += word->first.size();
      continue;
    }
    const bool option = rest.size() > 2 && rest.starts_with("--") &&
                        std::islower(static_cast<unsigned char>(rest[2])) != 0 &&
                        (at == 0 || all[at - 1] == ' ' || all[at - 1] == '(' || all[at - 1] == '/');
    if (!option) {
      text += all[at++];
      continue;
    }
    for (at += 2; at < all.size(); ++at) {
      if (all[at] != '-' && std::isalnum(static_cast<unsigned char>(all[at])) == 0) break;
      text += all[at] == '-' ? '_' : all[at];
    }
    text += '=';
  }
  return text;
}

void bind_errors(py::module_& m) {
  py::class_<LeftBehind>(m, "_LeftBehind", "Work that goes on after Ctrl-C; see Interrupted.")
      .def("ended", &LeftBehind::ended)
      .def("wait", &LeftBehind::wait, py::arg("seconds"))
      .def("result", &LeftBehind::result);
  py::module_::import("atexit").attr("register")(py::cpp_function(&join_left_behind));
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InputError& e) {
      set_error("InputError", e.what(), e.place, e.key);
    } catch (const UsageError& e) {
      set_error("UsageError", e.what());
    } catch (const TextError& e) {
      set_error("InputError", e.what());
    } catch (const std::bad_alloc&) {
      PyErr_SetString(PyExc_MemoryError, "out of memory; give fewer or shorter logs");
    } catch (const control::ControllerFailure& e) {
      set_error("UsageError", e.what());
    } catch (const std::domain_error& e) {
      set_error("InputError", e.what());
    } catch (const std::logic_error& e) {
      set_error("DefectError", e.what());
    }
  });
}

}  // namespace sparflow::python
