#pragma once
/// The machine as a KnotModel: power of its pumps under the smooth law and every limit that is not a plain
/// bound (pump flow, valves, pump pressure, clearance, tip line), with exact dense derivative blocks. A model's
/// effects are in it: masses and angles in the forces, laws by models/chain/smooth_effects.h, limits in the rows.
#include <memory>
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/chain/smooth_effects.h"
#include "models/chain/smooth_power.h"
#include "optimizer/transcription/knot_model.h"
#include "problems/clearance.h"
#include "problems/problem.h"

namespace sparflow {

/// Rod speed at full command. [m/s]
struct FullSpeed {
  double extend = 0.0, retract = 0.0;
  /// Command that drives the rod at `speed`; its square has a kink in the second derivative at rest only.
  double command(double speed) const { return speed / (speed > 0.0 ? extend : retract); }
};

/// By cylinder: through its valve where one is known, else at its joint's velocity limit in the middle of its range.
std::vector<FullSpeed> full_speeds(const Machine& machine, const MotionLimits& limits);

/// Mode of every cylinder in every interval, [intervals x cylinders].
using ModeTable = Eigen::Matrix<CylinderMode, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct CraneKnotOptions {
  Smoothing smoothing;
  double energy_weight = 1.0;   ///< [-] factor on the power
  double command_weight = 0.0;  ///< [W] factor on the sum of the squared commands
  ModeTable modes;              ///< empty = every cylinder free everywhere
  /// Shares of the limits that may be used, slightly below one so that they also hold between knots.
  double flow_share = 1.0;
  double valve_share = 1.0;
  double pressure_share = 1.0;
  double extra_clearance = 0.0;  ///< [m]
  /// Postures known to be clear by the exact distance, one a row. The smooth clearance rows are conservative by
  /// some centimetres; none asks for more than it has there, or a goal near an obstacle could not be reached.
  Eigen::MatrixXd clear_postures;
  /// Postures the solve starts from, one a row: only clearance rows within kNearRow of zero in one of them are
  /// imposed (all, when there is none). Whoever solves checks the exact distance afterwards.
  Eigen::MatrixXd near_postures;
  double tip_line_share = 1.0;
  /// Rows for the pumps' pressure limits cost a second evaluation of the processes; they are only asked for
  /// when a motion without them came too near.
  bool limit_pressure = false;
  double trust_share = 1.0;  ///< of the trusted standard deviation (MotionLimits::pressure_std)
  double oil = 40.0;         ///< [degC] for effects that look at it
};

/// Cost is in kW, flows in l/s, speeds in units of the limit, pressures in 100 bar, lengths in m: all
/// near one, as the solver likes it.
class CraneKnotModel final : public KnotModel {
 public:
  /// The references must outlive the object.
  CraneKnotModel(const CraneModel& model, const MotionProblem& problem, CraneKnotOptions options);

  int joint_count() const override { return n_; }
  /// True when an effect of the model depends on the joint accelerations.
  bool uses_acceleration() const override { return effects_ && effects_->uses_acceleration(); }
  void begin_node(int knot, int interval) override;
  bool split_at(int knot) const override;
  double cost(const double* z) override;
  double cost_derivatives(const double* z, double* gradient, double* hessian) override;
  int path_count() const override { return static_cast<int>(rows_.size()) + clearance_rows_; }
  void path_bounds(double* lower, double* upper) const override;
  bool path_uses_velocity(int row) const override;
  bool path_uses_acceleration(int row) const override;
  std::string path_name(int row) const override;
  void path(const double* z, double* g) override;
  void path_jacobian(const double* z, double* g, double* jacobian) override;
  void add_path_hessian(const double* z, const double* multiplier, double* hessian) override;

 private:
  enum class RowKind { kPumpFlow, kValve, kPumpPressure, kTipLine, kTrust };
  struct Row {
    RowKind kind;
    int index;  // pump or cylinder
    double lower, upper;
  };

  /// Speeds, forces (of `order` derivatives) and the joint-space derivatives of both.
  void update(const double* z, int order, bool forces);
  /// gradient += D^T g and hessian += D^T H D + sum g_a Hess(z_a), for a function of (v, F).
  void chain_gradient(const double* g, double* gradient) const;
  void chain_hessian(const double* z, const double* g, const Eigen::MatrixXd& h, double* hessian);
  /// The law with effects at z, unless it was evaluated there last.
  void update_effects(const double* z, bool derivatives);
  /// Variance of a moving cylinder's pressure over the trusted one, with its derivatives in (v, F); 0 at rest.
  GpDerivatives trust(int cylinder) const;
  /// Adds weight * sum u_i^2 of the speeds last updated, and its derivatives where they are asked for. [kW]
  double add_commands(const double* z, double* gradient, double* hessian);
  double tip_line(const double* q, double* gradient, double* hessian, double factor);
  void choose_clearance_rows();
  void path_all(const double* z, double* g, double* jacobian);

  const CraneModel* model_;
  const MotionProblem* problem_;
  std::shared_ptr<const Machine>
      machine_;  // that carries the loads; goals and obstacles are the problem's
  CraneKnotOptions options_;
  int n_, m_;
  bool trusts_ = false;
  SmoothPower power_;
  std::unique_ptr<SmoothEffects> effects_;  // for a model with effects that act in a motion
  Eigen::VectorXd effects_z_;               // where it was evaluated last, with
  std::vector<CylinderMode> effects_mode_;  // these modes and
  bool effects_derivatives_ = false;
  StaticForce statics_;
  ChainGeometry tip_chain_;
  std::vector<Row> rows_;
  std::unique_ptr<ClearanceModel> clearance_;
  int clearance_rows_ = 0;
  std::vector<int> near_rows_;       // of the clearance model, those imposed
  Eigen::VectorXd clearance_lower_;  // [m] of those
  Eigen::VectorXd all_clearance_, all_multipliers_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> all_clearance_jacobian_;
  Eigen::Vector3d line_start_, line_direction_;
  std::vector<CylinderMode> mode_;
  std::vector<FullSpeed> full_speed_;
  Eigen::VectorXd speed_, force_, scratch_gradient_;
  std::vector<Taylor3> length_;
  Eigen::MatrixXd jacobian_;  // d(v, F)/dz, [2 m x 2 n]
  Eigen::MatrixXd scratch_hessian_, product_, outer_;
  Eigen::Matrix3Xd tip_jacobian_;
};

/// The tip (in the directions in which it can move) at a goal point [m].
class TipAtGoal final : public TerminalModel {
 public:
  TipAtGoal(const Machine& machine, const Eigen::Vector3d& goal);
  int count() const override { return static_cast<int>(directions_.size()); }
  void bounds(double* lower, double* upper) const override;
  void value(const double* q, double* g) override;
  void jacobian(const double* q, double* jacobian) override;
  void add_hessian(const double* q, const double* multiplier, double* hessian) override;
  /// "z of the tip at its goal (3.5 m)", or the direction where it is none of the base frame's axes.
  std::string name(int row) const override;

 private:
  const Machine* machine_;
  ChainGeometry chain_;
  Eigen::Vector3d goal_;
  std::vector<Eigen::Vector3d> directions_;  // orthonormal, in which the tip is free
};

}  // namespace sparflow
