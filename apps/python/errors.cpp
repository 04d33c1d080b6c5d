#include <new>
#include <stdexcept>

#include "apps/python/bindings.h"
#include "models/math/error.h"

namespace sparflow::python {
namespace {

/// Sets an exception of sparflow._errors as the current one of Python.
void set_error(const char* type, const std::string& sentence, const FilePlace& place = {},
               const std::string& key = "") {
  const py::object cls = py::module_::import("sparflow._errors").attr(type);
  py::object error = cls(sentence);
  if (!place.file.empty() || !key.empty()) {
    error.attr("file") = place.file;
    error.attr("line") = place.line;
    error.attr("column") = place.column;
    error.attr("key") = key;
  }
  PyErr_SetObject(cls.ptr(), error.ptr());
}

}  // namespace

void bind_errors(py::module_& m) {
  static_cast<void>(m);
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
    } catch (const std::domain_error& e) {
      set_error("InputError", e.what());
    } catch (const std::logic_error& e) {
      set_error("DefectError", e.what());
    }
  });
}

}  // namespace sparflow::python
