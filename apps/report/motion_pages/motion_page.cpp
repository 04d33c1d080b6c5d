#include "apps/report/motion_pages/motion_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/charts/obstacle_drawing.h"
#include "models/files/model_file.h"
#include "models/math/units.h"
#include "optimizer/solve/optimize_cycle.h"
#include "optimizer/sway/pendulum.h"
#include "problems/motion_table.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

LineSeries curve(std::string name, VectorXd y, int color = -1,
                 LineStyle style = LineStyle::kPlain) {
  LineSeries series;
  series.name = std::move(name);
  series.y = std::move(y);
  series.color = color;
  series.style = style;
  return series;
}

/// Curves of a motion under the exact law, in the field's units.
struct Curves {
  VectorXd t;
  Eigen::MatrixXd flow, pressure;  // by cylinder [l/min], [bar]
  Eigen::MatrixXd pump_pressure;   // by pump [bar]
  Eigen::MatrixXd pump_flow;       // by pump [l/min]
  VectorXd power;                  // [kW]
};

Curves curves_of(const CraneModel& model, const MotionProblem& problem, const Trajectory& motion) {
  const LeastFlows least = least_flows(model.machine, problem.limits);
  const Trajectory fine = motion.refined(4);
  const Eigen::Index rows = fine.size();
  const auto cylinders = static_cast<Eigen::Index>(model.cylinders.size());
  const auto pumps = static_cast<Eigen::Index>(model.pumps.size());
  Curves c;
  c.t = fine.t;
  c.flow.resize(rows, cylinders);
  c.pressure.resize(rows, cylinders);
  c.pump_pressure.resize(rows, pumps);
  c.pump_flow.resize(rows, pumps);
  c.power.resize(rows);
  Chain chain(model);
  VectorXd q, qd, qdd;
  for (Eigen::Index k = 0; k < rows; ++k) {
    q = fine.q.row(k);
    qd = fine.qd.row(k);
    qdd = fine.qdd.row(k);
    const MachineState& s =
        chain.evaluate({q.data(), qd.data(), qdd.data()}, payload_at(problem, motion, fine.t[k]));
    for (Eigen::Index i = 0; i < cylinders; ++i) {
      const CylinderState& cylinder = s.cylinders[static_cast<std::size_t>(i)];
      c.flow(k, i) = cylinder.flow / units::kLitrePerMinute;
      c.pressure(k, i) = cylinder.moving && firmly_moving(least, static_cast<std::size_t>(i),
                                                          cylinder.flow, cylinder.speed)
                             ? cylinder.pressure / units::kBar
                             : std::nan("");
    }
    for (Eigen::Index p = 0; p < pumps; ++p) {
      c.pump_pressure(k, p) = s.pumps[static_cast<std::size_t>(p)].pressure / units::kBar;
      c.pump_flow(k, p) = s.pumps[static_cast<std::size_t>(p)].flow / units::kLitrePerMinute;
    }
    c.power[k] = s.power / 1e3;
  }
  return c;
}

std::vector<Eigen::Vector2d> tip_path(const Machine& machine, const Trajectory& motion,
                                      const std::optional<DrawingPlane>& fixed = {}) {
  std::vector<Eigen::Vector2d> points;
  for (const DrawingFrame& frame : drawing_frames(machine, motion, 80, fixed))
    points.push_back(frame.tip);
  return points;
}

/// Height of the ground [m] where the problem has one. None is assumed, because base frames stand at any height.
std::optional<double> ground_of(const MotionProblem& problem) {
  for (const Obstacle& o : problem.obstacles) {
    const auto* half = std::get_if<HalfSpace>(&o.shape);
    if (half != nullptr && half->normal.z() > 0.99) return half->point.z();
  }
  return std::nullopt;
}

/// Angle of the rope along the motion, by the pendulum.
void add_sway(Page& page, const Machine& machine, const MotionProblem& problem,
              const Trajectory& motion, std::vector<Span> legs) {
  const Trajectory fine = motion.refined(4);
  const RopeCourse course = rope_course(machine, fine, problem.sway->cable, 2);
  LineChart chart;
  chart.title = "Sway of the load";
  chart.group = "motion";
  chart.y_axis = {"angle of the rope", "deg"};
  chart.note =
      "From the vertical, by the pendulum without damping. What a swinging load does to the "
      "cylinders' forces is not part of the model.";
  chart.x = fine.t;
  VectorXd angle(fine.size());
  for (Eigen::Index k = 0; k < fine.size(); ++k)
    angle[k] = rope_angle(machine, course.knots[static_cast<std::size_t>(k)]) / units::kDegree;
  chart.series.push_back(curve("sway", std::move(angle)));
  chart.series.push_back(
      curve("limit", VectorXd::Constant(fine.size(), problem.sway->limit / units::kDegree), -1,
            LineStyle::kLimit));
  chart.spans = std::move(legs);
  page.plot(std::move(chart));
}

/// Time, payload and energy of each leg of a cycle.
void add_leg_table(Page& page, const CraneModel& model, const MotionProblem& problem,
                   const OptimizeResult& result) {
  if (problem.stops.empty()) return;
  Table table;
  table.title = "Legs of the cycle";
  table.columns = {
      {"to"}, {"payload", "kg", 4}, {"from", "s", 4}, {"to", "s", 4}, {"energy", "kJ"}};
  table.note = fmt::format(
      "One optimisation over the whole: {:.1f} kJ; its legs optimised one after the other, in "
      "shares of the time in proportion to their shortest: {:.1f} kJ.",
      result.energy.total / 1e3, result.legwise_energy / 1e3);
  for (const LegEnergy& leg : leg_energies(model, problem, result.motion))
    table.rows.push_back({leg.to, leg.payload, leg.begin, leg.end, leg.energy / 1e3});
  page.table(std::move(table));
}

void add_curves(Page& page, const CraneModel& model, const MotionProblem& problem,
                const OptimizeResult& result) {
  const Machine& machine = model.machine;
  const Curves c = curves_of(model, problem, result.motion);
  std::vector<Span> legs;
  if (!problem.stops.empty()) {
    for (const CycleLeg& leg : legs_of(problem, result.motion))
      legs.push_back({leg.begin, leg.end, fmt::format("to {}, {:.4g} kg", leg.to, leg.payload)});
  }
  const auto chart = [&](const std::string& title, const std::string& label,
                         const std::string& unit) {
    LineChart out;
    out.title = title;
    out.group = "motion";
    out.width = FigureWidth::kHalf;
    out.y_axis = {label, unit};
    out.x = c.t;
    out.spans = legs;
    return out;
  };
  LineChart speed = chart("Joint speeds", "share of the limit", "%");
  const Trajectory fine = result.motion.refined(4);
  for (int j = 0; j < machine.joint_count(); ++j) {
    const Range& r = problem.limits.velocity[static_cast<std::size_t>(j)];
    const double full = std::max(std::abs(r.lo), std::abs(r.hi));
    speed.series.push_back(
        curve(machine.joints[static_cast<std::size_t>(j)].name, 100.0 * fine.qd.col(j) / full));
  }
  LineChart flow = chart("Flows", "flow", "l/min");
  LineChart pressure = chart("Pressures", "pressure", "bar");
  pressure.note =
      "Working pressure of each moving cylinder, and pump pressure. Their difference is the "
      "pressure "
      "drop that each valve throttles.";
  // Pumps come first: where one cylinder moves alone, its flow is drawn over that of its pump.
  for (int p = 0; p < machine.pump_count(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    const std::string name = "pump " + machine.pumps[i].name;
    flow.series.push_back(curve(name, c.pump_flow.col(p), machine.cylinder_count() + p));
    const double limit = problem.limits.pump_max_flow[i] / units::kLitrePerMinute;
    if (limit > 0.0)
      flow.series.push_back(
          curve(name + " limit", VectorXd::Constant(c.t.size(), limit), -1, LineStyle::kLimit));
    pressure.series.push_back(curve(name, c.pump_pressure.col(p), machine.cylinder_count() + p));
  }
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const std::string& name = machine.cylinders[static_cast<std::size_t>(i)].name;
    if (!machine.cylinders[static_cast<std::size_t>(i)].hydraulic()) continue;
    flow.series.push_back(curve(name, c.flow.col(i), i));
    pressure.series.push_back(curve(name, c.pressure.col(i), i));
  }
  LineChart power = chart("Power", "pump power", "kW");
  power.series.push_back(curve("power", c.power));
  page.plot(std::move(speed));
  page.plot(std::move(flow));
  page.plot(std::move(pressure));
  page.plot(std::move(power));
  if (problem.sway) add_sway(page, machine, problem, result.motion, std::move(legs));
}

void add_losses(Page& page, const CraneModel& model, const MotionProblem& problem,
                const OptimizeResult& result, const std::optional<ComparedMotion>& baseline) {
  BarChart bars;
  bars.title = "Useful energy and throttling loss";
  bars.value_axis = {"energy", "kJ"};
  bars.note =
      "Useful: working pressure times flow. Throttled: pump pressure above the working pressure, "
      "times "
      "flow; another cylinder, the margin or standby sets the pump pressure.";
  std::vector<std::pair<std::string, MotionEnergy>> motions = {
      {result.starts.empty() ? "this motion" : "optimised", result.energy}};
  if (baseline)
    motions.emplace_back(baseline->name, exact_energy(model, problem, baseline->motion));
  for (const auto& [name, energy] : motions) {
    for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
      if (!model.machine.cylinders[i].hydraulic()) continue;
      bars.categories.push_back(name + ": " + model.machine.cylinders[i].name);
    }
  }
  BarSeries useful{"useful", VectorXd(bars.categories.size())},
      lost{"throttled", VectorXd(bars.categories.size())};
  Eigen::Index k = 0;
  for (const auto& [name, energy] : motions) {
    for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
      if (!model.machine.cylinders[i].hydraulic()) continue;
      useful.values[k] = energy.useful[i] / 1e3;
      lost.values[k++] = energy.throttling[i] / 1e3;
    }
  }
  bars.series = {useful, lost};
  page.plot(std::move(bars));
}

/// Distance to a limit [%]; in words where the number would only show the solver's rounding.
TableCell margin_cell(const LimitCheck& c) {
  constexpr double kTouching = 1e-4;  // of the limit's scale
  if (std::abs(c.excess) <= kTouching) return is_end_condition(c) ? "met" : "at the limit";
  return -100.0 * c.excess;
}

std::string in_words(NlpStatus status) {
  std::string words = to_string(status);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

void add_tables(Page& page, const OptimizeResult& result) {
  Table limits;
  limits.title = "Limits at their worst, at 16 samples per mesh interval";
  if (result.motion.size() < 2) {
    const auto nearest = std::min_element(result.starts.begin(), result.starts.end(),
                                          [](const StartResult& a, const StartResult& b) {
                                            return (a.motion.size() > 1 ? a.excess : INFINITY) <
                                                   (b.motion.size() > 1 ? b.excess : INFINITY);
                                          });
    limits.title = "Limits of the motion that breaks them least (from " + nearest->seed + ")";
  }
  limits.columns = {{"limit"}, {"value", "", 5}, {"allowed", "", 5},
                    {"unit"},  {"at", "s", 4},   {"margin", "%", 3}};
  for (const LimitCheck& c : result.checks) {
    constexpr double kRounding = 1e-9;  // in any unit: smaller values are the solver's rounding
    const double value = std::abs(c.value) < kRounding ? 0.0 : c.value;
    limits.rows.push_back({c.what, value, c.limit, c.unit, c.time, margin_cell(c)});
  }
  if (!result.checks.empty()) page.table(std::move(limits));
  if (result.starts.empty()) return;
  Table starts;
  starts.title = "Starts";
  starts.columns = {{"from"},
                    {"outcome"},
                    {"duration", "s", 4},
                    {"initial guess", "kJ"},
                    {"optimised", "kJ"},
                    {"iterations", "", 5},
                    {"note"}};
  starts.note =
      "Energies by the exact law. \"Initial guess\" is the energy of the seed path driven in the "
      "same "
      "time, blank where that breaks a limit.";
  if (result.motion.size() < 2) {
    starts.note +=
        " A defect is a step between knots that a joint cannot make within its speed and "
        "acceleration "
        "limits: the time is too short, or the path is blocked.";
  }
  for (std::size_t i = 0; i < result.starts.size(); ++i) {
    const StartResult& s = result.starts[i];
    const bool usable = s.motion.size() > 1 && s.excess <= 1e-4;
    std::string note = usable ? "" : s.message;
    if (s.same_as >= 0)
      note = "same motion as " + result.starts[static_cast<std::size_t>(s.same_as)].seed;
    starts.rows.push_back({s.seed, usable ? std::string("kept all limits") : in_words(s.status),
                           s.duration, s.seed_feasible ? s.seed_energy / 1e3 : std::nan(""),
                           usable ? s.energy_exact / 1e3 : std::nan(""),
                           static_cast<double>(s.iterations), note});
  }
  starts.highlighted_row = result.best_start;
  page.table(std::move(starts));
}

std::string seconds_text(double s) { return fmt::format("{:.2f}", s); }

/// The same motion from above, where obstacles are outlines: for machines that do not stay in one vertical plane.
CraneDrawing view_from_above(const Machine& machine, const MotionProblem& problem,
                             const Trajectory& motion, const std::vector<ComparedMotion>& beside) {
  const DrawingPlane plane = top_plane(machine);
  CraneDrawing drawing;
  drawing.title = "The motion from above";
  drawing.note = "Obstacles are drawn as outlines, whatever their height.";
  drawing.group = "motion";
  drawing.x_axis = {plane.horizontal_name, "m"};
  drawing.z_axis = {plane.vertical_name, "m"};
  drawing.frames = drawing_frames(machine, motion, 90, plane);
  drawing.obstacles = outline_obstacles(problem.obstacles, plane);
  for (const ComparedMotion& other : beside)
    drawing.paths.push_back({other.name, tip_path(machine, other.motion, plane)});
  if (const auto* goal = std::get_if<TipGoal>(&problem.goal))
    drawing.goal = plane.project(goal->tip);
  drawing.payload = false;  // it hangs below the tip
  return drawing;
}

}  // namespace

void add_views(Page& page, const Machine& machine, const MotionProblem& problem,
               const Trajectory& motion, const std::vector<ComparedMotion>& beside) {
  CraneDrawing drawing;
  drawing.title = "The motion";
  std::vector<std::string> dashed;
  dashed.reserve(beside.size());
  for (const ComparedMotion& other : beside) dashed.push_back(other.name);
  drawing.note = fmt::format(
      "Move the slider to drive the crane. Darker drawings are later instants. Solid: path of the "
      "tip{}.",
      dashed.empty() ? "" : fmt::format("; dashed: its path along {}", fmt::join(dashed, ", ")));
  drawing.group = "motion";
  const DrawingPlane plane = drawing_plane(machine, problem.start);
  const bool above = plane.turns || fixed_tip_directions(machine).empty();
  const std::vector<std::string> missed = obstacles_beside(problem.obstacles, plane);
  if (plane.turns && !problem.obstacles.empty()) {
    drawing.note +=
        " The view turns with the crane; obstacles are cut where the crane stands at the start.";
  }
  if (!missed.empty()) {
    drawing.note += fmt::format(" Not in this view, because its plane does not meet {}: {}{}.",
                                missed.size() > 1 ? "them" : "it", fmt::join(missed, ", "),
                                above ? "; see the view from above" : "");
  }
  drawing.x_axis = {plane.horizontal_name, "m"};
  drawing.z_axis = {plane.vertical_name, "m"};
  drawing.frames = drawing_frames(machine, motion, 90);
  drawing.obstacles = cut_obstacles(problem.obstacles, plane);
  for (const ComparedMotion& other : beside)
    drawing.paths.push_back({other.name, tip_path(machine, other.motion)});
  if (const auto* goal = std::get_if<TipGoal>(&problem.goal)) {
    drawing.goal =
        drawing_plane(machine, motion.q.row(motion.size() - 1).transpose()).project(goal->tip);
  }
  drawing.ground = ground_of(problem);
  drawing.payload = problem.payload > 0.0;
  page.plot(std::move(drawing));
  if (above) page.plot(view_from_above(machine, problem, motion, beside));
}

void add_motion(Page& page, const CraneModel& model, const MotionProblem& problem,
                const OptimizeResult& result, const std::optional<ComparedMotion>& baseline) {
  page.section("Motion: " + problem.name);
  if (result.motion.size() < 2) {
    page.paragraph("No motion was found; " + std::string(result.starts.empty()
                                                             ? "there is no seed path either."
                                                             : "the table shows all starts."));
    if (!result.starts.empty()) add_tables(page, result);
    return;
  }
  const std::string beside =
      result.nearest_line_energy > 0.0
          ? fmt::format("straight line, nearest goal: {:.1f} kJ", result.nearest_line_energy / 1e3)
      : result.best_seed_energy > 0.0
          ? fmt::format("best seed, {}: {:.1f} kJ", result.best_seed_name,
                        result.best_seed_energy / 1e3)
          : std::string();
  double lost = 0.0;
  for (const double t : result.energy.throttling) lost += t;
  const Tone tone = mostly_outside_data(result) ? Tone::kWarning : Tone::kGood;
  std::vector<Tile> tiles = {
      {fmt::format("{:.1f}", result.energy.total / 1e3), "kJ", "pump energy, exact law", beside,
       tone},
      {seconds_text(result.duration), "s", "duration"},
      {fmt::format("{:.1f}", lost / 1e3), "kJ", "throttling loss",
       fmt::format("{:.0f} % of the energy", 100.0 * lost / std::max(1.0, result.energy.total))},
      {fmt::format("{:+.1f}", result.energy.potential_difference / 1e3), "kJ",
       "potential energy gained", "end minus start"}};
  if (result.lower_bound > 0.0) {
    tiles.push_back(
        {fmt::format("{:.1f}", result.lower_bound / 1e3), "kJ", "estimated lower bound",
         fmt::format("gap {:.1f} %; {}", 100.0 * bound_gap(result),
                     result.lower_bound_time > 0.0
                         ? fmt::format("motions of {:.2f} s or less", result.lower_bound_time)
                         : "motions of any duration")});
  } else if (!result.bound_note.empty()) {
    tiles.push_back({"none", "", "estimated lower bound", result.bound_note});
  }
  if (mostly_outside_data(result)) {
    tiles.push_back({fmt::format("{:.0f}", 100.0 * result.energy.moving_share_outside_data), "%",
                     "outside the data",
                     "of the moving time: flows or forces from which the model has not learned",
                     Tone::kWarning});
  }
  page.tiles(std::move(tiles));
  if (result.energy.impossible()) {
    page.paragraph(
        "Warning: the pump delivers less energy than machine and payload gain. The working "
        "pressures are "
        "extrapolated to loads beyond the data; fit the model to logs with such loads.");
  }
  if (result.energy.moving_share_outside_data > 0.02) {
    page.paragraph(
        fmt::format("{:.0f} % of the cylinders' moving time lies outside the flows and forces of "
                    "the data; the least certain working pressure of the motion has a standard "
                    "deviation of {:.1f} bar.",
                    100.0 * result.energy.moving_share_outside_data,
                    result.energy.largest_pressure_std / units::kBar));
  }
  std::vector<ComparedMotion> others;
  if (baseline) others.push_back(*baseline);
  add_views(page, model.machine, problem, result.motion, others);
  add_leg_table(page, model, problem, result);
  add_curves(page, model, problem, result);
  add_losses(page, model, problem, result, baseline);
  add_tables(page, result);
}

Page motion_page(const CraneModel& model, const MotionProblem& problem,
                 const OptimizeResult& result, const std::optional<ComparedMotion>& baseline) {
  Page page("Energy-optimal motion: " + problem.name);
  if (result.status == OptimizeStatus::kOptimal) {
    page.verdict(
        mostly_outside_data(result) ? Tone::kWarning : Tone::kGood, motion_headline(result),
        "All limits are kept at 16 samples per mesh interval. Energies are those of the exact, "
        "unsmoothed law. " +
            constant_pressure_note(model));
  } else if (result.status == OptimizeStatus::kFeasible) {
    page.verdict(
        Tone::kWarning,
        fmt::format("{:.1f} kJ in {:.2f} s, not converged", result.energy.total / 1e3,
                    result.duration),
        "All limits are kept at 16 samples per mesh interval, but the motion is a guess or of a "
        "solve that was cut short: a cheaper one may be near.");
  } else {
    // The message begins like the headline ("lift: infeasible. Worst: ..."); that part is left out.
    const std::string prefix = problem.name + ": infeasible. ";
    std::string why = result.message;
    if (why.rfind(prefix, 0) == 0) why.erase(0, prefix.size());
    const std::string in = result.duration > 0.0 ? fmt::format(" in {:g} s", result.duration) : "";
    page.verdict(Tone::kBad,
                 result.status == OptimizeStatus::kInfeasible
                     ? fmt::format("Infeasible: no motion was found that keeps all limits{}", in)
                     : std::string(to_string(result.status)),
                 why);
  }
  if (result.status == OptimizeStatus::kInterrupted) {
    page.banner("Interrupted: this is the best motion so far, and a cheaper one may exist.");
  } else if (result.interrupted) {
    page.banner("Interrupted: the motion is whole, the lower bound is missing.");
  }
  add_motion(page, model, problem, result, baseline);
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("machine", model.machine.name);
  for (const DataSource& d : model.data)
    page.provenance(d.use + " log", d.file + ", sha256 " + d.sha256.substr(0, 16));
  return page;
}

}  // namespace sparflow
