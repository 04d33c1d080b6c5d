#include "identification/machine_from_log/machine_from_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "identification/machine_from_log/area_answers.h"
#include "identification/machine_from_log/judge.h"
#include "identification/machine_from_log/linkage_fit.h"
#include "identification/machine_from_log/realise_masses.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"

namespace sparflow {
namespace from_log {
namespace {

std::string file_number(double value) { return fmt::format("{:.6g}", value + 0.0); }

std::string file_vector(const Eigen::Vector3d& v) {
  // Micrometres of rounding would read as if they were measured.
  const auto shown = [](double x) { return file_number(std::abs(x) < 1e-9 ? 0.0 : x); };
  return fmt::format("[{}, {}, {}]", shown(v.x()), shown(v.y()), shown(v.z()));
}

void append_all(std::vector<std::string>& to, const std::vector<std::string>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

/// The combination that is nothing but the mass of a link; nullptr where the forces do not tell it from others.
const FoundValue* combination_of_mass(const RealisedMasses& masses, int link) {
  for (const FoundValue& v : masses.combinations) {
    const bool alone = v.terms.size() == 1 && v.terms[0].link == link && v.terms[0].axis < 0;
    if (alone && v.terms[0].factor == 1.0) return &v;
  }
  return nullptr;
}

/// One estimate from sketch to machine.
class Estimate {
 public:
  Estimate(const MachineSketch& sketch, const std::vector<Log>& logs, const std::vector<Log>& tests,
           const MachineFromLogOptions& options)
      : sketch_(sketch),
        options_(options),
        machine_(sketch.machine),
        rows_(sketch_rows(machine_, logs, tests, options)),
        completions_(sketch.open.size()) {
    for (const Log& log : logs) files_ += (files_.empty() ? "" : ", ") + log.file;
  }

  MachineFromLog run() {
    out_.name = machine_.name;
    check_payload();
    find_linkages();
    find_positions();
    find_loads();
    write();
    return std::move(out_);
  }

 private:
  void complete(OpenKind kind, int part, const std::string& value, const std::string& remark) {
    for (std::size_t k = 0; k < sketch_.open.size(); ++k) {
      if (sketch_.open[k].kind == kind && sketch_.open[k].part == part)
        completions_[k] = {value, remark};
    }
  }

  void check_payload() {
    if (!rows_.payload_logged)
      out_.notes.emplace_back("a log has no payload_kg: 0 kg is assumed, as everywhere");
  }

  void find_linkages() {
    resolved_.assign(machine_.cylinders.size(), true);
    for (int i = 0; i < machine_.cylinder_count(); ++i) {
      if (!sketch_.linkage_open(i)) continue;
      LinkageFit fit = fit_linkage(sketch_, i, rows_, options_, machine_);
      append_all(out_.notes, fit.notes);
      append_all(out_.warnings, fit.warnings);
      out_.questions.insert(out_.questions.end(), fit.questions.begin(), fit.questions.end());
      Cylinder& c = machine_.cylinders[static_cast<std::size_t>(i)];
      if (fit.determined) {
        out_.values.insert(out_.values.end(), fit.values.begin(), fit.values.end());
        complete_linkage(i, fit.values);
        continue;
      }
      // An unknown linkage takes no part; what stands in its place must only be computable.
      resolved_[static_cast<std::size_t>(i)] = false;
      c.linkage = DirectLinkage{};
      c.barrel_mass = c.rod_mass = 0.0;
    }
  }

  std::string pin_text(int frame, const Eigen::Vector3d& pin) const {
    return file_vector(
        frame < 0 ? pin : sketch_.file_frames[static_cast<std::size_t>(frame)].inverse() * pin);
  }

  void complete_linkage(int i, const std::vector<FoundValue>& values) {
    const Cylinder& c = machine_.cylinders[static_cast<std::size_t>(i)];
    std::string remark = "from the log:";
    for (const FoundValue& v : values)
      remark += fmt::format("{} {} {:.5g} ± {:.2g} {}", &v == &values.front() ? "" : ",", v.name,
                            v.value, v.half_width, v.unit);
    const int own = c.joint, parent = c.joint - 1;
    const auto put = [&](OpenKind kind, const std::string& text) {
      if (!sketch_.is_open(kind, i)) return;
      complete(kind, i, text, remark);
      remark.clear();  // once
    };
    if (const auto* pins = std::get_if<PinsLinkage>(&c.linkage)) {
      const std::string on_parent = pin_text(parent, pins->parent_pin);
      const std::string on_child = pin_text(own, pins->child_pin);
      put(OpenKind::kBarrelPin, pins->barrel_on_parent ? on_parent : on_child);
      put(OpenKind::kRodPin, pins->barrel_on_parent ? on_child : on_parent);
    } else if (const auto* bar = std::get_if<FourBarLinkage>(&c.linkage)) {
      put(OpenKind::kBarrelPin, pin_text(parent, bar->barrel));
      put(OpenKind::kRockerPin, pin_text(parent, bar->rocker));
      put(OpenKind::kCouplerPin, pin_text(own, bar->coupler));
      put(OpenKind::kRockerLength, file_number(bar->rocker_length));
      put(OpenKind::kCouplerLength, file_number(bar->coupler_length));
    } else if (const auto* rack = std::get_if<RackLinkage>(&c.linkage)) {
      put(OpenKind::kRadius, file_number(rack->radius));
    }
    put(OpenKind::kZeroLength, file_number(c.length_at_zero_stroke.value_or(0.0)));
  }

  void find_positions() {
    for (int j = 0; j < machine_.joint_count(); ++j) {
      const int cylinder = machine_.cylinder_of_joint(j);
      const bool known = cylinder >= 0 && resolved_[static_cast<std::size_t>(cylinder)];
      if (known ? positions_from_strokes(machine_, j, rows_)
                : rows_.q.col(j).array().isFinite().any())
        continue;
      obstacle_ = fmt::format("forces need the position of joint {}, which the logs do not tell",
                              machine_.joints[static_cast<std::size_t>(j)].name);
    }
  }

  void find_loads() {
    const Known known{sketch_, machine_, rows_, resolved_, options_};
    for (int i = 0; i < machine_.cylinder_count(); ++i) {
      LoadRows load, test;
      if (obstacle_.empty() && resolved_[static_cast<std::size_t>(i)]) {
        load = load_rows(known, i, false);
        test = load_rows(known, i, true);
      }
      loads_.push_back(std::move(load));
      tests_.push_back(std::move(test));
    }
    const std::string obstacle =
        obstacle_.empty() ? "no cylinder has moving rows with pressures and a known or found area, "
                            "or a measured force, in these logs"
                          : obstacle_;
    LoadFit fit = fit_loads(known, loads_);
    RealisedMasses masses = realise_masses(known, loads_, fit, obstacle);
    // What the masses found have of inertia is no error of the balance: a second estimate knows it.
    const Machine heavy = with_masses(masses);
    for (LoadRows& load : loads_) add_inertia(heavy, rows_, load);
    for (LoadRows& load : tests_) add_inertia(heavy, rows_, load);
    fit = fit_loads(known, loads_);
    masses = realise_masses(known, loads_, fit, obstacle);
    AreaAnswers areas = answer_areas(known, loads_, fit, obstacle_);
    out_.values.insert(out_.values.end(), areas.values.begin(), areas.values.end());
    out_.questions.insert(out_.questions.end(), areas.questions.begin(), areas.questions.end());
    for (const AreaAnswers::Diameter& d : areas.diameters)
      complete(d.kind, d.cylinder, file_number(d.value), d.remark);
    append_all(out_.notes, masses.notes);
    out_.questions.insert(out_.questions.end(), masses.questions.begin(), masses.questions.end());
    out_.combinations = masses.combinations;
    if (masses.possible) complete_masses(masses);
    tell_of_unused(fit, masses);
    judge(known, fit, masses);
  }

  /// The machine with open masses as they were found, where they are possible.
  Machine with_masses(const RealisedMasses& masses) const {
    Machine machine = machine_;
    for (int l = 0; l < static_cast<int>(machine.links.size()); ++l) {
      const bool cog_open = sketch_.is_open(OpenKind::kCog, l);
      if (!sketch_.is_open(OpenKind::kMass, l) && !cog_open) continue;
      const LinkMoments& found = masses.links[static_cast<std::size_t>(l)];
      Link& link = machine.links[static_cast<std::size_t>(l)];
      link.mass = masses.possible ? found.mass : 0.0;
      if (cog_open)
        link.cog = link.mass > 0.0 ? Eigen::Vector3d(found.moment / link.mass)
                                   : Eigen::Vector3d(Eigen::Vector3d::Zero());
    }
    return machine;
  }

  /// Forces of a cylinder that took no part are only as good as the masses that others tell.
  void tell_of_unused(const LoadFit& fit, const RealisedMasses& masses) {
    if (masses.solution.size() == 0 || !masses.questions.empty()) return;
    for (std::size_t i = 0; i < fit.used.size(); ++i) {
      if (fit.used[i]) continue;
      out_.warnings.push_back(
          fmt::format("forces of {} took no part (no pressures, no known area or no steady "
                      "motion): masses that "
                      "only it carries are not checked",
                      machine_.cylinders[i].name));
    }
  }

  bool asked(const std::string& path) const {
    return std::any_of(out_.questions.begin(), out_.questions.end(),
                       [&](const MachineQuestion& q) { return q.path == path; });
  }

  void complete_masses(const RealisedMasses& masses) {
    const Machine found = with_masses(masses);
    for (int l = 0; l < static_cast<int>(machine_.links.size()); ++l) {
      const bool mass_open = sketch_.is_open(OpenKind::kMass, l);
      const bool cog_open = sketch_.is_open(OpenKind::kCog, l);
      if (!mass_open && !cog_open) continue;
      const Link& link = found.links[static_cast<std::size_t>(l)];
      const std::string source =
          fmt::format("from the log: {} of {} that {} the static forces it shows",
                      mass_open ? "mass" : "centre", link.name,
                      mass_open && cog_open ? "with its centre gives" : "gives");
      complete(OpenKind::kMass, l, file_number(link.mass), source);
      complete(OpenKind::kCog, l, pin_text(link.joint, link.cog), mass_open ? "" : source);
      const std::string path = fmt::format("links[{}].mass", link.name);
      if (asked(path)) continue;
      constexpr const char* kSource = "static forces, by the convention for centres";
      if (mass_open) {
        // Where the forces tell this mass alone, no convention was needed and its interval is known.
        const FoundValue* alone = combination_of_mass(masses, l);
        out_.values.push_back({path,
                               link.mass,
                               alone != nullptr ? alone->half_width : std::nan(""),
                               "kg",
                               alone != nullptr ? alone->source : kSource,
                               "",
                               {},
                               -1,
                               l});
      }
      for (int axis = 0; cog_open && axis < 3; ++axis)
        out_.values.push_back({fmt::format("links[{}].cog[{}]", link.name, axis),
                               link.cog[axis],
                               std::nan(""),
                               "m",
                               kSource,
                               "",
                               {},
                               -1,
                               l});
    }
  }

  void judge(const Known& known, const LoadFit& fit, const RealisedMasses& masses) {
    for (int i = 0; i < machine_.cylinder_count(); ++i) {
      const auto c = static_cast<std::size_t>(i);
      const std::string& name = machine_.cylinders[c].name;
      const FrictionState& friction = fit.friction[c];
      // A friction that may be none, or that drives the rod, is no finding.
      if (fit.used[c] && friction.coulomb > friction.coulomb_half) {
        out_.friction.push_back({fmt::format("{}: Coulomb friction", name), friction.coulomb,
                                 friction.coulomb_half, "N", "pressures and static forces",
                                 friction.viscous > 0.0
                                     ? fmt::format("viscous {:.3g} N s/m", friction.viscous)
                                     : std::string()});
      }
      const bool forces = fit.used[c] && (fit.areas[c].has_scale || tests_[c].load_cell);
      HeldOutError e = held_out_error(known, i, resolved_[c], forces ? &tests_[c] : nullptr,
                                      {fit, masses.solution});
      if (std::isfinite(e.force_rmse) && e.force_variation > 0.0 &&
          e.force_rmse > options_.warn_residual * e.force_variation) {
        out_.warnings.push_back(
            fmt::format("on motions held out the machine leaves {:.2g} kN of the force of {} "
                        "unexplained, {:.0f} "
                        "% of its variation: a mass, a friction or a sensor is not as the sketch "
                        "says; `compare "
                        "-m` and `diagnose` show where",
                        e.force_rmse / 1e3, name, 100.0 * e.force_rmse / e.force_variation));
      }
      out_.held_out.push_back(std::move(e));
    }
  }

  /// Whether a value can stand in the file; else it stays open, with its question.
  void write() {
    for (const MachineQuestion& q : out_.questions) {
      for (std::size_t k = 0; k < sketch_.open.size(); ++k) {
        if (sketch_.open[k].path == q.path) completions_[k] = {"", "OPEN: " + q.sentence};
      }
    }
    std::vector<std::string> heading = {
        fmt::format("Completed by sparflow {} from {}.", program_version(), files_)};
    for (const std::string& note : out_.notes) heading.push_back(note);
    for (const FoundValue& v : out_.combinations)
      heading.push_back(
          fmt::format("{} = {:.5g} ± {:.2g} {} (95 %)", v.name, v.value, v.half_width, v.unit));
    const bool open = std::any_of(completions_.begin(), completions_.end(),
                                  [](const Completion& c) { return c.value.empty(); });
    out_.text = completed_text(sketch_, completions_, heading);
    if (open) return;
    try {
      std::vector<std::string> warnings;
      Machine machine = parse_machine(out_.text, sketch_.file, sketch_.folder, &warnings);
      append_all(out_.warnings, warnings);
      if (machine.source_text != out_.text) {  // a URDF's joints and links are written out
        std::string head;
        for (const std::string& line : heading) head += "# " + line + "\n";
        out_.text = head + machine.source_text;
      }
      out_.machine = std::move(machine);
    } catch (const InputError& e) {
      out_.questions.push_back(
          {e.key, fmt::format("the values that the logs give make no machine: {}", e.what())});
    }
  }

  const MachineSketch& sketch_;
  const MachineFromLogOptions& options_;
  Machine machine_;
  SketchRows rows_;
  std::vector<Completion> completions_;
  std::string files_, obstacle_;
  std::vector<bool> resolved_;  // by cylinder: its linkage is known
  std::vector<LoadRows> loads_, tests_;
  MachineFromLog out_;
};

}  // namespace
}  // namespace from_log

MachineFromLog machine_from_logs(const MachineSketch& sketch, const std::vector<Log>& logs,
                                 const std::vector<Log>& tests,
                                 const MachineFromLogOptions& options) {
  if (logs.empty()) throw UsageError("machine: expected at least one log to find values from");
  const std::string parts = parts_of(sketch.machine);
  for (const std::vector<Log>* list : {&logs, &tests}) {
    for (const Log& log : *list) {
      if (!log.machine_parts.empty() && log.machine_parts != parts)
        throw InputError({log.path, 0, 0}, "", "this log was read for another machine");
    }
  }
  return from_log::Estimate(sketch, logs, tests, options).run();
}

}  // namespace sparflow
