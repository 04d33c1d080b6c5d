#pragma once
/// The journal of a long call: finished parts on disk, so that a call that was ended can be resumed by a later one.
#include <memory>
#include <string>
#include <vector>

#include "apps/python/bindings.h"
#include "apps/tasks/task.h"
#include "models/math/journal.h"

namespace sparflow::python {

/// Opens the journal that `journal=` names, with `resume=`; one that keeps nothing where it is None. What it holds that cannot be
/// used becomes Python's warnings.
/// @param a the arguments of the call  @param files inputs on disk
/// @param options in words, with the SHA-256 of inputs that are objects; all that the result depends on
/// @throws UsageError for `resume=` without `journal=`  @throws InputError for a journal of another call
std::shared_ptr<Journal> journal_of(const std::string& verb, const py::dict& a,
                                    const std::vector<std::string>& files,
                                    const std::string& options);

/// In words what a model that may be an object only is.
std::string identity_of(const CraneModel& model);

/// Lets a journal that cannot be written tell so by the call's warnings.
void tell_of_trouble(Journal& journal, const Listener& listener);

}  // namespace sparflow::python
