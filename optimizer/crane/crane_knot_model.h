#pragma once
/// The machine as a KnotModel: power of its pumps under the smooth law and every limit that is not a bound on a variable
/// (pump flow, valves, pump pressure, clearance, tip line), with exact dense derivative blocks. The model's effects are
/// included: masses and angles in the forces, laws by models/chain/smooth_effects.h, limits in the rows.
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
  /// Command [-] that drives the rod at `speed`; the second derivative of its square jumps at rest only.
  double command(double speed) const { return speed / (speed > 0.0 ? extend : retract); }
};

/// Full speeds by cylinder: from the valve's full flow, else from the joint's velocity limit in the middle of its range.
std::vector<FullSpeed> full_speeds(const Machine& machine, const MotionLimits& limits);

/// Mode of every cylinder in every interval, [intervals x cylinders].
using ModeTable = Eigen::Matrix<CylinderMode, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct CraneKnotOptions {
  Smoothing smoothing;
  double energy_weight = 1.0;    ///< [-] factor on the power
  double command_weight = 0.0;   ///< [W] factor on the sum of the squared commands
  ModeTable modes;               ///< empty = every cylinder free everywhere
  std::vector<double> payloads;  ///< [kg] by interval; empty = the problem's everywhere
  /// Shares of the limits that may be used [-]; bound tightening sets them below one.
  double flow_share = 1.0;
  double valve_share = 1.0;
  double pressure_share = 1.0;
  double extra_clearance = 0.0;  ///< [m]
  /// Postures that are clear by the exact distance, one in each row. The smooth clearance rows are conservative by some
  /// centimetres; their lower bounds are lowered to their values there, or a goal near an obstacle could not be reached.
  Eigen::MatrixXd clear_postures;
  /// Postures of a motion that is clear by the exact distance, one in each row. Rows are lowered to their values there too, so
  /// that this motion keeps them; `extra_clearance` is added, as the exact check may refuse what the lower rows allow.
  Eigen::MatrixXd clear_motion;
  /// Postures the solve starts from, one in each row: only clearance rows within kNearRow of zero in one of them are
  /// imposed (all of them if this is empty). The caller must check the exact distance afterwards.
  Eigen::MatrixXd near_postures;
  /// Postures of a motion on the knots, one in each row: clearance is kept by planes between machine and obstacles as they are in
  /// these postures, instead of the smooth rows. Empty = smooth rows.
  Eigen::MatrixXd plane_postures;
  double tip_line_share = 1.0;
  /// Whether to impose the pumps' pressure limits. Their rows need a second evaluation of the pressure models, so they
  /// are added only after a motion without them came too near a limit.
  bool limit_pressure = false;
  /// Share of the largest standard deviation allowed (MotionLimits::pressure_std).
  double trust_share = 1.0;
  /// Oil temperature for effects that depend on it. [degC]
  double oil = 40.0;  // no threshold: a state of the machine, kReference of oil_temperature.cpp
};

/// Cost is in kW, flows in l/s, speeds in units of the limit, pressures in 100 bar, lengths in m, so that all values are
/// near one and the NLP is well scaled.
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

  /// Computes speeds, forces (with derivatives up to `order`) and the joint-space derivatives of both.
  void update(const double* z, int order, bool forces);
  /// gradient += D^T g and hessian += D^T H D + sum g_a Hess(z_a), for a function of (v, F).
  void chain_gradient(const double* g, double* gradient) const;
  void chain_hessian(const double* z, const double* g, const Eigen::MatrixXd& h, double* hessian);
  /// Evaluates the law with effects at z, unless z is that of the last evaluation.
  void update_effects(const double* z, bool derivatives);
  /// Variance of a moving cylinder's pressure over the variance allowed, with derivatives in (v, F); 0 at rest.
  GpDerivatives trust(int cylinder) const;
  /// Adds weight * sum u_i^2 at the speeds last updated, and its derivatives unless their pointers are null. [kW]
  double add_commands(const double* z, double* gradient, double* hessian);
  double tip_line(const double* q, double* gradient, double* hessian, double factor);
  void choose_clearance_rows();
  /// Value of one row at the state last updated. @param gradient [2 n or 3 n] its derivatives in z, zero before; may be null
  double path_row(const Row& row, const double* z, double* gradient);
  double pump_flow_row(int pump, double* gradient) const;
  double valve_row(int cylinder, double* gradient) const;
  double pump_pressure_row(int pump, double* gradient);
  double trust_row(int cylinder, double* gradient);
  /// @param jacobian [clearance rows x size()]; may be null
  void clearance_rows(const double* z, double* g, double* jacobian);
  /// @param jacobian [path_count() x size()]; may be null
  void path_all(const double* z, double* g, double* jacobian);

  const CraneModel* model_;
  const MotionProblem* problem_;
  std::shared_ptr<const Machine>
      machine_;  // with the effects' masses; goals and obstacles are taken from the problem
  CraneKnotOptions options_;
  int n_, m_;
  bool trusts_ = false;
  SmoothPower power_;
  std::unique_ptr<SmoothEffects> effects_;  // null when no effect of the model acts in a motion
  Eigen::VectorXd effects_z_;               // z of the last evaluation of effects_,
  std::vector<CylinderMode> effects_mode_;  // its modes, and whether derivatives were computed
  double effects_payload_ = 0.0;
  bool effects_derivatives_ = false;
  StaticForce statics_;
  ChainGeometry tip_chain_;
  std::vector<Row> rows_;
  std::unique_ptr<ClearanceModel> clearance_;
  int clearance_rows_ = 0;
  std::vector<int> near_rows_;       // rows of the clearance model that are imposed
  Eigen::VectorXd clearance_lower_;  // their lower bounds [m]
  Eigen::VectorXd all_clearance_, all_multipliers_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> all_clearance_jacobian_;
  Eigen::Vector3d line_start_, line_direction_;
  double payload_;  // [kg] of the interval selected last
  std::vector<CylinderMode> mode_;
  std::vector<FullSpeed> full_speed_;
  Eigen::VectorXd speed_, force_, scratch_gradient_;
  std::vector<Taylor3> length_;
  Eigen::MatrixXd jacobian_;  // d(v, F)/dz, [2 m x 2 n]
  Eigen::MatrixXd scratch_hessian_, product_, outer_;
  Eigen::Matrix3Xd tip_jacobian_;
};

/// Constraint that the tip is within a ball around a goal point.
class TipNearGoal final : public TerminalModel {
 public:
  /// @param tolerance radius of the ball [m], > 0
  TipNearGoal(const Machine& machine, const Eigen::Vector3d& goal, double tolerance);
  int count() const override { return 1; }
  void bounds(double* lower, double* upper) const override;
  /// The squared distance over the squared tolerance.
  void value(const double* q, double* g) override;
  void jacobian(const double* q, double* jacobian) override;
  void add_hessian(const double* q, const double* multiplier, double* hessian) override;
  std::string name(int row) const override;

 private:
  const Machine* machine_;
  ChainGeometry chain_;
  Eigen::Vector3d goal_;
  double scale_;
};

/// Constraint that the tip, in the directions in which it can move, is at a goal point [m].
class TipAtGoal final : public TerminalModel {
 public:
  TipAtGoal(const Machine& machine, const Eigen::Vector3d& goal);
  int count() const override { return static_cast<int>(directions_.size()); }
  void bounds(double* lower, double* upper) const override;
  void value(const double* q, double* g) override;
  void jacobian(const double* q, double* jacobian) override;
  void add_hessian(const double* q, const double* multiplier, double* hessian) override;
  /// "z of the tip at its goal (3.5 m)", or with the direction's components where it is no axis of the base frame.
  std::string name(int row) const override;

 private:
  const Machine* machine_;
  ChainGeometry chain_;
  Eigen::Vector3d goal_;
  std::vector<Eigen::Vector3d> directions_;  // orthonormal, in which the tip is free
};

}  // namespace sparflow
