#pragma once
/// Direct transcription of a motion with piecewise constant acceleration into a sparse NLP.
///   variables   x = [q_0 .. q_N, qd_0 .. qd_N, qdd_0 .. qdd_{N-1}], n values each
///   minimise    sum_k h_k/2 (c(z_k) + c(z_{k+1})) + sum_k,i w_i qdd_{k,i}^2 [h_k]
///   subject to  q_{k+1}  = q_k + h_k/2 (qd_k + qd_{k+1})      (exact, not an approximation)
///               qd_{k+1} = qd_k + h_k qdd_k                   (exact)
///               terminal(q_N), path(z_k), bounds on every single variable
/// The cost integral alone is approximate (trapezoid). A model that uses the acceleration sees each interval at
/// both its ends with the interval's own qdd, because qdd jumps at the knots.
/// Source: Betts (2010), Practical Methods for Optimal Control, ch. 4; equations and layout: docs/transcription.md.
#include <memory>
#include <vector>

#include "models/trajectory.h"
#include "optimizer/knot_model.h"
#include "optimizer/nlp/nlp_problem.h"

namespace sparflow {

/// One row an instant (q, qd: N+1 rows; qdd: N rows), one column a joint. Equal bounds fix a value, so a joint is
/// frozen over a phase by zeros, a sign is imposed by one zero.
struct TranscriptionBounds {
  Eigen::MatrixXd q_lower, q_upper;      ///< [rad] or [m]
  Eigen::MatrixXd qd_lower, qd_upper;    ///< [rad/s] or [m/s]
  Eigen::MatrixXd qdd_lower, qdd_upper;  ///< [rad/s^2] or [m/s^2]

  /// The same bounds at every instant; vectors [n].
  static TranscriptionBounds uniform(int intervals, const Eigen::VectorXd& q_lower,
                                     const Eigen::VectorXd& q_upper,
                                     const Eigen::VectorXd& qd_lower,
                                     const Eigen::VectorXd& qd_upper,
                                     const Eigen::VectorXd& qdd_lower,
                                     const Eigen::VectorXd& qdd_upper);
  void fix_q(int knot, const Eigen::VectorXd& q);
  void fix_qd(int knot, const Eigen::VectorXd& qd);
  /// From rest at q_start to rest.
  void rest_to_rest(const Eigen::VectorXd& q_start);
};

struct TranscriptionSpec {
  Eigen::VectorXd t;  ///< [s] the N+1 knots, increasing, any spacing
  std::shared_ptr<KnotModel> knot;
  std::shared_ptr<TerminalModel> terminal;  ///< null = the end posture is ruled by the bounds alone
  TranscriptionBounds bounds;
  Eigen::VectorXd acceleration_weight;  ///< [n] w_i >= 0, empty = none
  /// true: w_i qdd^2 h, an integral over time, independent of the mesh; false: a plain sum.
  bool acceleration_weight_times_step = true;
  std::vector<std::string> joint_names;  ///< for messages; empty = joint 0, 1, ...
};

/// Multipliers by meaning rather than by row, so that they survive a change of bounds (which may drop rows).
struct TranscriptionMultipliers {
  Eigen::MatrixXd q_defect;      ///< [N x n] of q_{k+1} - q_k - h/2 (qd_k + qd_{k+1}) = 0
  Eigen::MatrixXd qd_defect;     ///< [N x n] of qd_{k+1} - qd_k - h qdd_k = 0
  Eigen::VectorXd terminal;      ///< [terminal rows]
  Eigen::MatrixXd path;          ///< [nodes x path rows], zero where a row is not imposed
  Eigen::VectorXd lower, upper;  ///< of the bounds, laid out as x
};

class Transcription final : public NlpProblem {
 public:
  /// Checks shapes. The models are used as workspaces by every later call.
  explicit Transcription(TranscriptionSpec spec);

  int joint_count() const { return n_; }
  int interval_count() const { return intervals_; }
  const TranscriptionSpec& spec() const { return spec_; }

  // Where a value stands in x.
  int q_index(int knot, int joint) const { return knot * n_ + joint; }
  int qd_index(int knot, int joint) const { return (knots_ + knot) * n_ + joint; }
  int qdd_index(int interval, int joint) const { return (2 * knots_ + interval) * n_ + joint; }

  /// Start values; before the first call they are the middle of the bounds (0 where a side is open).
  void set_start(const Eigen::VectorXd& x);
  /// Start from a motion, sampled at this mesh: q and qd from the motion (held at rest beyond its ends), qdd such
  /// that the velocity defects vanish. Values outside their bounds are clipped.
  void set_start(const Trajectory& motion);
  /// Multipliers for a warm start; their shapes must be this transcription's.
  void set_start_multipliers(const TranscriptionMultipliers& multipliers);
  void clear_start_multipliers() { start_multipliers_.reset(); }

  Eigen::VectorXd variables(const Trajectory& motion) const;
  Trajectory trajectory(const Eigen::VectorXd& x) const;
  TranscriptionMultipliers multipliers(const NlpMultipliers& rows) const;
  /// Integral of the model's cost alone, without the acceleration term.
  double model_cost(const Eigen::VectorXd& x);

  NlpSize size() const override;
  void bounds(Out x_lower, Out x_upper, Out g_lower, Out g_upper) const override;
  void start(Out x) const override;
  const NlpMultipliers* start_multipliers() const override;
  double objective(In x) override;
  void gradient(In x, Out gradient) override;
  void constraints(In x, Out g) override;
  void jacobian_structure(OutIndex row, OutIndex column) const override;
  void jacobian(In x, Out value) override;
  void hessian_structure(OutIndex row, OutIndex column) const override;
  void hessian(In x, double objective_factor, In multiplier, Out value) override;
  std::string variable_name(int index) const override;
  std::string constraint_name(int index) const override;

 private:
  /// One evaluation of the model: a knot, one side of a knot at which the law changes, or (with
  /// acceleration) one end of an interval.
  struct Node {
    int knot = 0;
    int interval = -1;    ///< whose qdd; -1 = the model does not use it
    double weight = 0.0;  ///< [s] in the trapezoid
    int first_row = 0;    ///< in g, of this node's path rows
    int law = 0;          ///< interval in whose name the model is evaluated
    /// false: only rows that use the acceleration (the others are another node's)
    bool all_rows = true;
  };
  struct Defect {
    int interval, joint;
    bool velocity;  ///< of qd, else of q
  };

  void make_nodes();
  void make_defects();
  void make_jacobian();
  void make_hessian();
  int global_index(const Node& node, int local) const;
  const std::vector<int>& rows_of(const Node& node) const;
  void gather(const Node& node, const double* x, double* z) const;
  double acceleration_cost(const double* x) const;
  void update_values(const double* x);
  void update_derivatives(const double* x);
  std::string joint_name(int joint) const;

  TranscriptionSpec spec_;
  int n_, knots_, intervals_, z_size_, terminal_count_, path_count_;
  bool with_acceleration_;
  Eigen::VectorXd step_;                 ///< [s] h_k
  Eigen::MatrixXd acceleration_factor_;  ///< [n x N] w_i or w_i h_k
  std::vector<Node> nodes_;
  std::vector<Defect> defects_;  ///< in row order; rows between fixed variables are left out
  int terminal_row_ = 0, row_count_ = 0;
  std::vector<int> all_rows_, acceleration_rows_;

  // Structure, and the values that never change.
  std::vector<int> jacobian_row_, jacobian_column_, hessian_row_, hessian_column_;
  Eigen::VectorXd jacobian_constant_;
  std::vector<std::vector<int>> row_columns_;  ///< per path row: the local indices it depends on
  int terminal_jacobian_ = 0;                  ///< first value of the terminal block
  int first_path_jacobian_ = 0;                ///< first value of the path blocks, node by node
  std::vector<int> node_hessian_;              ///< [node x lower triangle of z, column by column]
  std::vector<int> terminal_hessian_;          ///< [lower triangle of q_N, column by column]
  std::vector<int> acceleration_hessian_;      ///< [N x n] diagonal of qdd

  Eigen::VectorXd start_;
  std::unique_ptr<NlpMultipliers> start_multipliers_;

  // Workspace: what is known, and at which x.
  Eigen::VectorXd value_x_, derivative_x_;
  double cost_ = 0.0;
  Eigen::VectorXd cost_gradient_;
  std::vector<double> node_cost_hessian_;  ///< [node x z x z]
  std::vector<double> path_value_;         ///< [node x path rows]
  std::vector<double> path_jacobian_;      ///< [node x path rows x z]
  Eigen::VectorXd z_, z_gradient_, path_multiplier_, terminal_jacobian_value_;
  std::vector<double> block_, terminal_block_;
};

/// Position and velocity of a motion at any instants; at rest in its first and last posture outside its time.
/// Accelerations are those that make qd piecewise linear between the instants.
Trajectory resampled(const Trajectory& motion, const Eigen::VectorXd& t);

/// The same path driven uniformly faster or slower, beginning at the same instant.
Trajectory with_duration(const Trajectory& motion, double duration);

}  // namespace sparflow
