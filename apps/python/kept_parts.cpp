#include "apps/python/kept_parts.h"

#include <fmt/format.h>

#include <filesystem>

#include "models/files/model_file.h"
#include "models/math/error.h"
#include "models/math/sha256.h"

namespace sparflow::python {

std::shared_ptr<Journal> journal_of(const std::string& verb, const py::dict& a,
                                    const std::vector<std::string>& files,
                                    const std::string& options) {
  const bool resume = a["resume"].cast<bool>();
  if (a["journal"].is_none()) {
    if (!resume) return std::make_shared<Journal>();
    throw UsageError(fmt::format(
        "{}: resume=True needs journal=, the path of the journal of the earlier call", verb));
  }
  const std::string path = path_from(a["journal"]);
  const bool there = std::filesystem::exists(path);
  if (there && !resume) {
    warn(
        fmt::format("{} holds parts of an earlier call and is replaced as soon as a part of this "
                    "call is finished; resume=True would use them",
                    path));
  }
  // The running program is Python, whatever this module is, so that the module counts as an input.
  std::vector<std::string> all = files;
  all.push_back(py::module_::import("sparflow._sparflow").attr("__file__").cast<std::string>());
  auto journal = std::make_shared<Journal>(path, run_fingerprint(all, options), resume);
  for (const std::string& sentence : journal->warnings()) warn(sentence);
  if (resume && !there) warn(fmt::format("there is no {}; everything is computed", path));
  return journal;
}

std::string identity_of(const CraneModel& model) {
  return "model " + sha256_hex(model_to_json(model));
}

void tell_of_trouble(Journal& journal, const Listener& listener) {
  journal.on_trouble([listener](const std::string& sentence) { listener.say_warning(sentence); });
}

}  // namespace sparflow::python
