#pragma once
/// Postures of a machine with one redundant joint that hold its tip at one point: a curve in joint space, its
/// self-motion (Burdick 1989). It is traced and sampled where a joint takes a value of a grid.
#include <Eigen/Dense>
#include <vector>

#include "models/machine/kinematics.h"
#include "problems/problem.h"

namespace sparflow {

/// A mutable workspace that refers to `problem`; each thread needs its own. Coordinates z are joint positions divided by
/// speed_scale(), in seconds of travel at full speed [s].
class SelfMotion {
 public:
  explicit SelfMotion(const MotionProblem& problem);

  /// Degrees of freedom beyond those of the tip; the other functions need exactly 1.
  int redundancy() const;
  Eigen::VectorXd joints(const Eigen::VectorXd& z) const { return z.cwiseProduct(scale_); }
  Eigen::VectorXd scaled(const Eigen::VectorXd& q) const { return q.cwiseQuotient(scale_); }
  const Eigen::VectorXd& scale() const { return scale_; }

  /// Moves z to a posture with the tip at `tip` [m], perpendicular to the self-motion or with one joint held. Limits of
  /// position are ignored. @param held joint, -1 = none  @return whether Newton's method converged
  bool project(const Eigen::Vector3d& tip, int held, Eigen::VectorXd& z);
  bool within_range(const Eigen::VectorXd& z) const;

  /// Samples the self-motion through `from` up to `reach` [s] in both directions or to a limit of position, where a joint
  /// stands at start + i * spacing or at its limit. That joint's value is exact, so that a motion along the samples can
  /// hold any of its joints at rest.
  /// @param from posture with its tip at `tip`, within range; it is one of the samples
  void trace(const Eigen::Vector3d& tip, const Eigen::VectorXd& from, double spacing, double reach,
             std::vector<Eigen::VectorXd>& samples);

 private:
  void derivative(const Eigen::VectorXd& z);
  Eigen::VectorXd tangent() const;

  const MotionProblem& problem_;
  ChainGeometry chain_;
  Eigen::VectorXd scale_, lo_, hi_, origin_;
  Eigen::MatrixXd basis_;  // rows are the directions in which the tip can move
  Eigen::Vector3d tip_ = Eigen::Vector3d::Zero();
  Eigen::MatrixXd jacobian_;  // [directions x joints], with respect to z
};

}  // namespace sparflow
