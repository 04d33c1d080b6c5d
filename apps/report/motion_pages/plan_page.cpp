#include "apps/report/motion_pages/plan_page.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/report/motion_pages/motion_page.h"
#include "models/files/model_file.h"
#include "models/machine/kinematics.h"
#include "models/math/units.h"

namespace sparflow {

Page plan_page(const MotionProblem& problem, const PlannedPaths& paths) {
  Page page("Paths: " + problem.name);
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("problem", problem.file);
  page.provenance("machine", problem.machine.name);
  if (paths.motions.empty()) {
    page.verdict(Tone::kBad, "No path that can be driven", paths.message);
    for (const std::string& r : paths.refused) page.paragraph(r);
    return page;
  }
  const auto quickest = std::min_element(
      paths.motions.begin(), paths.motions.end(),
      [](const PlannedMotion& a, const PlannedMotion& b) { return a.shortest < b.shortest; });
  page.verdict(Tone::kGood,
               fmt::format("{} path{}, the quickest in {:.2f} s", paths.motions.size(),
                           paths.motions.size() > 1 ? "s" : "", quickest->shortest),
               paths.message + ". The energy is not considered here, but by optimize.");
  std::vector<ComparedMotion> beside;
  for (const PlannedMotion& m : paths.motions) {
    if (&m != &*quickest) beside.push_back({m.name, m.motion});
  }
  page.section("The quickest: " + quickest->name);
  add_views(page, problem.machine, problem, quickest->motion, beside);
  Table table;
  table.title = "Paths";
  table.columns = {{"path"}, {"shortest duration", "s", 4}, {"way of the tip", "m", 4}};
  for (const Joint& j : problem.machine.joints)
    table.columns.push_back(
        {j.name + " at the end", j.type == JointType::kRevolute ? "deg" : "m", 4});
  for (const PlannedMotion& m : paths.motions) {
    double way = 0.0;
    for (Eigen::Index k = 0; k + 1 < m.motion.size(); ++k) {
      const Eigen::VectorXd from = m.motion.q.row(k).transpose();
      const Eigen::VectorXd to = m.motion.q.row(k + 1).transpose();
      way +=
          (tip_position<double>(problem.machine, to) - tip_position<double>(problem.machine, from))
              .norm();
    }
    std::vector<TableCell> row = {m.name, m.shortest, way};
    for (int j = 0; j < problem.machine.joint_count(); ++j) {
      const bool turns =
          problem.machine.joints[static_cast<std::size_t>(j)].type == JointType::kRevolute;
      row.emplace_back(m.motion.q(m.motion.size() - 1, j) / (turns ? units::kDegree : 1.0));
    }
    table.rows.push_back(std::move(row));
  }
  table.highlighted_row = static_cast<int>(quickest - paths.motions.begin());
  page.table(std::move(table));
  for (const std::string& r : paths.refused) page.paragraph(r);
  return page;
}

}  // namespace sparflow
