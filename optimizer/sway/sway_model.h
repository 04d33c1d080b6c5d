#pragma once
/// The load on its rope as further states of a transcription: one or two horizontal coordinates y of the load join the joints,
///   y''_k = lambda_k / 2 [ (P(q_k) - y_k) + (P(q_k+1) - y_k+1) ]      P: the same coordinates of the tip
/// which is exact where lambda_k, the rope's tension over mass and length, is that of the motion (pendulum.h). It is held during a
/// solve and renewed between solves, for it hardly changes: g / l up to the tip's vertical acceleration. So the load needs no
/// derivative of the tip's acceleration, and its rows couple two neighbouring knots as the defects of the joints do.
#include <memory>
#include <string>
#include <vector>

#include "models/machine/kinematics.h"
#include "optimizer/sway/pendulum.h"
#include "optimizer/transcription/knot_model.h"
#include "problems/problem.h"

namespace sparflow {

/// Horizontal unit vectors along which the tip can move [3 x 1 or 3 x 2]: one where the machine stays in a vertical plane.
Eigen::Matrix3Xd sway_directions(const Machine& machine);

/// A motion with the load's coordinates as further columns of q, qd and qdd.
/// @param sway where the load swings farther than this limit, its coordinates are brought back to it
Trajectory with_load(const Machine& machine, const Trajectory& motion, const SwayLimit& sway);
/// lambda of every interval of a motion, as SwayDynamics needs it. [1/s^2]
Eigen::VectorXd load_stiffness(const Machine& machine, const Trajectory& motion, double cable);
/// The motion without them. @param joints columns that are kept
Trajectory without_load(const Trajectory& motion, int joints);

/// Tip coordinates along the sway directions, and their derivatives.
class TipCoordinates {
 public:
  explicit TipCoordinates(const Machine& machine);
  int count() const { return static_cast<int>(directions_.cols()); }
  void update(const double* q);
  double value(int direction) const { return directions_.col(direction).dot(point_); }
  /// [3 x n] of the tip
  double slope(int direction, int joint) const {
    return directions_.col(direction).dot(jacobian_.col(joint));
  }
  /// Second derivative of sum_d weight[d] * value(d) in joints i <= k.
  double curvature(const double* weight, int i, int k) const;

 private:
  const Machine* machine_;
  ChainGeometry chain_;
  Eigen::Matrix3Xd directions_, jacobian_;
  Eigen::Vector3d point_ = Eigen::Vector3d::Zero();
};

/// The load's dynamics between two knots.
class SwayDynamics final : public IntervalModel {
 public:
  /// @param stiffness [1/s^2] lambda of every interval
  SwayDynamics(const Machine& machine, Eigen::VectorXd stiffness);
  int count() const override { return tip_.count(); }
  void value(int interval, const Ends& at, double* g) override;
  void jacobian(int interval, const Ends& at, double* jacobian) override;
  void add_hessian(int interval, const Ends& at, const double* multiplier, double* hessian0,
                   double* hessian1) override;
  std::string name(int row) const override {
    return "dynamics of the load, direction " + std::to_string(row + 1);
  }

 private:
  TipCoordinates tip_;
  int joints_;
  Eigen::VectorXd stiffness_;
};

/// Constraints of the machine's posture in a transcription that has the load's coordinates beside it.
class PostureBesideLoad final : public TerminalModel {
 public:
  /// @param joints of the machine  @param loads coordinates of the load
  PostureBesideLoad(std::shared_ptr<TerminalModel> inner, int joints, int loads)
      : inner_(std::move(inner)), n_(joints), m_(loads) {}
  int count() const override { return inner_->count(); }
  void bounds(double* lower, double* upper) const override { inner_->bounds(lower, upper); }
  void value(const double* q, double* g) override { inner_->value(q, g); }
  void jacobian(const double* q, double* jacobian) override;
  void add_hessian(const double* q, const double* multiplier, double* hessian) override;
  std::string name(int row) const override { return inner_->name(row); }

 private:
  std::shared_ptr<TerminalModel> inner_;
  int n_, m_;
};

struct SwayRows {
  double limit = 0.0;      ///< largest angle along the way [rad]
  double end_limit = 0.0;  ///< largest amplitude at the end and at stops [rad]
  double cable = 0.0;      ///< [m]
  /// Knots at which the amplitude is limited: stops and the end.
  std::vector<int> still_knots;
  /// The tip's velocity at these knots along the sway directions, 0 where it rests. [m/s] of the last knot
  Eigen::VectorXd end_velocity;
};

/// A knot model whose joints are joined by the load's coordinates. It adds rows that are linear in them, the rope's horizontal part
/// over that of the limit (one, or the sides of a polygon in the circle of the limit), and one at the end and at stops, the squared
/// amplitude over its limit.
class SwayKnotModel final : public KnotModel {
 public:
  SwayKnotModel(const Machine& machine, std::shared_ptr<KnotModel> inner, SwayRows rows);
  int joint_count() const override { return n_ + m_; }
  bool uses_acceleration() const override { return inner_->uses_acceleration(); }
  void begin_node(int knot, int interval) override;
  bool split_at(int knot) const override { return inner_->split_at(knot); }
  double cost(const double* z) override;
  double cost_derivatives(const double* z, double* gradient, double* hessian) override;
  int path_count() const override { return inner_->path_count() + facets() + 1; }
  void path_bounds(double* lower, double* upper) const override;
  bool path_uses_velocity(int row) const override;
  bool path_uses_acceleration(int row) const override;
  bool path_imposed_at(int row, int knot) const override;
  std::string path_name(int row) const override;
  void path(const double* z, double* g) override;
  void path_jacobian(const double* z, double* g, double* jacobian) override;
  void add_path_hessian(const double* z, const double* multiplier, double* hessian) override;

 private:
  int place(int local) const;  // of an inner local index
  const double* inner_z(const double* z);
  int facets() const { return static_cast<int>(facets_.cols()); }
  /// The rope's horizontal coordinate and its rate. [m], [m/s]
  double rope(int direction, const double* z) const;
  double rate(int direction, const double* z) const;
  void own_values(const double* z, double* g) const;
  double end_velocity(int direction) const;

  std::shared_ptr<KnotModel> inner_;
  SwayRows rows_;
  TipCoordinates tip_;
  int n_, m_;
  Eigen::MatrixXd facets_;  // [directions x rows] normals over the limit [1/m]
  double apothem_ = 1.0, end_ = 0.0, cable_over_g_ = 0.0;
  int knot_ = 0;
  std::vector<double> z_, gradient_, hessian_, jacobian_;
};

}  // namespace sparflow
