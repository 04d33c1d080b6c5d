#pragma once
/// Reaches that the studies solve: the bundled ones and random ones.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "problems/problem.h"

namespace sparflow::bench {

/// Identifies the model with which a figure was found.
struct ModelMark {
  std::string file;    ///< name without folder
  std::string sha256;  ///< of the file's bytes
};

struct ReachTask {
  MotionProblem problem;
  const CraneModel* model = nullptr;
  ModelMark mark;
  std::string source;  ///< file of the reach, or of that from which it was drawn
  bool meant_feasible = true;
  std::string why_not;  ///< reason why a reach was made infeasible on purpose
  /// Whether there are obstacles or a tip line, which lower bounds leave out.
  bool is_restricted() const { return !problem.obstacles.empty() || problem.tip_line.has_value(); }
};

/// Models by file, each read once. It must outlive the tasks, which refer to its models.
class ModelCache {
 public:
  const CraneModel& at(const std::string& file) { return *entry(file).model; }
  ModelMark mark_of(const std::string& file) { return entry(file).mark; }
  /// The files read so far.
  std::vector<std::string> files() const {
    std::vector<std::string> out;
    for (const Entry& e : entries_) out.push_back(e.file);
    return out;
  }

 private:
  struct Entry {
    std::string file;
    ModelMark mark;
    std::unique_ptr<CraneModel> model;
  };
  const Entry& entry(const std::string& file);
  std::vector<Entry> entries_;
};

/// Lists the bundled reaches whose name contains `only` and that have a bundled model.
std::vector<ReachTask> bundled_tasks(const std::string& only, ModelCache& models);

/// Draws reaches `seed` .. `seed + count - 1`: start and end posture over nine tenths of every joint's range, payload up
/// to 300 kg, the goal at the tip of the end posture, duration 1.02 to 4 times that of the straight joint line. Every
/// tenth is made infeasible on purpose. Two of three are on the loader crane, which is hardest because it is redundant.
std::vector<ReachTask> random_tasks(int count, std::uint64_t seed, ModelCache& models);

/// All files on which the tasks' results depend.
std::vector<std::string> files_of(const std::vector<ReachTask>& tasks, const ModelCache& models);

}  // namespace sparflow::bench
