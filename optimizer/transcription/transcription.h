#pragma once
/// Direct transcription of a motion with piecewise constant acceleration into a sparse NLP.
///   variables   x = [q_0 .. q_N, qd_0 .. qd_N, qdd_0 .. qdd_{N-1}], n values each
///   minimise    sum_k h_k/2 (c(z_k) + c(z_{k+1})) + sum_k,i w_i qdd_{k,i}^2 [h_k]
///   subject to  q_{k+1}  = q_k + h_k/2 (qd_k + qd_{k+1})      (exact, not an approximation)
///               qd_{k+1} = qd_k + h_k qdd_k                   (exact)
///               terminal(q_N), path(z_k), bounds on every single variable
/// Only the cost integral is approximate (trapezoidal rule). A model that uses the acceleration is evaluated at both ends
/// of each interval with the interval's own qdd, because qdd jumps at the knots.
/// With free times, x ends in tau_0 .. tau_{P-1}: the intervals of phase p keep their shares of tau_p, and
///   h_k = share_k tau_p,   total_lower <= sum tau <= total_upper,   price sum tau is added to the objective.
/// Source: Betts (2010), Practical Methods for Optimal Control, ch. 4; equations and layout: docs/transcription.md.
#include <memory>
#include <vector>

#include "models/machine/trajectory.h"
#include "optimizer/nlp/nlp_problem.h"
#include "optimizer/transcription/knot_model.h"

namespace sparflow {

/// One row for each instant (q, qd: N+1 rows; qdd: N rows), one column for each joint. Equal bounds fix a value: two zeros
/// hold a joint at rest, one zero fixes the sign of its velocity.
struct TranscriptionBounds {
  Eigen::MatrixXd q_lower, q_upper;      ///< [rad] or [m]
  Eigen::MatrixXd qd_lower, qd_upper;    ///< [rad/s] or [m/s]
  Eigen::MatrixXd qdd_lower, qdd_upper;  ///< [rad/s^2] or [m/s^2]

  struct Box {
    Eigen::VectorXd lower, upper;  ///< [n]
  };
  /// The same bounds at every instant.
  static TranscriptionBounds uniform(int intervals, const Box& q, const Box& qd, const Box& qdd);
  void fix_q(int knot, const Eigen::VectorXd& q);
  void fix_qd(int knot, const Eigen::VectorXd& qd);
  /// Fixes the start at rest in q_start and the end at rest.
  void rest_to_rest(const Eigen::VectorXd& q_start);
};

/// Free durations of groups of intervals ("phases"). The instants at which modes change are thereby optimised, and the
/// motion's duration too if the total is free.
struct PhaseTimes {
  /// [N] phase of every interval, 0, .., 0, 1, .., P-1; empty = the knots are fixed at TranscriptionSpec::t.
  std::vector<int> of_interval;
  Eigen::VectorXd lower, upper;   ///< [P] of each duration [s], lower > 0
  double total_lower = 0.0;       ///< [s]
  double total_upper = kNoBound;  ///< [s]
  double price = 0.0;             ///< cost of time (idle power), in the unit of the cost rate
  int count() const { return of_interval.empty() ? 0 : of_interval.back() + 1; }
};

/// A configuration constraint at one knot.
struct Waypoint {
  int knot = 0;
  std::shared_ptr<TerminalModel> model;
};

struct TranscriptionSpec {
  Eigen::VectorXd
      t;  ///< [s] the N+1 knots, increasing, any spacing; with free times their initial values
  std::shared_ptr<KnotModel> knot;
  std::shared_ptr<TerminalModel> terminal;  ///< null = only the bounds restrict the end posture
  std::vector<Waypoint> waypoints;
  std::shared_ptr<IntervalModel> interval;  ///< null = no further dynamics
  PhaseTimes phases;
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
  Eigen::VectorXd terminal;      ///< [rows of the terminal model, then of the waypoints]
  Eigen::MatrixXd interval;      ///< [N x rows of the interval model]
  Eigen::MatrixXd path;          ///< [nodes x path rows], zero where a row is not imposed
  Eigen::VectorXd lower, upper;  ///< of the bounds, laid out as x
  double total_time = 0.0;       ///< of total_lower <= sum tau <= total_upper
};

class Transcription final : public NlpProblem {
 public:
  /// Checks shapes. The models are used as workspaces by every later call.
  explicit Transcription(TranscriptionSpec spec);

  int joint_count() const { return n_; }
  int interval_count() const { return intervals_; }
  const TranscriptionSpec& spec() const { return spec_; }

  // Index of a value in x.
  int q_index(int knot, int joint) const { return knot * n_ + joint; }
  int qd_index(int knot, int joint) const { return (knots_ + knot) * n_ + joint; }
  int qdd_index(int interval, int joint) const { return (2 * knots_ + interval) * n_ + joint; }
  int tau_index(int phase) const { return (2 * knots_ + intervals_) * n_ + phase; }

  /// Start values; before the first call they are the middle of the bounds (0 where a side is open).
  void set_start(const Eigen::VectorXd& x);
  /// Start from a motion sampled on this mesh: q and qd from the motion (at rest beyond its ends), qdd such that the
  /// velocity defects vanish. With free times a motion with as many knots is taken unsampled, with its phases' durations.
  /// Values outside their bounds are clipped.
  void set_start(const Trajectory& motion);
  /// Multipliers for a warm start; their shapes must be this transcription's.
  void set_start_multipliers(const TranscriptionMultipliers& multipliers);
  void clear_start_multipliers() { start_multipliers_.reset(); }

  Eigen::VectorXd variables(const Trajectory& motion) const;
  Trajectory trajectory(const Eigen::VectorXd& x) const;
  TranscriptionMultipliers multipliers(const NlpMultipliers& rows) const;
  /// Integral of the model's cost alone, without the acceleration term and the price of time.
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
    int interval = -1;  ///< interval whose qdd is used; -1 = the model does not use qdd
    int before =
        -1;          ///< interval on the left that contributes half a step to the weight; -1 = none
    int after = -1;  ///< the same on the right
    int first_row = 0;  ///< index in g of this node's first path row
    int law = 0;        ///< interval whose law applies
    /// false: only rows that use the acceleration; another node of the knot has the others
    bool all_rows = true;
    int rows = 0;  ///< of row_sets_
  };
  struct Defect {
    int interval, joint;
    bool velocity;  ///< true: defect of qd, false: of q
  };

  /// A terminal model at its knot, with the indices of its rows in g and of its entries in the derivatives.
  struct Point {
    int knot = 0;
    TerminalModel* model = nullptr;
    int count = 0, row = 0, jacobian = 0;
    std::vector<int> hessian;  // [lower triangle of q, column by column]
  };

  Eigen::VectorXd variables_on_mesh(const Trajectory& motion) const;
  void check_phases() const;
  int phase(int interval) const {
    return spec_.phases.of_interval[static_cast<std::size_t>(interval)];
  }
  /// h_k at x. [s]
  double step(const double* x, int interval) const {
    return phase_count_ == 0 ? step_[interval] : x[tau_index(phase(interval))] * share_[interval];
  }
  /// Weight of a node in the trapezoid at x. [s]
  double weight(const Node& node, const double* x) const;
  void time_gradient(const double* x, Out gradient) const;
  void time_hessian(const double* x, double objective_factor, const double* multiplier,
                    Out value) const;
  void make_nodes();
  void make_points();
  void make_row_sets();
  void place_nodes();
  void make_defects();
  void make_jacobian();
  void make_hessian();
  int global_index(const Node& node, int local) const;
  const std::vector<int>& rows_of(const Node& node) const;
  void gather(const Node& node, const double* x, double* z) const;
  double acceleration_factor(const double* x, int interval, int joint) const;
  double acceleration_cost(const double* x) const;
  IntervalModel::Ends ends(const double* x, int interval) const {
    return {x + q_index(interval, 0), x + q_index(interval + 1, 0), x + qdd_index(interval, 0)};
  }
  void add_interval_hessian(const double* x, const double* multiplier, Out value);
  void update_values(const double* x);
  void update_derivatives(const double* x);
  std::string joint_name(int joint) const;

  TranscriptionSpec spec_;
  int n_, knots_, intervals_, phase_count_, z_size_, terminal_count_ = 0, path_count_;
  bool with_acceleration_;
  Eigen::VectorXd step_;   ///< [s] h_k of spec_.t
  Eigen::VectorXd share_;  ///< [N] h_k / tau of its phase, with free times
  std::vector<Point> points_;
  std::vector<Node> nodes_;
  std::vector<Defect> defects_;  ///< in row order; rows between fixed variables are left out
  int terminal_row_ = 0, total_time_row_ = -1, row_count_ = 0;
  std::vector<int> all_rows_, acceleration_rows_;
  std::vector<std::vector<int>> row_sets_;  ///< path rows that a node can have
  int interval_rows_ = 0,
      first_interval_row_ = 0;  ///< rows of an interval; index in g of the first

  // Structure, and the values that never change.
  std::vector<int> jacobian_row_, jacobian_column_, hessian_row_, hessian_column_;
  Eigen::VectorXd jacobian_constant_;
  std::vector<std::vector<int>> row_columns_;   ///< per path row: the local indices it depends on
  int first_interval_jacobian_ = 0;             ///< first value of the interval rows
  std::vector<int> interval_hessian_;           ///< [N x 2 ends x lower triangle of q]
  int first_path_jacobian_ = 0;                 ///< first value of the path blocks, node by node
  std::vector<int> node_hessian_;               ///< [node x lower triangle of z, column by column]
  std::vector<int> acceleration_hessian_;       ///< [N x n] diagonal of qdd
  std::vector<int> time_node_hessian_;          ///< [node x sides x z] tau against z
  std::vector<int> time_defect_hessian_;        ///< [defect x 2 or 1] tau against qd, qdd
  std::vector<int> time_acceleration_hessian_;  ///< [N x n] tau against qdd

  Eigen::VectorXd start_;
  std::unique_ptr<NlpMultipliers> start_multipliers_;

  // Workspace: the last evaluations and their x.
  Eigen::VectorXd value_x_, derivative_x_;
  double cost_ = 0.0;
  Eigen::VectorXd cost_gradient_;
  std::vector<double> node_cost_, node_cost_gradient_;  ///< [node], [node x z], with free times
  std::vector<double> node_cost_hessian_;               ///< [node x z x z]
  std::vector<double> path_value_;                      ///< [node x path rows]
  std::vector<double> path_jacobian_;                   ///< [node x path rows x z]
  Eigen::VectorXd z_, path_multiplier_, terminal_jacobian_value_;
  std::vector<double> block_, terminal_block_, interval_block_;  ///< the last: of both ends
  Eigen::VectorXd interval_jacobian_value_;
};

/// The motion at other instants; before its first and after its last instant it is at rest in that posture.
/// Its accelerations make qd piecewise linear between the new instants. @param t [s] increasing
Trajectory resampled(const Trajectory& motion, const Eigen::VectorXd& t);

/// The same motion uniformly stretched or compressed in time to `duration` [s], beginning at the same instant.
Trajectory with_duration(const Trajectory& motion, double duration);

}  // namespace sparflow
