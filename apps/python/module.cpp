/// The module _sparflow; the package `sparflow` around it has the exceptions and what pandas needs.
#include "apps/python/bindings.h"
#include "models/files/model_file.h"

PYBIND11_MODULE(_sparflow, m) {
  using namespace sparflow::python;
  m.doc() = "Sparflow's library; import sparflow instead.";
  m.attr("__version__") = sparflow::program_version();
  bind_errors(m);
  bind_result(m);
  bind_machine(m);
  bind_log(m);
  bind_mapping(m);
  bind_learning(m);
  bind_diagnosis(m);
  bind_motion(m);
  bind_comparison(m);
  bind_plant(m);
  bind_law(m);
}
