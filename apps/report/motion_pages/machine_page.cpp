#include "apps/report/motion_pages/machine_page.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "models/files/model_file.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

/// Samples of a curve over a joint's range.
/// @threshold [1] 20..2000; chosen: a smooth curve on a screen
constexpr int kCurveSamples = 121;

struct ReviewedJoint {
  const Cylinder& cylinder;
  const Joint& joint;
  bool turns;
  double shown(double q) const { return turns ? q / units::kDegree : q; }
  const char* unit() const { return turns ? "deg" : "m"; }
};

ReviewedJoint reviewed_joint(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const Joint& joint = machine.joints[static_cast<std::size_t>(c.joint)];
  return {c, joint, joint.type == JointType::kRevolute};
}

const char* linkage_word(const Cylinder& c) {
  if (std::holds_alternative<PinsLinkage>(c.linkage)) return "pins";
  if (std::holds_alternative<FourBarLinkage>(c.linkage)) return "four_bar";
  return std::holds_alternative<RackLinkage>(c.linkage) ? "rack" : "direct";
}

LineChart joint_chart(const ReviewedJoint& r, const std::vector<LinkageSample>& samples,
                      const std::string& title, const Quantity& y) {
  LineChart chart;
  chart.title = r.cylinder.name + ": " + title;
  chart.width = FigureWidth::kHalf;
  chart.x_axis = {r.joint.name, r.unit()};
  chart.y_axis = y;
  chart.x.resize(static_cast<Eigen::Index>(samples.size()));
  for (std::size_t k = 0; k < samples.size(); ++k)
    chart.x[static_cast<Eigen::Index>(k)] = r.shown(samples[k].q);
  return chart;
}

LineSeries series_of(const std::string& name, const std::vector<LinkageSample>& samples,
                     double LinkageSample::*member, double unit) {
  LineSeries series;
  series.name = name;
  series.y.resize(static_cast<Eigen::Index>(samples.size()));
  for (std::size_t k = 0; k < samples.size(); ++k)
    series.y[static_cast<Eigen::Index>(k)] = samples[k].*member / unit;
  return series;
}

void add_cylinder(Page& page, const MachineReview& review, int i) {
  const Machine& machine = review.machine;
  const ReviewedJoint r = reviewed_joint(machine, i);
  page.section(fmt::format("Cylinder {}", r.cylinder.name));
  const std::vector<LinkageSample> curve =
      linkage_samples(machine, i, review.posture, review.payload, kCurveSamples);
  LineChart lever = joint_chart(r, curve, "lever arm", {"dx/dq", r.turns ? "m/rad" : "-"});
  lever.series.push_back(series_of("lever arm", curve, &LinkageSample::rate, 1.0));
  LineChart force = joint_chart(r, curve, "static force", {"force", "kN"});
  force.note = "Positive: the load pushes the rod in.";
  force.series.push_back(series_of("no payload", curve, &LinkageSample::force_empty, 1e3));
  if (review.payload > 0.0)
    force.series.push_back(series_of(fmt::format("{:g} kg", review.payload), curve,
                                     &LinkageSample::force_loaded, 1e3));
  page.plot(std::move(lever));
  page.plot(std::move(force));
  Table table;
  table.title =
      fmt::format("{} over {} ({})", r.cylinder.name, r.joint.name, linkage_word(r.cylinder));
  table.columns = {{r.joint.name, r.unit(), 4},
                   {"stroke", "m", 4},
                   {"length", "m", 4},
                   {"lever arm dx/dq", r.turns ? "m/rad" : "", 4},
                   {"static force, empty", "kN", 4},
                   {"with payload", "kN", 4}};
  for (const LinkageSample& s :
       linkage_samples(machine, i, review.posture, review.payload, review.rows)) {
    table.rows.push_back(
        {r.shown(s.q), s.stroke, s.length, s.rate, s.force_empty / 1e3, s.force_loaded / 1e3});
  }
  page.table(std::move(table));
}

/// A number as people write it: no sign before a zero.
std::string rounded(double value, int digits) {
  const std::string text = fmt::format("{:.{}f}", value, digits);
  return text.find_first_not_of("-0.") == std::string::npos && text.front() == '-' ? text.substr(1)
                                                                                   : text;
}

}  // namespace

Page machine_page(const MachineReview& review) {
  const Machine& machine = review.machine;
  Page page("Machine: " + machine.name);
  if (review.warnings.empty()) {
    page.verdict(Tone::kGood, "Nothing unusual in the file",
                 "Drive each joint over its range below and see whether it is your machine.");
  } else {
    page.verdict(
        Tone::kWarning,
        fmt::format("{} warning{}", review.warnings.size(), review.warnings.size() > 1 ? "s" : ""),
        fmt::format("{}", fmt::join(review.warnings, ". ")));
  }
  CraneDrawing drawing;
  drawing.title = "The machine";
  drawing.note =
      "The slider moves one joint after another over its range; the others stand in the posture of "
      "the tables. The line is the tip's path.";
  const Trajectory motion = joint_sweep(machine, review.posture);
  const DrawingPlane plane = drawing_plane(machine, review.posture);
  drawing.x_axis = {plane.horizontal_name, "m"};
  drawing.z_axis = {plane.vertical_name, "m"};
  drawing.stills = 1;
  const int frames = joint_sweep_frames(motion);
  drawing.frames = drawing_frames(machine, motion, frames);
  drawing.payload = review.payload > 0.0;
  page.plot(std::move(drawing));
  if (plane.turns) {
    const DrawingPlane top = top_plane(machine);
    CraneDrawing above;
    above.title = "From above";
    above.x_axis = {top.horizontal_name, "m"};
    above.z_axis = {top.vertical_name, "m"};
    above.stills = 1;
    above.frames = drawing_frames(machine, motion, frames, top);
    above.payload = false;  // it hangs below the tip
    page.plot(std::move(above));
  }
  for (int i = 0; i < machine.cylinder_count(); ++i) add_cylinder(page, review, i);
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("machine file", review.file);
  return page;
}

std::string machine_json(const MachineReview& review) {
  const Machine& machine = review.machine;
  nlohmann::json out = {{"machine", machine.name},
                        {"payload_kg", review.payload},
                        {"warnings", review.warnings},
                        {"cylinders", nlohmann::json::array()}};
  for (int j = 0; j < machine.joint_count(); ++j)
    out["posture"][machine.joints[static_cast<std::size_t>(j)].name] = review.posture[j];
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const ReviewedJoint r = reviewed_joint(machine, i);
    nlohmann::json rows = nlohmann::json::array();
    for (const LinkageSample& s :
         linkage_samples(machine, i, review.posture, review.payload, review.rows)) {
      rows.push_back({{"q", s.q},
                      {"stroke_m", s.stroke},
                      {"length_m", s.length},
                      {"rate", s.rate},
                      {"force_empty_N", s.force_empty},
                      {"force_loaded_N", s.force_loaded}});
    }
    out["cylinders"].push_back({{"name", r.cylinder.name},
                                {"joint", r.joint.name},
                                {"linkage", linkage_word(r.cylinder)},
                                {"rows", rows}});
  }
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string machine_table(const MachineReview& review) {
  const Machine& machine = review.machine;
  std::string text =
      fmt::format("{}: {} joints, {} cylinders, {} pumps\n", machine.name, machine.joint_count(),
                  machine.cylinder_count(), machine.pump_count());
  std::string posture;
  for (int j = 0; j < machine.joint_count(); ++j) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(j)];
    posture +=
        fmt::format("{}{} {} {}", j > 0 ? ", " : "", joint.name, rounded(review.posture[j], 3),
                    joint.type == JointType::kRevolute ? "rad" : "m");
  }
  text += "  other joints at " + posture + "\n";
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const ReviewedJoint r = reviewed_joint(machine, i);
    text +=
        fmt::format("\n{} over {} ({})\n", r.cylinder.name, r.joint.name, linkage_word(r.cylinder));
    text += fmt::format("  {:>10} {:>11} {:>11} {:>14} {:>12} {:>18}\n",
                        fmt::format("q [{}]", r.unit()), "stroke [m]", "length [m]",
                        r.turns ? "dx/dq [m/rad]" : "dx/dq [-]", "empty [kN]",
                        fmt::format("{:g} kg [kN]", review.payload));
    for (const LinkageSample& s :
         linkage_samples(machine, i, review.posture, review.payload, review.rows)) {
      text += fmt::format("  {:>10} {:>11} {:>11} {:>14} {:>12} {:>18}\n",
                          rounded(r.shown(s.q), r.turns ? 1 : 3), rounded(s.stroke, 3),
                          rounded(s.length, 3), rounded(s.rate, 3), rounded(s.force_empty / 1e3, 2),
                          rounded(s.force_loaded / 1e3, 2));
    }
  }
  return text;
}

}  // namespace sparflow
