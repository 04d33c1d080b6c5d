#include "models/effects/hanging_load/swing_state.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "models/machine/inertial_torque.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixX3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

/// Phase by which the pendulum swings in a step of integration, whose error by Runge's rule of fourth order is then 1e-7 of a
/// swing.
/// @threshold [rad] 0.01..0.5; chosen: far below the error of the tip's acceleration
constexpr double kStepPhase = 0.1;

/// Change of the logged payload, as a share of its largest, that is another load.
/// @threshold [-] 0.005..0.1; chosen: above the noise of a scale, below any load that is lifted
constexpr double kPayloadStep = 0.02;

/// Phase of a swing between two of the rows that are compared, and between steps of integration.
/// @threshold [rad] 0.1..0.4; chosen: the error of Runge's rule is 1e-5 of a swing
constexpr double kRowPhase = 0.25;

/// Shortest part whose state is estimated; a load that is being lifted changes for less time.
/// @threshold [s] 1..5; chosen: as long as a swing on a rope of 1 m
constexpr double kLeastPart = 2.0;

/// Standard deviation of a weight's deflection about the state in which it was before, as known without forces.
/// @threshold [rad] 0.3..1; chosen: the loads of a crane at work swing by up to 40 degrees
constexpr double kPriorSwing = 0.5;
constexpr double kPriorWeight = 1.0 / (kPriorSwing * kPriorSwing);  // no threshold: follows from it

/// Two unit vectors across a direction.
Eigen::Matrix<double, 3, 2> across(const Vector3d& down) {
  Eigen::Matrix<double, 3, 2> out;
  out.col(0) = down.unitOrthogonal();
  out.col(1) = down.cross(out.col(0));
  return out;
}

/// What the forces of one part of a log say of the weight, on every stride-th row.
class SwingForces {
 public:
  SwingForces(const MachineSeries& log, const TipMotion& tip, const LoadPart& part, Index stride);
  bool empty() const { return cylinders_.empty(); }
  const std::vector<Index>& rows() const { return rows_; }
  /// Each cylinder's weighted force from a pull [rows x 3, m/s^2].
  VectorXd of_pull(const MatrixX3d& pull) const;
  /// Each cylinder's weighted measured force beyond the static one.
  VectorXd measured() const;
  /// Weights each cylinder by what the pull leaves of its force.
  void weigh(const MatrixX3d& pull);

 private:
  struct Cylinder {
    MatrixX3d per_pull;  // [kg] N per m/s^2, freed
    VectorXd beyond;     // [N] measured less static, freed
    double weight = 0.0, rows = 0.0;
  };
  std::vector<Index> rows_;
  std::vector<Cylinder> cylinders_;
  std::vector<MatrixXd> basis_;
};

/// Torques that accelerate the machine with its payload fixed to the tip; NaN where they are not known. [rows x joints]
MatrixXd rigid_torques(const MachineSeries& log, const std::vector<Index>& rows) {
  const Machine& machine = *log.machine;
  MatrixXd out = MatrixXd::Constant(static_cast<Index>(rows.size()), machine.joint_count(),
                                    std::numeric_limits<double>::quiet_NaN());
  for (Index j = 0; j < out.rows(); ++j) {
    const Index i = rows[static_cast<std::size_t>(j)];
    const VectorXd q = log.q.row(i), qd = log.qd.row(i), qdd = log.qdd.row(i);
    if (!q.allFinite() || !qd.allFinite() || !qdd.allFinite()) continue;
    try {
      out.row(j) = inertial_torque<double>(machine, q, qd, qdd, log.payload[i]);
    } catch (const std::domain_error&) {
      // a measured posture in which a linkage cannot close
    }
  }
  return out;
}

SwingForces::SwingForces(const MachineSeries& log, const TipMotion& tip, const LoadPart& part,
                         Index stride) {
  const Machine& machine = *log.machine;
  for (Index i = part.first; i < part.last; i += stride) rows_.push_back(i);
  const auto n = static_cast<Index>(rows_.size());
  const MatrixXd rigid = rigid_torques(log, rows_);
  for (std::size_t k = 0; k < machine.cylinders.size(); ++k) {
    const int joint = machine.cylinders[k].joint;
    const CylinderSeries& s = log.cylinders[k];
    if (joint > machine.tip.joint || s.force.size() == 0) continue;
    Cylinder c;
    c.per_pull.setZero(n, 3);
    c.beyond.setZero(n);
    MatrixXd others = MatrixXd::Zero(n, 4);
    for (Index j = 0; j < n; ++j) {
      const Index i = rows_[static_cast<std::size_t>(j)];
      const double y = s.force[i] - s.static_force[i];
      const bool known = s.direction[i] != 0 && std::isfinite(y) && std::isfinite(s.speed[i]) &&
                         std::isfinite(rigid(j, joint)) && tip.acceleration.row(i).allFinite();
      if (!known || s.rate[i] == 0.0) continue;  // at a dead centre a force holds no load
      c.beyond[j] = y;
      c.rows += 1.0;
      c.per_pull.row(j) = tip.jacobian.row(i).segment<3>(Index{3} * joint) *
                          (machine.tip.payload_scale * log.payload[i] / s.rate[i]);
      others.row(j) << 1.0, static_cast<double>(s.direction[i]), s.speed[i],
          rigid(j, joint) / s.rate[i];
    }
    if (c.per_pull.isZero(0.0)) continue;
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(others);
    basis_.push_back(qr.householderQ() * MatrixXd::Identity(n, qr.rank()));
    const MatrixXd& b = basis_.back();
    c.beyond -= b * (b.transpose() * c.beyond);
    c.weight = 1.0 / std::max(c.beyond.norm() / std::sqrt(c.rows), 1e-9);
    cylinders_.push_back(std::move(c));
  }
}

VectorXd SwingForces::of_pull(const MatrixX3d& pull) const {
  const auto n = static_cast<Index>(rows_.size());
  VectorXd out(n * static_cast<Index>(cylinders_.size()));
  for (std::size_t k = 0; k < cylinders_.size(); ++k) {
    const Cylinder& c = cylinders_[k];
    const VectorXd y = c.per_pull.cwiseProduct(pull).rowwise().sum();
    out.segment(n * static_cast<Index>(k), n) =
        c.weight * (y - basis_[k] * (basis_[k].transpose() * y));
  }
  return out;
}

VectorXd SwingForces::measured() const {
  const auto n = static_cast<Index>(rows_.size());
  VectorXd out(n * static_cast<Index>(cylinders_.size()));
  for (std::size_t k = 0; k < cylinders_.size(); ++k)
    out.segment(n * static_cast<Index>(k), n) = cylinders_[k].weight * cylinders_[k].beyond;
  return out;
}

void SwingForces::weigh(const MatrixX3d& pull) {
  const VectorXd left = measured() - of_pull(pull);
  const auto n = static_cast<Index>(rows_.size());
  for (std::size_t k = 0; k < cylinders_.size(); ++k)
    cylinders_[k].weight /= std::max(
        left.segment(n * static_cast<Index>(k), n).norm() / std::sqrt(cylinders_[k].rows), 1e-3);
}

/// Motion of the weight through a part, on the rows compared.
class SwingMotion {
 public:
  SwingMotion(const MachineSeries& log, const TipMotion& tip, double rope, double damping)
      : log_(log), tip_(tip), rope_(rope) {
    gravity_ = log.machine->gravity;
    frequency_ = std::sqrt(gravity_.norm() / rope);
    swing_ = {damping * frequency_, kRowPhase / frequency_};
  }
  double frequency() const { return frequency_; }
  const SwingDecay& swing() const { return swing_; }
  Vector3d pull_at(Index row) const {
    const Vector3d a = tip_.acceleration.row(row);
    return a.allFinite() ? Vector3d((gravity_ - a) / rope_) : Vector3d(gravity_ / rope_);
  }
  /// @param pull [rows x 3], resized. @return the state at the last row
  /// Between two rows the pull is linear with the mean of its samples, so that noise of the accelerations adds up to no more than that
  /// of the positions.
  Pendulum run(Pendulum p, const std::vector<Index>& rows, MatrixX3d* pull) const {
    const auto n = static_cast<Index>(rows.size());
    pull->resize(n, 3);
    Vector3d before = pull_at(rows.front());
    for (Index j = 0; j < n; ++j) {
      const Index i = rows[static_cast<std::size_t>(j)];
      const Vector3d now = pull_at(i);
      if (j > 0) {
        const Index last = rows[static_cast<std::size_t>(j - 1)];
        const Vector3d shift = mean_pull(last, i) - 0.5 * (before + now);
        p.move(before + shift, now + shift, log_.time[i] - log_.time[last], swing_);
      }
      pull->row(j) = rope_ * p.slope(now, swing_.decay);
      before = now;
    }
    return p;
  }
  /// Of the samples from one row to another, by the trapezoidal rule.
  Vector3d mean_pull(Index from, Index to) const {
    Vector3d sum = 0.5 * (pull_at(from) + pull_at(to));
    for (Index i = from + 1; i < to; ++i) sum += pull_at(i);
    return sum / static_cast<double>(to - from);
  }
  /// @param x deflection across the rope and its rate over the frequency [rad]
  Pendulum deflected(const Pendulum& p, const Vector4d& x) const {
    const Eigen::Matrix<double, 3, 2> t = across(p.down);
    const Vector3d turn = t * x.head<2>();
    Pendulum out = p;
    const double angle = turn.norm();
    if (angle > 0.0) out.down = std::cos(angle) * p.down + std::sin(angle) / angle * turn;
    out.rate += frequency_ * (t * x.tail<2>());
    out.rate -= out.down * out.down.dot(out.rate);
    return out;
  }

 private:
  const MachineSeries& log_;
  const TipMotion& tip_;
  double rope_, frequency_ = 0.0;
  SwingDecay swing_{};
  Vector3d gravity_;
};

constexpr double kDifference = 1e-4;  // no threshold: difference quotient [rad]
constexpr int kMostIterations = 8;    // no threshold: two or three suffice
constexpr int kMostAttempts = 6;      // no threshold: Levenberg's damping rises by a million
constexpr double kConverged =
    1e-3;  // no threshold: relative fall of the sum of squares that ends it

/// Finds the state by Levenberg's iteration from the one in which the part before has ended.
class SwingFit {
 public:
  SwingFit(const SwingMotion& motion, SwingForces forces, const Pendulum& prior)
      : motion_(motion), forces_(std::move(forces)), prior_(prior) {}

  Pendulum run() {
    motion_.run(prior_, forces_.rows(), &pull_);
    descend();
    forces_.weigh(pull_);
    descend();
    return motion_.deflected(prior_, x_);
  }

 private:
  double cost(const VectorXd& left, const Vector4d& x) const {
    return left.squaredNorm() + kPriorWeight * x.squaredNorm();
  }
  MatrixXd jacobian() const {
    const VectorXd here = forces_.of_pull(pull_);
    MatrixXd out(here.size(), 4);
    MatrixX3d moved;
    for (int k = 0; k < 4; ++k) {
      Vector4d to = x_;
      to[k] += kDifference;
      motion_.run(motion_.deflected(prior_, to), forces_.rows(), &moved);
      out.col(k) = (forces_.of_pull(moved) - here) / kDifference;
    }
    return out;
  }
  void descend() {
    const VectorXd measured = forces_.measured();
    VectorXd left = measured - forces_.of_pull(pull_);
    double now = cost(left, x_);
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      const MatrixXd j = jacobian();
      Eigen::Matrix4d normal = j.transpose() * j;
      normal.diagonal().array() += kPriorWeight;
      const Vector4d slope = j.transpose() * left - kPriorWeight * x_;
      const double before = now;
      for (int attempt = 0; attempt < kMostAttempts && !(now < before); ++attempt) {
        Eigen::Matrix4d damped = normal;
        damped.diagonal() *= 1.0 + damping_;
        const Vector4d to = x_ + damped.ldlt().solve(slope);
        MatrixX3d moved;
        motion_.run(motion_.deflected(prior_, to), forces_.rows(), &moved);
        const VectorXd then = measured - forces_.of_pull(moved);
        damping_ = cost(then, to) < now ? std::max(0.1 * damping_, 1e-6) : 10.0 * damping_;
        if (!(cost(then, to) < now)) continue;
        now = cost(then, to);
        x_ = to;
        left = then;
        pull_ = moved;
      }
      if (!(now < (1.0 - kConverged) * before)) break;
    }
  }

  const SwingMotion& motion_;
  SwingForces forces_;
  Pendulum prior_;
  Vector4d x_ = Vector4d::Zero();
  MatrixX3d pull_;
  double damping_ = 1e-3;
};

std::vector<LoadPart> parts_by_payload(const MachineSeries& log) {
  std::vector<LoadPart> out;
  const double least = kPayloadStep * log.payload.cwiseAbs().maxCoeff();
  for (const auto& [first, last] : log.runs) {
    Index begin = first;
    for (Index i = first + 1; i < last; ++i)
      if (std::abs(log.payload[i] - log.payload[begin]) > least) {
        out.push_back({begin, i, {}});
        begin = i;
      }
    if (last > begin) out.push_back({begin, last, {}});
  }
  return out;
}

/// Whether a part is long enough, and its load on the rope known, that the forces say how it swings.
bool tells(const MachineSeries& log, const LoadPart& part) {
  return log.payload[part.first] > 0.0 &&
         log.time[part.last - 1] - log.time[part.first] > kLeastPart;
}

}  // namespace

int swinging_part_count(const MachineSeries& log) {
  const std::vector<LoadPart> parts = parts_by_payload(log);
  return static_cast<int>(
      std::count_if(parts.begin(), parts.end(), [&](const LoadPart& p) { return tells(log, p); }));
}

std::vector<LoadPart> swinging_parts(const MachineSeries& log, const TipMotion& tip, double rope,
                                     double damping) {
  std::vector<LoadPart> parts = parts_by_payload(log);
  const SwingMotion motion(log, tip, rope, damping);
  const Index stride = std::max<Index>(
      1, static_cast<Index>(kRowPhase / (motion.frequency() * std::max(log.step, 1e-6))));
  Index end = -1;
  Pendulum state;
  for (LoadPart& part : parts) {
    if (part.first != end) {
      state.down = motion.pull_at(part.first).normalized();
      state.rate.setZero();
    }
    part.start = state;
    const SwingForces forces(log, tip, part, stride);
    if (tells(log, part) && !forces.empty()) {
      part.start = SwingFit(motion, forces, state).run();
    }
    std::vector<Index> rows = forces.rows();
    if (rows.back() != part.last - 1) rows.push_back(part.last - 1);
    MatrixX3d pull;
    state = motion.run(part.start, rows, &pull);
    end = part.last;
    // The next part begins one row later.
    if (end < log.samples())
      state.move(motion.pull_at(end - 1), motion.pull_at(end), log.time[end] - log.time[end - 1],
                 motion.swing());
  }
  return parts;
}

Eigen::MatrixX3d pull_of_hanging_weight(const MachineSeries& log,
                                        const Eigen::MatrixX3d& acceleration, double rope,
                                        double damping, std::span<const LoadPart> parts) {
  const Vector3d gravity = log.machine->gravity;
  const double frequency = std::sqrt(gravity.norm() / rope);
  const SwingDecay swing{damping * frequency, kStepPhase / frequency};
  Eigen::MatrixX3d out =
      Eigen::MatrixX3d::Constant(log.samples(), 3, std::numeric_limits<double>::quiet_NaN());
  for (const auto& [first, last] : log.runs) {
    Vector3d pull = gravity / rope;
    Pendulum p{pull.normalized(), Vector3d::Zero()};
    bool begun = false;
    for (Index i = first; i < last; ++i) {
      const Vector3d a = acceleration.row(i);
      const Vector3d now = a.allFinite() ? Vector3d((gravity - a) / rope) : pull;
      while (!parts.empty() && parts.front().first < i) parts = parts.subspan(1);
      if (!parts.empty() && parts.front().first == i) {
        p = parts.front().start;
        begun = true;
      } else if (!begun) {
        if (!a.allFinite()) continue;
        p.down = now.normalized();
        begun = true;
      } else {
        p.move(pull, now, log.time[i] - log.time[i - 1], swing);
      }
      pull = now;
      if (a.allFinite()) out.row(i) = rope * p.slope(pull, swing.decay);
    }
  }
  return out;
}

}  // namespace sparflow
