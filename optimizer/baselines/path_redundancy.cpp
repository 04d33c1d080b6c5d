#include "optimizer/baselines/path_redundancy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "models/math/error.h"
#include "optimizer/baselines/self_motion.h"
#include "problems/clearance.h"
#include "problems/motion_limits.h"
#include "problems/time_parametrise.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNoCost = std::numeric_limits<double>::infinity();
/// Control points of the first grid.
/// @threshold [1] 5..1000; chosen: the grid is refined until the energy settles
constexpr int kFirstStages = 25;
/// Spacing of the first grid's values of a joint, in what a joint travels at full speed in a stage.
/// @threshold [stages] 0.05..1; chosen: at full speed a joint passes 2.5 values in a stage
constexpr double kFirstLineSpacing = 0.4;
/// Step of a joint, in seconds at full speed, below which it is at rest.
/// @threshold [s] 1e-12..1e-6; numerical: a smaller step is Newton's residual
constexpr double kSameValue = 1e-9;
/// Share of a flow limit that is kept free at the knots.
/// @threshold [1] 0..0.1; chosen: limits are judged between the knots, where flows can be slightly larger
constexpr double kFlowMargin = 2e-3;

/// The tip's progress in a duration of 1: shares of the line at equally spaced instants.
struct TipLaw {
  double top_speed = 0.0;  // over the mean; 0 = tabulated
  VectorXd table;
  double at(double time) const {
    if (table.size() > 0) {
      const double x = time * static_cast<double>(table.size() - 1);
      const auto k = std::min(static_cast<Eigen::Index>(x), table.size() - 2);
      return table[k] + (x - static_cast<double>(k)) * (table[k + 1] - table[k]);
    }
    const double ramp = 1.0 - 1.0 / top_speed, mirrored = std::min(time, 1.0 - time);
    const double s = mirrored < ramp ? 0.5 * top_speed * mirrored * mirrored / ramp
                                     : top_speed * (mirrored - 0.5 * ramp);
    return time <= 0.5 ? s : 1.0 - s;
  }
};

/// Control points of a motion of time_parametrise().
MatrixXd spline_controls(const Trajectory& motion) {
  const Eigen::Index n = motion.size() - 1;
  MatrixXd c(n, motion.q.cols());
  for (Eigen::Index k = 0; k < n; ++k) {
    c.row(k) = motion.q.row(k) + 0.5 * (motion.t[k + 1] - motion.t[k]) * motion.qd.row(k);
  }
  return c;
}

/// Row of `c` at a share (0 to 1) of its rows, interpolated linearly.
VectorXd row_at(const MatrixXd& c, double share) {
  const double x = share * static_cast<double>(c.rows() - 1);
  const auto k = std::min(static_cast<Eigen::Index>(x), c.rows() - 2);
  const double rest = x - static_cast<double>(k);
  return ((1.0 - rest) * c.row(k) + rest * c.row(k + 1)).transpose();
}

/// A step from a posture of one stage to one of the next, with the cheapest sequence of steps before it.
struct LineStep {
  int from = 0, to = 0;
  int before = -1;         // index of the step in the stage before
  double total = kNoCost;  // [J] cost up to this step, included
};

struct LineFound {
  MatrixXd control;  // empty = no path
  double sum = kNoCost;
  int stage = 0;  // last stage that was reached
};

/// Where the postures of a stage are sought.
struct LineGrid {
  double spacing;          // [s at full speed]
  const MatrixXd& around;  // control points near which to search, empty = everywhere
  double reach;            // distance from them [s at full speed]
};

class LineProgram {
 public:
  LineProgram(const CraneModel& model, const MotionProblem& problem, double duration,
              const Trajectory& line)
      : problem_(problem),
        duration_(duration),
        chain_(model),
        ratios_(problem),
        postures_(problem),
        from_(tip_position<double>(problem.machine, problem.start)),
        to_(std::get<TipGoal>(problem.goal).tip) {
    if (!problem.obstacles.empty()) clearance_ = std::make_unique<ClearanceModel>(problem);
    if (line.size() > 2) known_ = spline_controls(line);
  }

  const MotionProblem& problem() const { return problem_; }
  double duration() const { return duration_; }

  /// The time law of the motion given as `line`.
  std::optional<TipLaw> known_law() const {
    const Eigen::Vector3d way = to_ - from_;
    if (known_.rows() == 0 || !(way.squaredNorm() > 0.0)) return std::nullopt;
    TipLaw law;
    law.table.resize(known_.rows());
    for (Eigen::Index k = 0; k < known_.rows(); ++k) {
      const VectorXd q = known_.row(k).transpose();
      law.table[k] = std::clamp(
          way.dot(tip_position<double>(problem_.machine, q) - from_) / way.squaredNorm(), 0.0, 1.0);
    }
    law.table[0] = 0.0;
    law.table[known_.rows() - 1] = 1.0;
    return law;
  }

  /// @param spacing of the grid [s at full speed]  @param around control points near which to search, empty = everywhere
  /// @param reach distance from them [s at full speed]
  LineFound solve(const TipLaw& law, int stages, double spacing, const MatrixXd& around,
                  double reach) {
    const double h = duration_ / stages;
    set_limits(h, around.rows() == 0 ? spacing : 0.0);
    std::vector<std::vector<VectorXd>> states(static_cast<std::size_t>(stages));
    std::vector<std::vector<LineStep>> steps(states.size());
    states[0] = {postures_.scaled(problem_.start)};
    LineFound found;
    for (std::size_t k = 1; k < states.size(); ++k) {
      const double time = static_cast<double>(k) / (stages - 1);
      const Eigen::Vector3d tip = from_ + law.at(time) * (to_ - from_);
      place(tip, time, {spacing, around, reach}, states[k - 1], states[k]);
      extend(k, h, states, steps);
      found.stage = static_cast<int>(k);
      if (steps[k].empty()) return found;
    }
    int best = -1;
    const VectorXd rest = VectorXd::Zero(problem_.start.size());
    const std::vector<LineStep>& last = steps.back();
    for (std::size_t i = 0; i < last.size(); ++i) {
      const VectorXd d =
          states.back()[index(last[i].to)] - states[states.size() - 2][index(last[i].from)];
      if (last[i].total < found.sum && changes_well(d, rest)) {
        found.sum = last[i].total;
        best = static_cast<int>(i);
      }
    }
    if (best < 0) return found;
    MatrixXd z(stages, problem_.start.size());
    for (std::size_t k = states.size() - 1; k > 0; --k) {
      const LineStep& s = steps[k][index(best)];
      z.row(static_cast<Eigen::Index>(k)) = states[k][index(s.to)].transpose();
      best = s.before;
    }
    z.row(0) = states[0][0].transpose();
    for (Eigen::Index k = 1; k < stages; ++k) {
      for (Eigen::Index j = 0; j < z.cols(); ++j) {
        if (std::abs(z(k, j) - z(k - 1, j)) < kSameValue) z(k, j) = z(k - 1, j);
      }
    }
    found.control = z * postures_.scale().asDiagonal();
    found.control.row(0) = problem_.start.transpose();
    return found;
  }

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }

  /// Sets the largest steps and changes of a step, in seconds at full speed. Grid values round second differences by up
  /// to two spacings, which is allowed for, so that a coarse grid does not fail.
  void set_limits(double h, double spacing) {
    const VectorXd& scale = postures_.scale();
    const Eigen::Index n = scale.size();
    least_step_.resize(n);
    most_step_.resize(n);
    least_change_.resize(n);
    most_change_.resize(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const Range& v = problem_.limits.velocity[static_cast<std::size_t>(j)];
      const Range& a = problem_.limits.acceleration[static_cast<std::size_t>(j)];
      least_step_[j] = h * v.lo / scale[j];
      most_step_[j] = h * v.hi / scale[j];
      least_change_[j] = h * h * a.lo / scale[j] - 2.0 * spacing;
      most_change_[j] = h * h * a.hi / scale[j] + 2.0 * spacing;
    }
  }

  bool changes_well(const VectorXd& before, const VectorXd& after) const {
    for (Eigen::Index j = 0; j < after.size(); ++j) {
      const double d = after[j] - before[j];
      if (d < least_change_[j] || d > most_change_[j]) return false;
    }
    return true;
  }

  /// Collects the postures of one stage.
  void place(const Eigen::Vector3d& tip, double time, const LineGrid& grid,
             const std::vector<VectorXd>& before, std::vector<VectorXd>& states) {
    const auto& [spacing_of, around, reach] = grid;
    const double spacing = spacing_of;  // a lambda cannot capture the name above
    const auto begin = [&](VectorXd z, double far) {
      if (!postures_.project(tip, -1, z)) return;
      if (!postures_.within_range(z)) return;
      for (const VectorXd& s : states) {
        if ((s - z).norm() < spacing) return;  // its self-motion has been traced already
      }
      postures_.trace(tip, z, spacing, far, states);
    };
    if (around.rows() > 0) {
      VectorXd z = postures_.scaled(row_at(around, time));
      begin(z, reach);
      // Near a limit of position the projection can leave the range; then that joint is held at its limit.
      for (Eigen::Index j = 0; states.empty() && j < z.size(); ++j) {
        const Range& r = problem_.limits.position[static_cast<std::size_t>(j)];
        for (const double limit : {r.lo, r.hi}) {
          VectorXd held = z;
          held[j] = limit / postures_.scale()[j];
          if (std::abs(held[j] - z[j]) > spacing) continue;
          if (postures_.project(tip, static_cast<int>(j), held) && postures_.within_range(held))
            postures_.trace(tip, held, spacing, reach, states);
        }
      }
    } else {
      for (const VectorXd& z : before) begin(z, kWholeCurve);
    }
    if (known_.rows() > 0) {
      VectorXd z = postures_.scaled(row_at(known_, time));
      if (postures_.project(tip, -1, z) && postures_.within_range(z)) states.push_back(z);
    }
    if (clearance_) {
      states.erase(std::remove_if(states.begin(), states.end(),
                                  [&](const VectorXd& z) {
                                    return !clearance_->clear(postures_.joints(z).data());
                                  }),
                   states.end());
    }
  }

  /// Finds the steps from stage k - 1 to k that keep the limits, each with its cheapest predecessor.
  void extend(std::size_t k, double h, const std::vector<std::vector<VectorXd>>& states,
              std::vector<std::vector<LineStep>>& steps) {
    const std::vector<VectorXd>& here = states[k - 1];
    std::vector<std::vector<int>> arriving(
        here.size());  // steps that end in each posture, cheapest first
    if (k > 1) {
      const std::vector<LineStep>& before = steps[k - 1];
      for (std::size_t i = 0; i < before.size(); ++i)
        arriving[index(before[i].to)].push_back(static_cast<int>(i));
      for (std::vector<int>& list : arriving) {
        std::sort(list.begin(), list.end(),
                  [&](int a, int b) { return before[index(a)].total < before[index(b)].total; });
      }
    }
    const VectorXd rest = VectorXd::Zero(problem_.start.size());
    VectorXd d(rest.size());
    for (std::size_t i = 0; i < here.size(); ++i) {
      if (k > 1 && arriving[i].empty()) continue;
      for (std::size_t j = 0; j < states[k].size(); ++j) {
        bool fits = true;
        for (Eigen::Index c = 0; fits && c < d.size(); ++c) {
          d[c] = states[k][j][c] - here[i][c];
          if (std::abs(d[c]) < kSameValue) d[c] = 0.0;
          fits = d[c] >= least_step_[c] && d[c] <= most_step_[c];
        }
        if (!fits) continue;
        LineStep step{static_cast<int>(i), static_cast<int>(j), -1, kNoCost};
        double so_far = kNoCost;
        if (k == 1) {
          if (changes_well(rest, d)) so_far = 0.0;
        } else {
          for (const int b : arriving[i]) {
            const LineStep& s = steps[k - 1][index(b)];
            if (!changes_well(here[i] - states[k - 2][index(s.from)], d)) continue;
            so_far = s.total;
            step.before = b;
            break;
          }
        }
        if (so_far == kNoCost) continue;
        step.total = so_far + cost(here[i], d, h);
        if (step.total < kNoCost) steps[k].push_back(step);
      }
    }
  }

  /// Energy of one step [J], infinite where a limit is violated.
  double cost(const VectorXd& from, const VectorXd& d, double h) {
    q_ = postures_.joints(from + 0.5 * d);
    qd_ = postures_.joints(d) / h;
    if (ratios_.speed(q_, qd_, nullptr) > 1.0 - kFlowMargin) return kNoCost;
    const double trusted = problem_.limits.pressure_std;
    const MachineState& s =
        chain_.evaluate({q_.data(), qd_.data()}, problem_.payload, trusted > 0.0);
    for (const CylinderState& c : s.cylinders) {
      if (trusted > 0.0 && c.pressure_std > trusted) return kNoCost;
    }
    for (std::size_t p = 0; p < s.pumps.size(); ++p) {
      const double most = problem_.limits.pump_max_pressure[p];
      if (most > 0.0 && problem_.machine.pumps[p].type == PumpType::kLoadSensing &&
          s.pumps[p].pressure > most)
        return kNoCost;
    }
    return h * s.power;
  }

  /// Length of a trace, in seconds at full speed, that no self-motion reaches.
  /// @threshold [s] 10..1e6; numerical: no joint takes a quarter of an hour for its range
  static constexpr double kWholeCurve = 1e3;

  const MotionProblem& problem_;
  double duration_;
  Chain chain_;
  LimitRatios ratios_;
  SelfMotion postures_;
  Eigen::Vector3d from_, to_;
  std::unique_ptr<ClearanceModel> clearance_;
  MatrixXd known_;  // control points of the motion given as `line`
  VectorXd least_step_, most_step_, least_change_, most_change_, q_, qd_;
};

/// Solves on a sequence of refined grids, each around the result of the one before.
PathRedundancy refined_line(const CraneModel& model, LineProgram& program, const TipLaw& law,
                            LineFound coarse, const PathRedundancyOptions& options) {
  const MotionProblem& problem = program.problem();
  const double duration = program.duration();
  PathRedundancy best;
  best.top_speed = law.top_speed;
  double spacing = kFirstLineSpacing * duration / kFirstStages, last = kNoCost;
  int stages = kFirstStages;
  for (int grid = 1; grid < options.most_grids; ++grid) {
    // The values of the grid before are values of this one too, so a joint at rest can stay at rest.
    const double reach = 1.4 * spacing;
    spacing /= 3.0;
    stages = std::min(2 * stages, options.intervals);
    if (grid > 1) stages = options.intervals;
    LineFound next = program.solve(law, stages, spacing, coarse.control, reach);
    if (next.control.rows() == 0) {
      best.why = fmt::format("no motion on a grid of {} places: stopped at {:.0f} % of its time",
                             stages, 100.0 * next.stage / (stages - 1));
      break;
    }
    coarse = std::move(next);
    if (stages < options.intervals) continue;
    const Trajectory motion =
        spline_motion(coarse.control, duration / static_cast<double>(coarse.control.rows()));
    const double energy = exact_total_energy(model, motion, problem.payload, 4);
    const bool settled = std::abs(energy - last) < options.energy_change * last;
    last = std::min(last, energy);
    if (best.found() && energy >= best.energy.total) {
      if (settled) break;
      continue;
    }
    const std::vector<LimitCheck> checks = check_limits(model, problem, motion, options.refine);
    const double excess = worst_excess(checks);
    if (excess > options.limit_tolerance) {
      const LimitCheck& c = checks.front();
      best.why = fmt::format("{} at t={:.2f} s: {:.4g} against {:.4g} {}", c.what, c.time, c.value,
                             c.limit, c.unit);
      continue;
    }
    best.motion = motion;
    best.energy = exact_energy(model, problem, motion, options.refine);
    best.summed_J = coarse.sum;
    best.excess = excess;
    best.grids = grid + 1;
    if (settled) break;
  }
  if (best.found()) best.why.clear();
  return best;
}

}  // namespace

std::string path_redundancy_refusal(const MotionProblem& problem) {
  if (!std::holds_alternative<TipGoal>(problem.goal))
    return "the goal is a posture: a tip line does not say how to reach it";
  const auto directions = 3 - static_cast<int>(fixed_tip_directions(problem.machine).size());
  const int redundant = problem.machine.joint_count() - directions;
  if (redundant != 1) {
    return fmt::format(
        "{} joints move the tip in {} directions: {} redundant joints, this method needs exactly "
        "one",
        problem.machine.joint_count(), directions, std::max(0, redundant));
  }
  return {};
}

PathRedundancy best_redundancy_line(const CraneModel& model, const MotionProblem& problem,
                                    double duration, const Trajectory& line,
                                    const PathRedundancyOptions& options) {
  SPARFLOW_CHECK(duration > 0.0 && options.intervals >= 2 && options.speed_levels >= 1,
                 "a duration, intervals and a speed");
  PathRedundancy result;
  result.why = path_redundancy_refusal(problem);
  if (!result.why.empty()) return result;
  LineProgram program(model, problem, duration, line);
  std::vector<TipLaw> laws;
  laws.reserve(static_cast<std::size_t>(options.speed_levels) + 1);
  for (int i = 0; i < options.speed_levels; ++i) {
    TipLaw law;
    law.top_speed = options.speed_levels == 1 ? 1.25 : 1.12 + 0.88 * i / (options.speed_levels - 1);
    laws.push_back(std::move(law));
  }
  if (std::optional<TipLaw> known = program.known_law()) laws.push_back(std::move(*known));
  const double spacing = kFirstLineSpacing * duration / kFirstStages;
  std::vector<std::pair<double, std::size_t>> order;
  std::vector<LineFound> coarse(laws.size());
  order.reserve(laws.size());
  for (std::size_t i = 0; i < laws.size(); ++i) {
    coarse[i] = program.solve(laws[i], kFirstStages, spacing, {}, 0.0);
    if (coarse[i].control.rows() > 0) {
      order.emplace_back(coarse[i].sum, i);
    } else {
      result.why = fmt::format("within the limits the tip's line ends after {:.0f} % of the time",
                               100.0 * coarse[i].stage / (kFirstStages - 1));
    }
  }
  std::sort(order.begin(), order.end());
  for (const auto& [sum, i] : order) {
    // Refined are the best time law and the line's own, with which the result is compared.
    const bool own = laws[i].table.size() > 0;
    if (result.found() && !own) continue;
    PathRedundancy one = refined_line(model, program, laws[i], std::move(coarse[i]), options);
    if (!one.found()) {
      if (!result.found()) result.why = one.why;
      continue;
    }
    if (!result.found() || one.energy.total < result.energy.total) result = std::move(one);
  }
  // `line` itself is a candidate too, because the grids can miss it at the edge of a limit.
  if (line.size() > 2) {
    const double energy = exact_total_energy(model, line, problem.payload, options.refine);
    if (result.found() && result.energy.total <= energy) return result;
    const double excess = worst_excess(check_limits(model, problem, line, options.refine));
    if (excess > options.limit_tolerance) return result;
    result = {};
    result.motion = line;
    result.energy = exact_energy(model, problem, line, options.refine);
    result.excess = excess;
  }
  return result;
}

}  // namespace sparflow
