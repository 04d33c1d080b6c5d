#include "optimizer/sway/sway_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace sparflow {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/// Steps of the integration in an interval.
/// @threshold [1] 1..64; chosen: these courses only begin a solve and tell the rope's tension
constexpr int kCourseParts = 4;

/// Angle of the rope beyond which a motion is a rough guess (one that starts and stops at once), whose load tells nothing.
/// @threshold [rad] 0.1..1; chosen: above every limit that is asked for, and where sin and tan differ by an eighth
constexpr double kWild = 0.5;

}  // namespace

Eigen::Matrix3Xd sway_directions(const Machine& machine) {
  const Vector3d down = machine.gravity.normalized();
  const Eigen::Matrix3Xd moving = moving_tip_directions(machine);
  Eigen::Matrix3Xd out(3, 0);
  // Of every candidate the horizontal part that is new; the axes come first, so that a spatial machine has x and y.
  for (int axis = 0; axis < 3; ++axis) {
    Vector3d d = moving * (moving.transpose() * Vector3d::Unit(axis));
    d -= down * down.dot(d);
    for (Eigen::Index k = 0; k < out.cols(); ++k) d -= out.col(k) * out.col(k).dot(d);
    /// Length of a unit vector's remainder up to which it is no direction of its own.
    /// @threshold [1] 1e-12..0.1; numerical: rounding of the machine's axes
    constexpr double kDependent = 1e-6;
    if (d.norm() <= kDependent) continue;
    out.conservativeResize(3, out.cols() + 1);
    out.col(out.cols() - 1) = d.normalized();
  }
  return out;
}

Trajectory with_load(const Machine& machine, const Trajectory& motion, const SwayLimit& sway) {
  const double cable = sway.cable;
  const Eigen::Matrix3Xd directions = sway_directions(machine);
  const Eigen::Index n = motion.q.cols(), m = directions.cols(), last = motion.size() - 1;
  const RopeCourse course = rope_course(machine, motion, cable, kCourseParts);
  Trajectory out = motion;
  for (MatrixXd* v : {&out.q, &out.qd, &out.qdd}) v->conservativeResize(Eigen::NoChange, n + m);
  for (Eigen::Index k = 0; k <= last; ++k) {
    const VectorXd q = motion.q.row(k), qd = motion.qd.row(k);
    const RopeState& s = course.knots[static_cast<std::size_t>(k)];
    const Vector3d speed =
        point_jacobian_matrix(machine, q, machine.tip.joint, machine.tip.xyz) * qd;
    // A guess that swings too far is shown as one whose load stays within the limit, against its dynamics: a solve mends the
    // dynamics, which are linear in the load, more easily than rows that are violated many times.
    const VectorXd rope = directions.transpose() * s.rope;
    const double allowed = cable * std::sin(sway.limit);
    const double share =
        course.largest_angle > kWild ? 0.0 : std::min(1.0, allowed / std::max(rope.norm(), 1e-12));
    out.q.row(k).tail(m) = directions.transpose() * tip_position<double>(machine, q) + share * rope;
    out.qd.row(k).tail(m) = directions.transpose() * (speed + share * s.rate);
  }
  for (Eigen::Index k = 0; k < last; ++k)
    out.qdd.row(k).tail(m) =
        (out.qd.row(k + 1) - out.qd.row(k)).tail(m) / (out.t[k + 1] - out.t[k]);
  out.qdd.row(last).tail(m) = out.qdd.row(std::max<Eigen::Index>(last - 1, 0)).tail(m);
  return out;
}

VectorXd load_stiffness(const Machine& machine, const Trajectory& motion, double cable) {
  /// Factor on g / l within which lambda is taken, and its inverse.
  /// @threshold [1] 1..10; chosen: a rough guess may swing so far that its rope is slack, which no motion within limits is
  constexpr double kMost = 2.0;
  const double still = machine.gravity.norm() / cable;
  const RopeCourse course = rope_course(machine, motion, cable, kCourseParts);
  if (course.largest_angle > kWild) return VectorXd::Constant(motion.size() - 1, still);
  return course.stiffness.cwiseMax(still / kMost).cwiseMin(kMost * still);
}

Trajectory without_load(const Trajectory& motion, int joints) {
  Trajectory out = motion;
  for (MatrixXd* v : {&out.q, &out.qd, &out.qdd}) v->conservativeResize(Eigen::NoChange, joints);
  return out;
}

TipCoordinates::TipCoordinates(const Machine& machine)
    : machine_(&machine),
      chain_(machine),
      directions_(sway_directions(machine)),
      jacobian_(Eigen::Matrix3Xd::Zero(3, machine.joint_count())) {}

void TipCoordinates::update(const double* q) {
  chain_.update(*machine_, q);
  point_ = chain_.point(machine_->tip.joint, machine_->tip.xyz);
  for (int k = 0; k < machine_->joint_count(); ++k)
    jacobian_.col(k) = point_jacobian(chain_, machine_->tip.joint, point_, k);
}

double TipCoordinates::curvature(const double* weight, int i, int k) const {
  if (k > machine_->tip.joint) return 0.0;
  Vector3d along = Vector3d::Zero();
  for (int d = 0; d < count(); ++d) along += weight[d] * directions_.col(d);
  return along.dot(point_hessian(chain_, i, jacobian_.col(k)));
}

SwayDynamics::SwayDynamics(const Machine& machine, VectorXd stiffness)
    : tip_(machine), joints_(machine.joint_count()), stiffness_(std::move(stiffness)) {}

void SwayDynamics::value(int interval, const Ends& at, double* g) {
  const double half = 0.5 * stiffness_[interval];
  for (int d = 0; d < count(); ++d) g[d] = at.qdd[joints_ + d];
  for (const double* q : {at.q0, at.q1}) {
    tip_.update(q);
    for (int d = 0; d < count(); ++d) g[d] -= half * (tip_.value(d) - q[joints_ + d]);
  }
}

void SwayDynamics::jacobian(int interval, const Ends& at, double* jacobian) {
  const double half = 0.5 * stiffness_[interval];
  const int n = joints_ + count();
  std::fill(jacobian, jacobian + 3 * n * count(), 0.0);
  int side = 0;
  for (const double* q : {at.q0, at.q1}) {
    tip_.update(q);
    for (int d = 0; d < count(); ++d) {
      double* row = jacobian + 3 * n * d + n * side;
      for (int j = 0; j < joints_; ++j) row[j] = -half * tip_.slope(d, j);
      row[joints_ + d] = half;
    }
    ++side;
  }
  for (int d = 0; d < count(); ++d) jacobian[3 * n * d + 2 * n + joints_ + d] = 1.0;
}

void SwayDynamics::add_hessian(int interval, const Ends& at, const double* multiplier,
                               double* hessian0, double* hessian1) {
  const double half = 0.5 * stiffness_[interval];
  const int n = joints_ + count();
  const auto add = [&](const double* q, double* hessian) {
    tip_.update(q);
    for (int k = 0; k < joints_; ++k) {
      for (int i = 0; i <= k; ++i) {
        const double value = -half * tip_.curvature(multiplier, i, k);
        hessian[k * n + i] += value;
        if (i != k) hessian[i * n + k] += value;
      }
    }
  };
  add(at.q0, hessian0);
  add(at.q1, hessian1);
}

void PostureBesideLoad::jacobian(const double* q, double* jacobian) {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> own(count(), n_);
  inner_->jacobian(q, own.data());
  for (int r = 0; r < count(); ++r) {
    for (int k = 0; k < n_ + m_; ++k) jacobian[r * (n_ + m_) + k] = k < n_ ? own(r, k) : 0.0;
  }
}

void PostureBesideLoad::add_hessian(const double* q, const double* multiplier, double* hessian) {
  MatrixXd own = MatrixXd::Zero(n_, n_);
  inner_->add_hessian(q, multiplier, own.data());
  for (int c = 0; c < n_; ++c) {
    for (int r = 0; r < n_; ++r) hessian[c * (n_ + m_) + r] += own(r, c);
  }
}

SwayKnotModel::SwayKnotModel(const Machine& machine, std::shared_ptr<KnotModel> inner,
                             SwayRows rows)
    : inner_(std::move(inner)),
      rows_(std::move(rows)),
      tip_(machine),
      n_(inner_->joint_count()),
      m_(tip_.count()) {
  /// Sides of the polygon that stands for the circle of the angles allowed, where the load swings in two directions: half of them.
  /// @threshold [1] 2..32; chosen: a polygon of 16 sides within the circle is 2 % narrower at its middle
  constexpr int kHalfSides = 8;
  facets_ = MatrixXd::Ones(m_, m_ == 1 ? 1 : kHalfSides);
  for (int f = 0; f < facets() && m_ > 1; ++f) {
    const double angle = std::numbers::pi * f / kHalfSides;
    facets_.col(f) << std::cos(angle), std::sin(angle);
  }
  apothem_ = m_ == 1 ? 1.0 : std::cos(0.5 * std::numbers::pi / kHalfSides);
  facets_ /= rows_.cable * std::sin(rows_.limit);
  const double still = rows_.cable * std::sin(rows_.end_limit);
  end_ = 1.0 / (still * still);
  cable_over_g_ = rows_.cable / machine.gravity.norm();
  const auto size = static_cast<std::size_t>(inner_->size());
  z_.resize(size);
  gradient_.resize(size);
  hessian_.resize(size * size);
  jacobian_.resize(size * static_cast<std::size_t>(inner_->path_count()));
}

int SwayKnotModel::place(int local) const { return local + m_ * (local / n_); }

const double* SwayKnotModel::inner_z(const double* z) {
  for (int i = 0; i < inner_->size(); ++i) z_[static_cast<std::size_t>(i)] = z[place(i)];
  return z_.data();
}

void SwayKnotModel::begin_node(int knot, int interval) {
  knot_ = knot;
  inner_->begin_node(knot, interval);
}

double SwayKnotModel::cost(const double* z) { return inner_->cost(inner_z(z)); }

double SwayKnotModel::cost_derivatives(const double* z, double* gradient, double* hessian) {
  const double value = inner_->cost_derivatives(inner_z(z), gradient_.data(), hessian_.data());
  std::fill(gradient, gradient + size(), 0.0);
  std::fill(hessian, hessian + size() * size(), 0.0);
  const int inner = inner_->size();
  for (int c = 0; c < inner; ++c) {
    gradient[place(c)] = gradient_[static_cast<std::size_t>(c)];
    for (int r = 0; r < inner; ++r)
      hessian[place(c) * size() + place(r)] = hessian_[static_cast<std::size_t>(c * inner + r)];
  }
  return value;
}

void SwayKnotModel::path_bounds(double* lower, double* upper) const {
  inner_->path_bounds(lower, upper);
  const int first = inner_->path_count();
  for (int f = 0; f < facets(); ++f) {
    lower[first + f] = -apothem_;
    upper[first + f] = apothem_;
  }
  lower[first + facets()] = -std::numeric_limits<double>::infinity();
  upper[first + facets()] = 1.0;
}

bool SwayKnotModel::path_uses_velocity(int row) const {
  const int own = row - inner_->path_count();
  return own < 0 ? inner_->path_uses_velocity(row) : own == facets();
}

bool SwayKnotModel::path_uses_acceleration(int row) const {
  return row < inner_->path_count() && inner_->path_uses_acceleration(row);
}

bool SwayKnotModel::path_imposed_at(int row, int knot) const {
  const int own = row - inner_->path_count();
  if (own < 0) return inner_->path_imposed_at(row, knot);
  if (own < facets()) return knot > 0;  // at the start the load hangs below the tip
  return std::find(rows_.still_knots.begin(), rows_.still_knots.end(), knot) !=
         rows_.still_knots.end();
}

std::string SwayKnotModel::path_name(int row) const {
  const int own = row - inner_->path_count();
  if (own < 0) return inner_->path_name(row);
  return own < facets() ? "sway of the load" : "sway of the load at the end or a stop";
}

double SwayKnotModel::end_velocity(int direction) const {
  const bool moving = rows_.end_velocity.size() > 0 && !rows_.still_knots.empty() &&
                      knot_ == rows_.still_knots.back();
  return moving ? rows_.end_velocity[direction] : 0.0;
}

double SwayKnotModel::rope(int direction, const double* z) const {
  return z[n_ + direction] - tip_.value(direction);
}

double SwayKnotModel::rate(int direction, const double* z) const {
  return z[2 * n_ + m_ + direction] - end_velocity(direction);
}

void SwayKnotModel::own_values(const double* z, double* g) const {
  for (int f = 0; f < facets(); ++f) {
    g[f] = 0.0;
    for (int d = 0; d < m_; ++d) g[f] += facets_(d, f) * rope(d, z);
  }
  double& still = g[facets()];
  still = 0.0;
  for (int d = 0; d < m_; ++d)
    still += end_ * (rope(d, z) * rope(d, z) + cable_over_g_ * rate(d, z) * rate(d, z));
}

void SwayKnotModel::path(const double* z, double* g) {
  inner_->path(inner_z(z), g);
  tip_.update(z);
  own_values(z, g + inner_->path_count());
}

void SwayKnotModel::path_jacobian(const double* z, double* g, double* jacobian) {
  const int inner = inner_->size(), rows = inner_->path_count();
  inner_->path_jacobian(inner_z(z), g, jacobian_.data());
  std::fill(jacobian, jacobian + path_count() * size(), 0.0);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < inner; ++c)
      jacobian[r * size() + place(c)] = jacobian_[static_cast<std::size_t>(r * inner + c)];
  }
  tip_.update(z);
  own_values(z, g + rows);
  double* out = jacobian + rows * size();
  for (int f = 0; f < facets(); ++f, out += size()) {
    for (int d = 0; d < m_; ++d) {
      for (int j = 0; j < n_; ++j) out[j] -= facets_(d, f) * tip_.slope(d, j);
      out[n_ + d] = facets_(d, f);
    }
  }
  for (int d = 0; d < m_; ++d) {
    const double pull = 2.0 * end_ * rope(d, z);
    for (int j = 0; j < n_; ++j) out[j] -= pull * tip_.slope(d, j);
    out[n_ + d] = pull;
    out[2 * n_ + m_ + d] = 2.0 * end_ * cable_over_g_ * rate(d, z);
  }
}

void SwayKnotModel::add_path_hessian(const double* z, const double* multiplier, double* hessian) {
  const int inner = inner_->size(), rows = inner_->path_count(), n = size();
  std::fill(hessian_.begin(), hessian_.end(), 0.0);
  inner_->add_path_hessian(inner_z(z), multiplier, hessian_.data());
  for (int c = 0; c < inner; ++c) {
    for (int r = 0; r < inner; ++r)
      hessian[place(c) * n + place(r)] += hessian_[static_cast<std::size_t>(c * inner + r)];
  }
  tip_.update(z);
  const double still = 2.0 * end_ * multiplier[rows + facets()];
  std::array<double, 2> pull{};  // derivative of the rows' sum in the tip's coordinates, negative
  for (int d = 0; d < m_; ++d) {
    double& sum = pull[static_cast<std::size_t>(d)];
    sum = -still * rope(d, z);
    for (int f = 0; f < facets(); ++f) sum -= multiplier[rows + f] * facets_(d, f);
  }
  const auto both = [&](int i, int k, double value) {
    hessian[k * n + i] += value;
    if (i != k) hessian[i * n + k] += value;
  };
  for (int k = 0; k < n_; ++k) {
    for (int i = 0; i <= k; ++i) {
      double value = tip_.curvature(pull.data(), i, k);
      for (int d = 0; d < m_; ++d) value += still * tip_.slope(d, i) * tip_.slope(d, k);
      both(i, k, value);
    }
    for (int d = 0; d < m_; ++d) both(k, n_ + d, -still * tip_.slope(d, k));
  }
  for (int d = 0; d < m_; ++d) {
    both(n_ + d, n_ + d, still);
    both(2 * n_ + m_ + d, 2 * n_ + m_ + d, still * cable_over_g_);
  }
}

}  // namespace sparflow
