#include "problems/clearance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::Vector3d;

constexpr double kDefaultRadius = 0.1;  // [m] half a slender boom section
constexpr double kLeastStep = 2e-3;     // [m] see clear_share()
constexpr double kImmovable = 1e-9;     // [m]

std::size_t at(int i) { return static_cast<std::size_t>(i); }

double largest_travel(const Range& range) {
  return std::max(std::abs(range.lo), std::abs(range.hi));
}

}  // namespace

double capsule_radius(const MotionProblem& problem) {
  return problem.clearance > 0.0 ? problem.clearance : kDefaultRadius;
}

ClearanceModel::ClearanceModel(const MotionProblem& problem, const ClearanceOptions& options)
    : machine_(problem.machine),
      limits_(problem.limits.position),
      obstacles_(problem.obstacles),
      radius_(capsule_radius(problem)),
      chain_(problem.machine),
      columns_(problem.machine.joints.size()),
      between_(problem.machine.joint_count()) {
  SPARFLOW_CHECK(limits_.size() == machine_.joints.size(),
                 "there is one position range for each joint");
  SPARFLOW_CHECK(options.inflation > 0.0, "the inflation of the smooth rows must be positive");
  build_parts();
  build_rows(options.inflation);
}

const std::string& ClearanceModel::part_name(int part) const {
  return machine_.joints[at(parts_[at(part)].name)].name;
}

const std::string& ClearanceModel::obstacle_name(int obstacle) const {
  return obstacles_[at(obstacle)].name;
}

std::string ClearanceModel::describe(const Nearest& nearest) const {
  if (nearest.part < 0) return "no obstacle near";
  const std::string& part = part_name(nearest.part);
  const std::string& obstacle = obstacle_name(nearest.obstacle);
  const double gap = nearest.distance + radius_;
  if (nearest.distance >= 0.0) {
    return fmt::format("{} keeps {:.3f} m from {}", part, gap, obstacle);
  }
  if (gap >= 0.0) {
    return fmt::format("{} is {:.3f} m from {}, less than the clearance of {:.3f} m", part, gap,
                       obstacle, radius_);
  }
  return fmt::format("{} is {:.3f} m inside {}", part, -gap, obstacle);
}

Vector3d ClearanceModel::position(const Point& point, const double* q) const {
  Vector3d p = chain_.point(point.joint, point.local);
  if (point.slide >= 0) p += point.fraction * q[point.slide] * chain_.axis[at(point.slide)];
  return p;
}

bool ClearanceModel::moves(const Point& point) {
  // A point that no joint moves in three unrelated configurations lies on the axis of every joint before it.
  const int n = machine_.joint_count();
  Vector3d first = Vector3d::Zero();
  for (int trial = 0; trial < 3; ++trial) {
    for (int i = 0; i < n; ++i) {
      const double share = std::fmod(0.37 + 0.6180339887 * (i + 1) * (trial + 1), 1.0);
      between_[i] = limits_[at(i)].lo + share * (limits_[at(i)].hi - limits_[at(i)].lo);
    }
    chain_.update(machine_, between_.data());
    const Vector3d p = position(point, between_.data());
    if (trial == 0) first = p;
    if ((p - first).norm() > kImmovable) return true;
  }
  return false;
}

void ClearanceModel::build_parts() {
  const int n = machine_.joint_count();
  const auto add = [&](const Point& from, const Point& to, int name, double length) {
    if (length < kImmovable) return;
    Part part{from, to, name, length, moves(from), moves(to)};
    if (part.from_moves || part.to_moves) parts_.push_back(part);
  };
  for (int k = 0; k < n; ++k) {
    const Joint& joint = machine_.joints[at(k)];
    const Vector3d mount = joint.origin.translation();
    if (k > 0) add({k - 1, Vector3d::Zero()}, {k - 1, mount}, k - 1, mount.norm());
    if (joint.type == JointType::kPrismatic) {
      add({k - 1, mount, k, 0.0}, {k - 1, mount, k, 1.0}, k, largest_travel(limits_[at(k)]));
    }
  }
  if (machine_.tip.joint >= 0) {
    add({machine_.tip.joint, Vector3d::Zero()}, {machine_.tip.joint, machine_.tip.xyz},
        machine_.tip.joint, machine_.tip.xyz.norm());
  }
  const auto parts = static_cast<int>(parts_.size());
  travel_radius_.resize(parts, n);
  part_distance_.resize(parts);
  for (int p = 0; p < parts; ++p) {
    for (int k = 0; k < n; ++k) {  // the larger of both ends bounds all points of a part
      travel_radius_(p, k) =
          std::max(travel_radius(parts_[at(p)].from, k), travel_radius(parts_[at(p)].to, k));
    }
  }
}

double ClearanceModel::travel_radius(const Point& point, int k) const {
  if (k == point.slide) return point.fraction;
  if (k > point.joint) return 0.0;
  if (machine_.joints[at(k)].type == JointType::kPrismatic) return 1.0;
  double far =
      point.local.norm();  // largest distance from joint k to the point, summed over the links
  for (int j = k + 1; j <= point.joint; ++j) {
    far += machine_.joints[at(j)].origin.translation().norm();
    if (!chain_.revolute[at(j)]) far += largest_travel(limits_[at(j)]);
  }
  if (point.slide >= 0) far += point.fraction * largest_travel(limits_[at(point.slide)]);
  return far;
}

double ClearanceModel::reach(const Point& point) const {
  const Vector3d root = machine_.joints.front().origin.translation();
  double far = point.joint < 0 ? (point.local - root).norm() : point.local.norm();
  for (int k = 0; k <= point.joint; ++k) {
    const Joint& joint = machine_.joints[at(k)];
    if (k > 0) far += joint.origin.translation().norm();
    if (joint.type == JointType::kPrismatic) far += largest_travel(limits_[at(k)]);
  }
  if (point.slide >= 0) far += point.fraction * largest_travel(limits_[at(point.slide)]);
  return far;
}

double ClearanceModel::half_piece(const Part& part, const Obstacle& obstacle, double kept,
                                  double inflation) {
  const double widest = std::sqrt((kept + inflation) * (kept + inflation) - kept * kept);
  const auto* sphere = std::get_if<Sphere>(&obstacle.shape);
  double h = widest;
  const auto shorten = [&](const Point& end) {
    const double d =
        signed_distance(obstacle, position(end, between_.data())) + (sphere ? sphere->radius : 0.0);
    const double room = d > kept ? std::sqrt(d * d - kept * kept) : 0.0;
    if (room < widest / 8.0) cover_complete_ = false;
    h = std::min(h, std::max(room, widest / 8.0));
  };
  if (!part.from_moves) shorten(part.from);
  if (!part.to_moves) shorten(part.to);
  return h;
}

void ClearanceModel::build_rows(double inflation) {
  struct Sample {
    Point point;
    Vector3d position;
    double level;
    int part;
  };
  std::vector<Sample> samples;
  const double* q = between_.data();  // build_parts() left chain_ at this configuration
  for (int o = 0; o < static_cast<int>(obstacles_.size()); ++o) {
    const Obstacle& obstacle = obstacles_[at(o)];
    const bool half_space = std::holds_alternative<HalfSpace>(obstacle.shape);
    const auto* sphere = std::get_if<Sphere>(&obstacle.shape);
    const double core = sphere ? sphere->radius : 0.0;  // a sphere's bound refers to its centre
    samples.clear();
    for (int p = 0; p < static_cast<int>(parts_.size()); ++p) {
      const Part& part = parts_[at(p)];
      int pieces = 1;
      double level = radius_;  // for a half-space, whose linear distance is least at an end
      if (!half_space) {
        const double h = half_piece(part, obstacle, core + radius_, inflation);
        pieces = std::max(1, static_cast<int>(std::ceil(part.length / (2.0 * h))));
        level = std::hypot(core + radius_, 0.5 * part.length / pieces) - core;
      }
      for (int i = 0; i <= pieces; ++i) {
        if ((i == 0 && !part.from_moves) || (i == pieces && !part.to_moves)) continue;
        const double share = static_cast<double>(i) / pieces;
        Point point = part.from;
        point.local += share * (part.to.local - part.from.local);
        point.fraction += share * (part.to.fraction - part.from.fraction);
        const Vector3d here = position(point, q);
        if (i == 0 && !samples.empty() && (here - samples.back().position).norm() < kImmovable) {
          samples.back().level = std::max(samples.back().level, level);  // two parts meet here
        } else {
          samples.push_back({point, here, level, p});
        }
      }
    }
    const Vector3d root = machine_.joints.front().origin.translation();
    for (const Sample& s : samples) {
      if (signed_distance(obstacle, root) - reach(s.point) >= s.level) continue;
      rows_.push_back({s.point, SmoothObstacle(obstacle, s.level), s.part, o});
    }
  }
}

void ClearanceModel::use_planes(const Eigen::MatrixXd& postures, double within) {
  const std::size_t parts = parts_.size(), count = obstacles_.size();
  std::vector<char> near(parts * count, 0);
  Eigen::VectorXd q;
  for (Eigen::Index k = 0; k < postures.rows(); ++k) {
    q = postures.row(k);
    chain_.update(machine_, q.data());
    for (std::size_t i = 0; i < near.size(); ++i) {
      const Part& part = parts_[i / count];
      const double d = part_distance(part, obstacles_[i % count], position(part.from, q.data()),
                                     position(part.to, q.data()));
      if (d - radius_ < within) near[i] = 1;
    }
  }
  rows_.clear();
  planes_.clear();
  for (Eigen::Index k = 0; k < postures.rows(); ++k) {
    q = postures.row(k);
    chain_.update(machine_, q.data());
    for (std::size_t i = 0; i < near.size(); ++i) {
      if (near[i] == 0) continue;
      const Part& part = parts_[i / count];
      const Obstacle plane{"",
                           separating_plane(obstacles_[i % count], position(part.from, q.data()),
                                            position(part.to, q.data()))};
      const SmoothObstacle smooth(plane, radius_);
      for (const auto& [end, moves] :
           {std::pair{&part.from, part.from_moves}, std::pair{&part.to, part.to_moves}}) {
        if (!moves) continue;
        planes_.push_back(smooth);
        if (k == 0)
          rows_.push_back({*end, smooth, static_cast<int>(i / count), static_cast<int>(i % count)});
      }
    }
  }
  posture_ = 0;
}

/// Distance of a part from an obstacle. Where the part's immovable end lies inside the clearance of a half-space, only its
/// other end is checked: a column on the ground is no collision, because no motion changes the distance of its foot.
double ClearanceModel::part_distance(const Part& part, const Obstacle& obstacle,
                                     const Vector3d& from, const Vector3d& to) const {
  if (std::holds_alternative<HalfSpace>(obstacle.shape)) {
    if (!part.from_moves && signed_distance(obstacle, from) < radius_)
      return signed_distance(obstacle, to);
    if (!part.to_moves && signed_distance(obstacle, to) < radius_)
      return signed_distance(obstacle, from);
  }
  return segment_distance(obstacle, from, to);
}

Nearest ClearanceModel::nearest(const double* q) {
  Nearest best{std::numeric_limits<double>::infinity(), -1, -1};
  if (obstacles_.empty()) return best;
  chain_.update(machine_, q);
  for (int p = 0; p < static_cast<int>(parts_.size()); ++p) {
    const Vector3d from = position(parts_[at(p)].from, q);
    const Vector3d to = position(parts_[at(p)].to, q);
    part_distance_[p] = std::numeric_limits<double>::infinity();
    for (int o = 0; o < static_cast<int>(obstacles_.size()); ++o) {
      const double d = part_distance(parts_[at(p)], obstacles_[at(o)], from, to) - radius_;
      part_distance_[p] = std::min(part_distance_[p], d);
      if (d < best.distance) best = {d, p, o};
    }
  }
  return best;
}

double ClearanceModel::clear_share(const double* from, const double* to) {
  const int n = machine_.joint_count();
  double share = 0.0, tested = -1.0;
  for (;;) {
    for (int i = 0; i < n; ++i) between_[i] = from[i] + share * (to[i] - from[i]);
    if (nearest(between_.data()).distance < 0.0) return tested;
    tested = share;
    if (share >= 1.0 || obstacles_.empty()) return 1.0;
    double step = 1.0;
    for (int p = 0; p < static_cast<int>(parts_.size()); ++p) {
      double travel = 0.0;
      for (int i = 0; i < n; ++i) travel += travel_radius_(p, i) * std::abs(to[i] - from[i]);
      const double allowed = std::max(part_distance_[p], kLeastStep);
      if (travel * step > allowed) step = allowed / travel;
    }
    share = std::min(1.0, share + step);
  }
}

bool ClearanceModel::path_clear(const Eigen::MatrixXd& path) {
  for (Eigen::Index k = 0; k + 1 < path.rows(); ++k) {
    const Eigen::VectorXd from = path.row(k), to = path.row(k + 1);
    if (!motion_clear(from.data(), to.data())) return false;
  }
  return true;
}

Nearest ClearanceModel::nearest_on(const Trajectory& motion, int factor, double* when) {
  const Trajectory fine = motion.refined(factor);
  Nearest worst{std::numeric_limits<double>::infinity(), -1, -1};
  for (Eigen::Index k = 0; k < fine.size(); ++k) {
    const Eigen::VectorXd q = fine.q.row(k);
    const Nearest here = nearest(q.data());
    if (here.distance >= worst.distance) continue;
    worst = here;
    if (when) *when = fine.t[k];
  }
  return worst;
}

void ClearanceModel::values(const double* q, double* g) {
  chain_.update(machine_, q);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    g[r] = smooth(r).value(position(rows_[r].point, q));
  }
}

int ClearanceModel::update_columns(const Point& point, const Vector3d& p) {
  // The point moves with link `joint` and all joints before it; its slide joint moves it along that joint's axis.
  for (int k = 0; k <= point.joint; ++k) {
    columns_[at(k)] = point_jacobian(chain_, point.joint, p, k);
  }
  if (point.slide < 0) return point.joint + 1;
  columns_[at(point.slide)] = point.fraction * chain_.axis[at(point.slide)];
  return point.slide + 1;
}

void ClearanceModel::jacobian(const double* q, double* g, double* jacobian) {
  const std::size_t n = machine_.joints.size();
  chain_.update(machine_, q);
  Vector3d gradient;
  Eigen::Matrix3d hessian;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Vector3d p = position(rows_[r].point, q);
    g[r] = smooth(r).derivatives(p, &gradient, &hessian);
    const std::size_t moving = at(update_columns(rows_[r].point, p));
    for (std::size_t k = 0; k < n; ++k) {
      jacobian[r * n + k] = k < moving ? gradient.dot(columns_[k]) : 0.0;
    }
  }
}

void ClearanceModel::add_hessian(const double* q, const double* multiplier, double* hessian) {
  const int n = machine_.joint_count();
  chain_.update(machine_, q);
  Vector3d gradient;
  Eigen::Matrix3d curvature;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (multiplier[r] == 0.0) continue;
    const Vector3d p = position(rows_[r].point, q);
    smooth(r).derivatives(p, &gradient, &curvature);
    const int moving = update_columns(rows_[r].point, p);
    for (int k = 0; k < moving; ++k) {
      const Vector3d bent = curvature * columns_[at(k)];
      for (int i = 0; i <= k; ++i) {
        const double h = multiplier[r] * (bent.dot(columns_[at(i)]) +
                                          gradient.dot(point_hessian(chain_, i, columns_[at(k)])));
        hessian[i * n + k] += h;
        if (i != k) hessian[k * n + i] += h;
      }
    }
  }
}

std::string ClearanceModel::row_name(int row) const {
  const Row& r = rows_[at(row)];
  return fmt::format("clearance of {} from {}", part_name(r.part), obstacle_name(r.obstacle));
}

}  // namespace sparflow
