#pragma once
/// Reaches a study solves: the bundled ones, and random ones that nobody chose.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "problems/problem.h"

namespace sparflow::bench {

/// Which model a figure was found with.
struct ModelMark {
  std::string file;    ///< name without folder
  std::string sha256;  ///< of the file's bytes
};

struct ReachTask {
  MotionProblem problem;
  const CraneModel* model = nullptr;
  ModelMark mark;
  bool meant_feasible = true;
  std::string why_not;  ///< of one made infeasible on purpose
  /// Obstacles or a tip line, which lower bounds leave out.
  bool hemmed_in() const { return !problem.obstacles.empty() || problem.tip_line.has_value(); }
};

/// Models by file, each read once. Tasks refer to them: it must outlive what was made with it.
class ModelShelf {
 public:
  const CraneModel& at(const std::string& file) { return *entry(file).model; }
  ModelMark mark_of(const std::string& file) { return entry(file).mark; }

 private:
  struct Entry {
    std::string file;
    ModelMark mark;
    std::unique_ptr<CraneModel> model;
  };
  const Entry& entry(const std::string& file);
  std::vector<Entry> entries_;
};

/// The bundled reaches whose name contains `only` and that have a bundled model.
std::vector<ReachTask> bundled_tasks(const std::string& only, ModelShelf& models);

/// Reaches `seed` .. `seed + count - 1`: start and end posture drawn over nine tenths of every joint's range, up to 300 kg, the
/// goal is where the end posture puts the tip, the time 1.02 to 4 times what the straight joint line needs. Every tenth is
/// made infeasible on purpose. Two of three on the loader crane, whose redundancy makes it the hardest.
std::vector<ReachTask> random_tasks(int count, std::uint64_t seed, ModelShelf& models);

}  // namespace sparflow::bench
