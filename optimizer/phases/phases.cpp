#include "optimizer/phases/phases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

bool moves(CylinderMode m) { return m == CylinderMode::kExtend || m == CylinderMode::kRetract; }

/// Appends phases to a plan and joins each with the one before where their modes are equal.
class PlanBuilder {
 public:
  explicit PlanBuilder(Index cylinders) : cylinders_(cylinders) {}
  void add(const Eigen::Matrix<CylinderMode, 1, Eigen::Dynamic>& row, double duration) {
    const bool waypoint = !waypoints_.empty() && waypoints_.back() + 1 == count();
    if (!rows_.empty() && !waypoint && (rows_.back().array() == row.array()).all()) {
      durations_.back() += duration;
      return;
    }
    rows_.push_back(row);
    durations_.push_back(duration);
  }
  /// Puts a waypoint at the end of the last phase. @return false when there is no phase yet
  bool pass_waypoint() {
    if (rows_.empty()) return false;
    waypoints_.push_back(count() - 1);
    return true;
  }
  PhasePlan plan() const {
    PhasePlan out;
    out.waypoint_after = waypoints_;
    out.modes.resize(static_cast<Index>(rows_.size()), cylinders_);
    for (std::size_t p = 0; p < rows_.size(); ++p) out.modes.row(static_cast<Index>(p)) = rows_[p];
    out.durations =
        Eigen::Map<const VectorXd>(durations_.data(), static_cast<Index>(durations_.size()));
    return out;
  }

  int count() const { return static_cast<int>(rows_.size()); }

 private:
  std::vector<int> waypoints_;
  Index cylinders_;
  std::vector<Eigen::Matrix<CylinderMode, 1, Eigen::Dynamic>> rows_;
  std::vector<double> durations_;
};

bool ends_at_waypoint(const PhasePlan& plan, Index phase) {
  return std::find(plan.waypoint_after.begin(), plan.waypoint_after.end(), phase) !=
         plan.waypoint_after.end();
}

void pass_waypoints(const PhasePlan& plan, Index phase, PlanBuilder& out) {
  for (const int after : plan.waypoint_after) {
    if (after == phase) out.pass_waypoint();
  }
}

/// Unites the moves of two phases. @return false where a cylinder would move in both directions
bool join(const ModeTable& modes, Index a, Index b,
          Eigen::Matrix<CylinderMode, 1, Eigen::Dynamic>& row) {
  row = modes.row(a);
  for (Index c = 0; c < modes.cols(); ++c) {
    const CylinderMode other = modes(b, c);
    if (moves(row[c]) && moves(other) && row[c] != other) return false;
    if (!moves(row[c])) row[c] = other;
  }
  return true;
}

/// Whether every move (cylinder and direction) of `wanted` occurs in `plan`.
bool covers(const PhasePlan& wanted, const PhasePlan& plan) {
  for (Index c = 0; c < wanted.modes.cols(); ++c) {
    for (const CylinderMode m : {CylinderMode::kExtend, CylinderMode::kRetract}) {
      const bool needs = (wanted.modes.col(c).array() == m).any();
      if (needs && !(plan.modes.col(c).array() == m).any()) return false;
    }
  }
  return true;
}

}  // namespace

PhasePlan plan_of(const ModeTable& modes, const VectorXd& times,
                  const std::vector<double>& waypoint_times) {
  SPARFLOW_CHECK(modes.rows() + 1 == times.size(), "modes and mesh must have the same intervals");
  PlanBuilder plan(modes.cols());
  std::size_t next = 0;
  for (Index k = 0; k < modes.rows(); ++k) {
    double from = times[k];
    while (next < waypoint_times.size() && waypoint_times[next] < times[k + 1]) {
      if (waypoint_times[next] > from) {
        plan.add(modes.row(k), waypoint_times[next] - from);
        from = waypoint_times[next];
      }
      SPARFLOW_CHECK(plan.pass_waypoint(), "a waypoint lies after the start");
      ++next;
    }
    plan.add(modes.row(k), times[k + 1] - from);
  }
  SPARFLOW_CHECK(next == waypoint_times.size(), "waypoints lie before the end");
  return plan.plan();
}

PhasePlan with_overlaps(const PhasePlan& plan, double share) {
  const Index phases = plan.modes.rows();
  VectorXd left = plan.durations;
  VectorXd overlap = VectorXd::Zero(std::max<Index>(phases - 1, 0));
  Eigen::Matrix<CylinderMode, 1, Eigen::Dynamic> row;
  for (Index p = 0; p + 1 < phases; ++p) {
    if (ends_at_waypoint(plan, p) || !join(plan.modes, p, p + 1, row)) continue;
    const bool new_one = (row.array() != plan.modes.row(p).array()).any() &&
                         (row.array() != plan.modes.row(p + 1).array()).any();
    if (!new_one) continue;
    overlap[p] = share * std::min(plan.durations[p], plan.durations[p + 1]);
    left[p] -= 0.5 * overlap[p];
    left[p + 1] -= 0.5 * overlap[p];
  }
  PlanBuilder out(plan.modes.cols());
  for (Index p = 0; p < phases; ++p) {
    out.add(plan.modes.row(p), left[p]);
    pass_waypoints(plan, p, out);
    if (p + 1 < phases && overlap[p] > 0.0) {
      join(plan.modes, p, p + 1, row);
      out.add(row, overlap[p]);
    }
  }
  return out.plan();
}

PhasePlan with_moving_ends(const PhasePlan& plan, const std::vector<CylinderMode>& first,
                           const std::vector<CylinderMode>& last, double shortest) {
  const auto row_of = [](const std::vector<CylinderMode>& modes) {
    return Eigen::Map<const Eigen::Matrix<CylinderMode, 1, Eigen::Dynamic>>(
               modes.data(), static_cast<Index>(modes.size()))
        .eval();
  };
  const auto lacks = [&](Index phase, const std::vector<CylinderMode>& asked) {
    for (std::size_t c = 0; c < asked.size(); ++c) {
      if (moves(asked[c]) && plan.modes(phase, static_cast<Index>(c)) != asked[c]) return true;
    }
    return false;
  };
  const Index phases = plan.modes.rows();
  PlanBuilder out(plan.modes.cols());
  if (lacks(0, first)) out.add(row_of(first), shortest);
  for (Index p = 0; p < phases; ++p) {
    out.add(plan.modes.row(p), plan.durations[p]);
    pass_waypoints(plan, p, out);
  }
  if (lacks(phases - 1, last)) out.add(row_of(last), shortest);
  PhasePlan wider = out.plan();
  wider.durations *= plan.total() / wider.total();
  return wider;
}

PhasePlan without_short(const PhasePlan& plan, double shortest) {
  PlanBuilder out(plan.modes.cols());
  double owed = 0.0;
  for (Index p = 0; p < plan.modes.rows(); ++p) {
    if (plan.durations[p] < shortest) {
      // A phase that ends at a waypoint is removed only if an earlier phase can end there instead.
      if (!ends_at_waypoint(plan, p) || out.count() > 0) {
        owed += plan.durations[p];
        pass_waypoints(plan, p, out);
        continue;
      }
    }
    out.add(plan.modes.row(p), plan.durations[p]);
    pass_waypoints(plan, p, out);
  }
  PhasePlan kept = out.plan();
  if (kept.count() == 0) return plan;
  kept.durations *= 1.0 + owed / kept.total();
  return kept;
}

std::vector<PhasePlan> neighbours(const PhasePlan& plan) {
  std::vector<PhasePlan> found;
  if (!plan.waypoint_after.empty()) return found;
  const Index phases = plan.modes.rows(), cylinders = plan.modes.cols();
  const auto keep = [&](const PhasePlan& candidate) {
    if (candidate.count() == 0 || !covers(plan, candidate)) return;
    const auto same = [&](const PhasePlan& other) {
      return other.count() == candidate.count() &&
             (other.modes.array() == candidate.modes.array()).all();
    };
    if (same(plan) || std::any_of(found.begin(), found.end(), same)) return;
    found.push_back(candidate);
  };
  const auto build = [&](const ModeTable& modes, const VectorXd& durations) {
    PlanBuilder out(cylinders);
    for (Index p = 0; p < modes.rows(); ++p) {
      const bool idle = std::none_of(modes.row(p).begin(), modes.row(p).end(), moves);
      if (!idle || modes.rows() == 1) out.add(modes.row(p), durations[p]);
    }
    PhasePlan candidate = out.plan();
    if (candidate.count() > 0) candidate.durations *= plan.total() / candidate.total();
    keep(candidate);
  };
  for (Index p = 0; p < phases; ++p) {  // one phase left out
    PlanBuilder out(cylinders);
    for (Index o = 0; o < phases; ++o) {
      if (o != p) out.add(plan.modes.row(o), plan.durations[o]);
    }
    PhasePlan candidate = out.plan();
    if (candidate.count() > 0) candidate.durations *= plan.total() / candidate.total();
    keep(candidate);
  }
  for (Index p = 0; p + 1 < phases; ++p) {  // two phases exchanged, or merged
    ModeTable modes = plan.modes;
    VectorXd durations = plan.durations;
    modes.row(p).swap(modes.row(p + 1));
    std::swap(durations[p], durations[p + 1]);
    build(modes, durations);
    Eigen::Matrix<CylinderMode, 1, Eigen::Dynamic> row;
    if (!join(plan.modes, p, p + 1, row)) continue;
    modes = plan.modes;
    modes.row(p) = modes.row(p + 1) = row;
    build(modes, plan.durations);
  }
  for (Index c = 0; c < cylinders; ++c) {  // a cylinder starts or stops a phase earlier or later
    for (Index p = 0; p < phases; ++p) {
      for (const Index from : {p - 1, p + 1}) {
        if (from < 0 || from >= phases) continue;
        const CylinderMode here = plan.modes(p, c), there = plan.modes(from, c);
        if (here == there || here == CylinderMode::kFree || there == CylinderMode::kFree) continue;
        ModeTable modes = plan.modes;
        modes(p, c) = there;
        build(modes, plan.durations);
      }
    }
  }
  // The longest phase in which several cylinders move is halved, with one of them at rest in either half.
  Index longest = -1;
  for (Index p = 0; p < phases; ++p) {
    const bool several =
        std::count_if(plan.modes.row(p).begin(), plan.modes.row(p).end(), moves) > 1;
    if (several && (longest < 0 || plan.durations[p] > plan.durations[longest])) longest = p;
  }
  if (longest < 0) return found;
  ModeTable halves(phases + 1, cylinders);
  halves << plan.modes.topRows(longest + 1), plan.modes.bottomRows(phases - longest);
  VectorXd times(phases + 1);
  times << plan.durations.head(longest + 1), plan.durations.tail(phases - longest);
  times.segment(longest, 2) *= 0.5;
  for (Index c = 0; c < cylinders; ++c) {
    if (!moves(plan.modes(longest, c))) continue;
    for (const Index half : {longest, longest + 1}) {
      ModeTable modes = halves;
      modes(half, c) = CylinderMode::kRest;
      build(modes, times);
    }
  }
  return found;
}

std::string plan_text(const Machine& machine, const PhasePlan& plan) {
  std::string text;
  for (Index p = 0; p < plan.modes.rows(); ++p) {
    if (p > 0) text += " | ";
    bool first = true;
    for (Index c = 0; c < plan.modes.cols(); ++c) {
      const CylinderMode m = plan.modes(p, c);
      if (m == CylinderMode::kRest) continue;
      text += (first ? "" : ", ") + machine.cylinders[static_cast<std::size_t>(c)].name;
      if (moves(m)) text += m == CylinderMode::kExtend ? " +" : " -";
      first = false;
    }
    if (first) text += "rest";
  }
  return text;
}

PhaseMesh mesh_of(const PhasePlan& plan, int intervals, int least) {
  PhaseMesh mesh;
  std::vector<double> times = {0.0};
  std::vector<Index> phase;
  double begin = 0.0;
  for (Index p = 0; p < plan.modes.rows(); ++p) {
    const double share = plan.durations[p] / plan.total();
    const int count = std::max(least, static_cast<int>(std::lround(share * intervals)));
    for (int k = 1; k <= count; ++k) {
      times.push_back(begin + plan.durations[p] * k / count);
      phase.push_back(p);
    }
    begin += plan.durations[p];
    for (const int after : plan.waypoint_after) {
      if (after == p) mesh.waypoint_knots.push_back(static_cast<int>(phase.size()));
    }
  }
  mesh.times = Eigen::Map<const VectorXd>(times.data(), static_cast<Index>(times.size()));
  mesh.modes.resize(static_cast<Index>(phase.size()), plan.modes.cols());
  for (std::size_t k = 0; k < phase.size(); ++k) {
    mesh.modes.row(static_cast<Index>(k)) = plan.modes.row(phase[k]);
    mesh.of_interval.push_back(static_cast<int>(phase[k]));
  }
  return mesh;
}

VectorXd durations_of(const PhaseMesh& mesh, const VectorXd& times) {
  SPARFLOW_CHECK(times.size() == mesh.times.size(), "motion and phases must have the same mesh");
  VectorXd durations = VectorXd::Zero(mesh.of_interval.back() + 1);
  for (std::size_t k = 0; k < mesh.of_interval.size(); ++k) {
    const auto i = static_cast<Index>(k);
    durations[mesh.of_interval[k]] += times[i + 1] - times[i];
  }
  return durations;
}

Trajectory with_durations(const Trajectory& motion, const VectorXd& from, const VectorXd& to) {
  SPARFLOW_CHECK(from.size() == to.size(), "both lists of durations must have the same length");
  Trajectory out = motion;
  for (Index k = 0; k < motion.size(); ++k) {
    const double t = motion.t[k] - motion.t[0];
    double before = 0.0, after = 0.0;
    Index p = 0;
    while (p + 1 < from.size() && t > before + from[p] + 1e-12) {
      before += from[p];
      after += to[p];
      ++p;
    }
    const double ratio = to[p] / from[p];
    out.t[k] = motion.t[0] + after + (t - before) * ratio;
    out.qd.row(k) /= ratio;
  }
  for (double& stop : out.stops) {
    const Index k = std::lower_bound(motion.t.begin(), motion.t.end(), stop) - motion.t.begin();
    stop = out.t[std::min(k, motion.size() - 1)];
  }
  for (Index k = 0; k + 1 < out.size(); ++k)
    out.qdd.row(k) = (out.qd.row(k + 1) - out.qd.row(k)) / (out.t[k + 1] - out.t[k]);
  if (out.size() > 1) out.qdd.row(out.size() - 1) = out.qdd.row(out.size() - 2);
  return out;
}

}  // namespace sparflow
