#include "optimizer/solve/kept_work.h"

#include <utility>

namespace sparflow {

int finished_before(const KeptWork& parts, const Journal& journal) {
  int finished = 0;
  for (int i = 0; i < parts.count; ++i) finished += journal.find(parts.name(i)) != nullptr ? 1 : 0;
  return finished;
}

std::vector<ChildResult> run_kept(const KeptWork& parts, Journal& journal, const OnDone& on_done) {
  std::vector<ChildResult> results(static_cast<std::size_t>(parts.count));
  std::vector<int> left;
  int before = 0;
  for (int i = 0; i < parts.count; ++i) {
    const std::string* bytes = journal.find(parts.name(i));
    if (bytes == nullptr) {
      left.push_back(i);
      continue;
    }
    ChildResult& result = results[static_cast<std::size_t>(i)];
    result = {true, *bytes, ""};
    if (on_done) on_done(i, ++before, result);
  }
  const auto index_of = [&](int k) { return left[static_cast<std::size_t>(k)]; };
  KeptWork missing = parts;
  missing.count = static_cast<int>(left.size());
  missing.work = [&](int k) { return parts.work(index_of(k)); };
  const OnDone keep = [&](int k, int finished, const ChildResult& result) {
    const bool whole = result.ok && (!parts.complete || parts.complete(result.bytes));
    if (whole) journal.keep(parts.name(index_of(k)), result.bytes);
    if (on_done) on_done(index_of(k), before + finished, result);
  };
  std::vector<ChildResult> computed =
      parts.stop ? run_until_stopped(missing, keep)
                 : run_in_children(missing.count, missing.at_once, missing.work, keep);
  for (std::size_t k = 0; k < left.size(); ++k)
    results[static_cast<std::size_t>(left[k])] = std::move(computed[k]);
  return results;
}

}  // namespace sparflow
