#pragma once
/// Motion problems as Python has them, for whatever solves them.
#include <memory>
#include <string>

#include "apps/python/bindings.h"
#include "apps/tasks/motion_inputs.h"

namespace sparflow::python {

/// A problem with the model that was given, or that its file names.
struct Problem {
  std::shared_ptr<const ProblemAndModel> task;
  bool has_model = false;
};

/// Raises an exception of sparflow._errors with the result that it is about.
[[noreturn]] void raise_unsolved(const char* type, const std::string& sentence,
                                 const py::object& result);

}  // namespace sparflow::python
