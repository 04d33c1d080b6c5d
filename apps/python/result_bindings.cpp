#include <fmt/format.h>

#include "apps/python/bindings.h"
#include "apps/python/result.h"
#include "models/math/text_encoding.h"

namespace sparflow::python {

void bind_result(py::module_& m) {
  py::class_<Result, std::shared_ptr<Result>>(
      m, "Result",
      "What a verb returns. str() is the terminal's text; a notebook shows the page's summary.")
      .def("json", &Result::json, "The text that `--json` writes (docs/commands.md).")
      .def(
          "report",
          [](const Result& r, const py::object& path) { r.page().write(path_from(path)); },
          py::arg("path"), "Writes the page that `--report` writes, one offline HTML file.")
      .def_property_readonly("headline", &Result::headline, "The result in one sentence.")
      .def("_repr_html_", [](const Result& r) { return r.page().summary(); })
      .def("__str__", &Result::text)
      .def("__repr__", [](const py::object& self) {
        return fmt::format("<sparflow.{}: {}>",
                           py::cast<std::string>(py::type::of(self).attr("__name__")),
                           self.cast<const Result&>().headline());
      });
}

}  // namespace sparflow::python
