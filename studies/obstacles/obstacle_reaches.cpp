#include "studies/obstacles/obstacle_reaches.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <random>

#include "bench/planned_seeds.h"
#include "models/machine/kinematics.h"
#include "optimizer/solve/child_processes.h"
#include "optimizer/solve/grid_seeds.h"
#include "problems/bundled.h"
#include "problems/clearance.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

namespace sparflow::bench {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr const char* kKinds[] = {"window", "wall", "shelf", "box at the tip"};

/// Draws obstacles and postures of one reach.
class Drawer {
 public:
  Drawer(MotionProblem& problem, std::uint64_t seed) : p_(problem), random_(seed) {}

  double between(double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random_);
  }

  VectorXd posture() {
    VectorXd q(p_.machine.joint_count());
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const Range& r = p_.limits.position[static_cast<std::size_t>(j)];
      q[j] = between(r.lo + 0.05 * (r.hi - r.lo), r.hi - 0.05 * (r.hi - r.lo));
    }
    return q;
  }

  void add(const std::string& name, const Vector3d& center, const Vector3d& size) {
    Box box;
    box.center = center;
    box.size = size;
    p_.obstacles.push_back({name, box});
  }

  /// A wall with a square hole around a point of the last link in the end posture.
  void window(const VectorXd& end) {
    ChainGeometry chain(p_.machine);
    chain.update(p_.machine, end.data());
    const Vector3d tip = chain.point(p_.machine.tip.joint, p_.machine.tip.xyz);
    int last = p_.machine.tip.joint;
    while (last > 0 &&
           p_.machine.joints[static_cast<std::size_t>(last)].type == JointType::kPrismatic)
      --last;
    const Vector3d elbow = chain.point(last, Vector3d::Zero());
    const Vector3d at = elbow + between(0.3, 0.8) * (tip - elbow);
    const Vector3d way = tip - elbow;
    const bool along_x = std::abs(way.x()) >= std::abs(way.y());
    const double hole = between(0.6, 1.2), far = 8.0, thick = 0.2;
    const auto part = [&](const std::string& name, double across, double up, double width,
                          double height) {
      const Vector3d center = at + (along_x ? Vector3d(0, across, up) : Vector3d(across, 0, up));
      add(name, center, along_x ? Vector3d(thick, width, height) : Vector3d(width, thick, height));
    };
    const double beside = 0.5 * (hole + far);
    part("left", -beside, 0.0, far, 2.0 * far);
    part("right", beside, 0.0, far, 2.0 * far);
    part("below", 0.0, -beside, hole + 0.02, far);
    part("above", 0.0, beside, hole + 0.02, far);
  }

  void wall(const Vector3d& from, const Vector3d& to) {
    const Vector3d middle = from + between(0.3, 0.7) * (to - from);
    const double top = std::min(from.z(), to.z()) + between(-0.5, 0.8), foot = -2.0;
    add("wall", {middle.x(), middle.y(), 0.5 * (top + foot)},
        {0.25, 3.0, std::max(0.3, top - foot)});
  }

  void shelf(const Vector3d& tip) {
    const double gap = between(0.25, 0.7) * (between(0.0, 1.0) < 0.5 ? -1.0 : 1.0);
    add("shelf", tip + Vector3d(between(-0.3, 0.3), 0.0, gap), {1.6, 1.6, 0.1});
  }

  void box_at_tip(const Vector3d& tip) {
    const double edge = 0.6, gap = between(0.12, 0.35);
    const Vector3d sides[] = {{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}};
    const auto side = static_cast<std::size_t>(between(0.0, 3.999));
    add("box", tip + (gap + 0.5 * edge) * sides[side], Vector3d::Constant(edge));
  }

 private:
  MotionProblem& p_;
  std::mt19937_64 random_;
};

ReachTask obstacle_task(const MotionProblem& base, const CraneModel& model, std::uint64_t seed) {
  ReachTask task;
  task.model = &model;
  MotionProblem& p = task.problem;
  p = base;
  p.file.clear();
  p.tip_line.reset();
  p.idle_power = 0.0;
  p.clearance = 0.1;
  const std::size_t kind = seed % 4;
  p.name = fmt::format("{} {} {}", base.machine.name, kKinds[kind], seed);
  Drawer draw(p, seed);
  VectorXd end;
  for (bool clear = false; !clear;) {
    p.obstacles.clear();
    p.start = draw.posture();
    end = draw.posture();
    const Vector3d from = tip_position<double>(p.machine, p.start);
    const Vector3d tip = tip_position<double>(p.machine, end);
    p.goal = TipGoal{tip};
    if (kind == 0) draw.window(end);
    if (kind == 1) draw.wall(from, tip);
    if (kind == 2) draw.shelf(tip);
    if (kind == 3) draw.box_at_tip(tip);
    // Both ends keep two centimetres more than asked for, so that neither is lost by rounding.
    constexpr double kRoom = 0.02;
    ClearanceModel clearance(p);
    clear = clearance.nearest(p.start.data()).distance > kRoom &&
            clearance.nearest(end.data()).distance > kRoom;
  }
  p.payload = std::floor(draw.between(0.0, 300.0));
  Eigen::MatrixXd line(2, end.size());
  line << p.start.transpose(), end.transpose();
  MotionProblem open = p;
  open.obstacles.clear();
  const double reach = time_parametrise(open, line, 0.0).shortest;
  const double duration = std::max(4.0, reach * draw.between(1.5, 4.0));
  p.duration = {duration, duration};
  return task;
}

double processor_seconds() {
  timespec own{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &own);
  return static_cast<double>(own.tv_sec) + 1e-9 * static_cast<double>(own.tv_nsec);
}

}  // namespace

std::vector<ReachTask> obstacle_tasks(int count, std::uint64_t seed, ModelCache& models) {
  std::vector<ReachTask> tasks;
  tasks.reserve(static_cast<std::size_t>(count));
  constexpr const char* kReaches[] = {"loader_crane_fold", "hmf_lift", "swing_crane_far"};
  for (int i = 0; i < count; ++i) {
    const std::uint64_t own = seed + static_cast<std::uint64_t>(i);
    // Four kinds in turn on one machine, then on the next.
    const std::string file =
        bundled_file(std::string("reaches/") + kReaches[own / 4 % 3] + ".yaml");
    const MotionProblem problem = load_problem_with(
        file, [&](const std::string& named) { return &models.at(named).machine; });
    tasks.push_back(obstacle_task(problem, models.at(problem.model_path), own));
    tasks.back().mark = models.mark_of(problem.model_path);
  }
  return tasks;
}

double point_clearance(const MotionProblem& problem, const Trajectory& motion, int instants) {
  double least = std::numeric_limits<double>::infinity();
  const std::vector<Joint>& joints = problem.machine.joints;
  std::vector<Vector3d> points;
  const Trajectory fine =
      resampled(motion, VectorXd::LinSpaced(instants, motion.t[0], motion.t[motion.size() - 1]));
  for (Eigen::Index k = 0; k < fine.size(); ++k) {
    // The chain, joint by joint: the axes of the arm are the lines from one joint to the next, and to the tip.
    Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
    points.clear();
    for (std::size_t j = 0; j < joints.size(); ++j) {
      frame = frame * joints[j].origin;
      const double q = fine.q(k, static_cast<Eigen::Index>(j));
      const Vector3d mount = frame.translation();
      if (joints[j].type == JointType::kPrismatic) {
        frame.translate(joints[j].axis.normalized() * q);
      } else {
        frame.rotate(Eigen::AngleAxisd(q, joints[j].axis.normalized()));
      }
      points.push_back(mount);
      if (joints[j].type == JointType::kPrismatic) points.push_back(frame.translation());
      if (static_cast<int>(j) == problem.machine.tip.joint)
        points.push_back(frame * problem.machine.tip.xyz);
    }
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const int parts = 1 + static_cast<int>((points[i + 1] - points[i]).norm() / 0.01);
      for (int s = 0; s <= parts; ++s) {
        const Vector3d x = points[i] + (points[i + 1] - points[i]) * s / parts;
        for (const Obstacle& o : problem.obstacles) {
          const Box& box = std::get<Box>(o.shape);
          const Vector3d y = box.rotation.transpose() * (x - box.center), half = 0.5 * box.size;
          const Vector3d out = (y.cwiseAbs() - half).cwiseMax(0.0);
          const double depth = (y.cwiseAbs() - half).maxCoeff();
          least = std::min(least, depth < 0.0 ? depth : out.norm());
        }
      }
    }
  }
  return least - problem.clearance;
}

ObstacleFigures solve_beside_obstacles(const ReachTask& task, int paths, bool compare_planner) {
  const double begin = processor_seconds();
  ObstacleFigures f;
  const MotionProblem& problem = task.problem;
  OptimizeOptions options;
  options.processes = 1;
  SeedResult planned;
  const std::vector<SeedMotion> seeds =
      planned_seeds(problem, paths, options.intervals, 1, &planned);
  f.planned = planned.status == SeedStatus::kFound;
  const double time = problem.duration.max;
  const auto fast_enough = [&](const std::vector<SeedMotion>& motions) {
    return std::any_of(motions.begin(), motions.end(), [&](const SeedMotion& s) {
      return s.shortest_duration > 0.0 && s.shortest_duration <= time;
    });
  };
  OptimizeResult r;
  if (!seeds.empty() || may_have_a_path(problem, planned.status))
    r = optimize(*task.model, problem, seeds, options);
  f.seconds = processor_seconds() - begin;
  f.status = to_string(r.status);
  f.message = r.message.empty() ? planned.message : r.message;
  f.in_time = r.motion.size() > 1 || fast_enough(seeds) ||
              fast_enough(grid_seeds(*task.model, problem, options.grid_nodes).motions);
  f.compared = compare_planner;
  if (compare_planner) {
    const OptimizeResult other = optimize(*task.model, problem, {}, options);
    if (other.motion.size() > 1) f.without_planner = other.energy.total;
  }
  if (r.motion.size() < 2) return f;
  f.start = r.starts[static_cast<std::size_t>(r.best_start)].seed;
  f.energy = r.energy.total;
  f.mesh_error = r.mesh_error;
  f.knots = static_cast<int>(r.motion.size());
  constexpr int kInstants = 4001;
  f.clearance = point_clearance(problem, r.motion, kInstants);
  return f;
}

std::string pack_obstacle_figures(const ObstacleFigures& f) {
  return Packer()
      .text(f.status)
      .text(f.message)
      .text(f.start)
      .number(f.planned)
      .number(f.in_time)
      .number(f.energy)
      .number(f.without_planner)
      .number(f.mesh_error)
      .number(f.knots)
      .number(f.clearance)
      .number(f.seconds)
      .number(f.compared)
      .bytes();
}

ObstacleFigures unpack_obstacle_figures(const std::string& bytes) {
  Unpacker u(bytes);
  ObstacleFigures f;
  f.status = u.text();
  f.message = u.text();
  f.start = u.text();
  f.planned = u.number() != 0.0;
  f.in_time = u.number() != 0.0;
  f.energy = u.number();
  f.without_planner = u.number();
  f.mesh_error = u.number();
  f.knots = static_cast<int>(u.number());
  f.clearance = u.number();
  f.seconds = u.number();
  f.compared = u.number() != 0.0;
  return f;
}

void print_obstacle_reach(const ReachTask& task, const ObstacleFigures& f) {
  if (!f.solved()) {
    fmt::print("{:40} {}{}: {}\n", task.problem.name, f.crashed ? "CRASHED " : "",
               f.in_time ? "UNSOLVED" : f.status, f.message);
    return;
  }
  fmt::print(
      "{:40} {:9} {:9.3f} kJ  mesh error {:.1e}, {} knots  clearance {:+.4f} m  {:.1f} s  {}",
      task.problem.name, f.status, f.energy / 1e3, f.mesh_error, f.knots, f.clearance, f.seconds,
      f.start);
  if (f.without_planner > 0.0)
    fmt::print("  grid alone {:+.2f} %", 100.0 * (f.without_planner / f.energy - 1.0));
  fmt::print("\n");
}

namespace {

/// What the planner's paths are worth beside those of the joint grid, where both were tried.
void print_worth_of_planner(const std::vector<ObstacleFigures>& figures) {
  // [-] energies that differ by less count as equal: ten times the mesh error
  constexpr double kEqual = 1e-3;
  int compared = 0, only_planner = 0, cheaper = 0, equal = 0, dearer = 0;
  for (const ObstacleFigures& f : figures) {
    if (!f.compared || !f.solved()) continue;
    ++compared;
    if (f.without_planner <= 0.0) {
      ++only_planner;
      continue;
    }
    const double saved = 1.0 - f.energy / f.without_planner;
    ++(saved > kEqual ? cheaper : saved < -kEqual ? dearer : equal);
  }
  if (compared == 0) return;
  fmt::print(
      "with the planner's paths against paths of the grid alone, {} solved reaches: only with the "
      "planner {}, cheaper {}, equal to 0.1 % {}, dearer {}\n",
      compared, only_planner, cheaper, equal, dearer);
}

}  // namespace

void print_obstacle_summary(const std::vector<ReachTask>& tasks,
                            const std::vector<ObstacleFigures>& figures) {
  struct Count {
    int all = 0, crashed = 0, in_time = 0, solved = 0, converged = 0, no_path = 0, grid_only = 0;
    std::vector<double> seconds;
  };
  std::map<std::string, Count> by_kind;
  double least = std::numeric_limits<double>::infinity();
  int closer = 0;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const ObstacleFigures& f = figures[i];
    std::string kind = tasks[i].problem.name;
    kind.resize(kind.rfind(' '));
    for (Count* c : {&by_kind[kind], &by_kind["all"]}) {
      ++c->all;
      c->crashed += f.crashed;
      c->in_time += f.in_time;
      c->solved += f.solved();
      c->converged += f.status == "optimal";
      c->no_path += !f.planned;
      c->grid_only += !f.planned && f.solved();
      if (f.solved()) c->seconds.push_back(f.seconds);
    }
    if (!f.solved()) continue;
    least = std::min(least, f.clearance);
    // The checks of a motion count a millimetre as rounding of the conservative steps between postures.
    constexpr double kRounding = 1e-3;
    closer += f.clearance < -kRounding;
  }
  fmt::print("\n{:34} {:>5} {:>8} {:>8} {:>7} {:>10} {:>16} {:>18} {:>13}\n", "", "all", "crashed",
             "feasible", "solved", "converged", "no planner path", "of these solved",
             "median CPU s");
  for (auto& [kind, c] : by_kind) {
    std::sort(c.seconds.begin(), c.seconds.end());
    fmt::print("{:34} {:>5} {:>8} {:>8} {:>7} {:>10} {:>16} {:>18} {:>13.1f}\n", kind, c.all,
               c.crashed, c.in_time, c.solved, c.converged, c.no_path, c.grid_only,
               c.seconds.empty() ? 0.0 : c.seconds[c.seconds.size() / 2]);
  }
  print_worth_of_planner(figures);
  fmt::print(
      "least clearance beyond the one required, by points 1 cm apart: {:+.4f} m; {} closer\n",
      least, closer);
}

}  // namespace sparflow::bench
