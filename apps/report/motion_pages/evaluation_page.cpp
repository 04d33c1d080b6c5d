#include <fmt/format.h>

#include "apps/report/motion_pages/evaluation.h"
#include "apps/report/motion_pages/motion_page.h"
#include "models/files/model_file.h"

namespace sparflow {

Page evaluation_page(const CraneModel& model, const MotionProblem& problem,
                     const MotionEvaluation& e) {
  Page page("Motion: " + problem.name);
  page.subtitle(fmt::format("{} on {}, {:.4g} kg", e.file, model.machine.name, problem.payload));
  const std::string price =
      fmt::format("{:.1f} kJ in {:.2f} s", e.energy.total / 1e3, e.motion.duration());
  if (limits_kept(e)) {
    page.verdict(Tone::kGood, price, "All limits are kept. " + constant_pressure_note(model));
  } else {
    const LimitCheck& worst = e.checks.front();
    page.verdict(Tone::kWarning, price + "; a limit is broken",
                 fmt::format("{}: {:.4g} of {:.4g} {} at {:.2f} s.", worst.what, worst.value,
                             worst.limit, worst.unit, worst.time));
  }
  OptimizeResult shown;
  shown.motion = e.motion;
  shown.duration = e.motion.duration();
  shown.energy = e.energy;
  shown.checks = e.checks;
  add_motion(page, model, problem, shown);
  for (const std::string& n : e.notes) page.paragraph(n);
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("motion", e.file);
  page.provenance("machine", model.machine.name);
  for (const DataSource& d : model.data)
    page.provenance(d.use + " log", d.file + ", sha256 " + d.sha256.substr(0, 16));
  return page;
}

}  // namespace sparflow
