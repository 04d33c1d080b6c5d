#pragma once
/// The reference NLP: one energy-optimal reach of a planar three-cylinder crane in which every number is fixed
/// (bench/data/reference_problem.json; equations in docs/transcription.md). Activation and direction are smoothed, so
/// that it is one smooth problem. It serves to test derivative code and speed, not to compute motions.
///
/// Units of this problem, unlike the rest of the program: flow l/min, force kN, pressure bar, power kW,
/// energy kJ; angles rad, lengths m, speeds m/s.
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "models/hydraulics/gp_kernel.h"
#include "optimizer/transcription/transcription.h"

namespace sparflow::bench {

/// Pressure model of one cylinder in one direction: P = sum_j weight_j exp(-1/2 |(Q, F)/l - centre_j|^2) [bar].
struct ReferenceGp {
  double inverse_length_flow = 0.0;   ///< [min/l]
  double inverse_length_force = 0.0;  ///< [1/kN]
  std::vector<double> flow,
      force;                   ///< [-] centres divided by the length-scales, padded for the kernel
  std::vector<double> weight;  ///< [bar] sf2 * alpha
  /// |P(Q, F)| <= bound everywhere [bar]: the norm sqrt(w^T K w) of P in the kernel's Hilbert space, as
  /// |P(x)| = |<P, k(x, .)>| <= |P| sqrt(k(x, x)) and k(x, x) = 1.
  double bound = 0.0;

  KernelCentres centres() const {
    return {flow.data(), force.data(), weight.data(), weight.size()};
  }
};

struct ReferenceProblem {
  double duration = 0.0;  ///< [s]
  int intervals = 0;
  double gravity = 0.0;
  std::array<double, 2> base{};
  double L1 = 0.0, L2 = 0.0;
  double m_inner = 0.0, s_inner = 0.0, m_outer = 0.0, s_outer = 0.0, m_tele = 0.0, s_tele0 = 0.0,
         s_tele1 = 0.0, m_payload = 0.0;
  double a1 = 0.0, b1 = 0.0, alpha1 = 0.0, a2 = 0.0, b2 = 0.0, alpha2 = 0.0;
  std::array<double, 3> area_piston{}, area_rod{};            ///< [m^2]
  double eps_v = 0.0;                                         ///< [m/s]
  double q_eps = 0.0;                                         ///< [l/min]
  double standby = 0.0, margin = 0.0, lse_temperature = 0.0;  ///< [bar]
  double q_total_max = 0.0;                                   ///< [l/min]
  double w_acc = 0.0;
  std::array<double, 3> q_lb{}, q_ub{}, qd_lb{}, qd_ub{}, qdd_lb{}, qdd_ub{};
  std::array<double, 3> q_start{}, q_goal_guess{};
  std::array<double, 2> goal{};                  ///< [m] x, z
  std::array<std::array<ReferenceGp, 2>, 3> gp;  ///< [cylinder][extend, retract]
};

/// Reads the problem file. @throws InputError with file and key when it cannot be read, is not JSON or lacks a key
ReferenceProblem read_reference_problem(const std::string& path);

/// Power [kW] of one instant at z = [th1, th2, d, and their rates], with the total flow as path constraint.
class ReferenceKnot final : public KnotModel {
 public:
  explicit ReferenceKnot(std::shared_ptr<const ReferenceProblem> problem);

  /// Intermediate quantities between z and the power, for tests.
  struct State {
    std::array<double, 3> force, flow, pressure;  ///< [kN], [l/min], [bar]
    double pump = 0.0, power = 0.0;               ///< [bar], [kW]
  };
  State state(const double* z);

  int joint_count() const override { return 3; }
  double cost(const double* z) override;
  double cost_derivatives(const double* z, double* gradient, double* hessian) override;
  int path_count() const override { return 1; }
  void path_bounds(double* lower, double* upper) const override;
  std::string path_name(int) const override { return "total flow"; }
  void path(const double* z, double* g) override;
  void path_jacobian(const double* z, double* g, double* jacobian) override;
  void add_path_hessian(const double* z, const double* multiplier, double* hessian) override;

 private:
  /// Transmission ratio c' = d length / d joint of one cylinder, and its derivatives.
  struct Rate {
    double ratio = 1.0, d = 0.0, dd = 0.0;
  };
  /// Functions of one cylinder's speed: direction weights and flow, with derivatives with respect to the speed.
  struct Speed {
    double extend, retract;  ///< w and 1 - w, both accurate when tiny
    double d_extend, dd_extend;
    double flow, d_flow, dd_flow;  ///< [l/min]
  };
  struct Kinematics {
    std::array<double, 6> z;
    double sin_1, cos_1, sin_phi, cos_phi;
    std::array<Rate, 3> rate;
    std::array<Speed, 3> speed;
    double flow;  ///< [l/min] total
  };
  /// Pressure blended over the directions, margin included, with derivatives with respect to (v, F).
  struct Demand {
    double value, d_v, d_f, d_vv, d_vf, d_ff;
  };
  const Kinematics& kinematics(const double* z);
  Speed speed(std::size_t i, double v) const;
  std::array<double, 3> forces(const Kinematics& kin) const;
  Demand demand(std::size_t i, const Speed& s, double force) const;
  double pump_pressure(const std::array<double, 3>& demand, double* share) const;

  std::shared_ptr<const ReferenceProblem> problem_;
  double gS_inner_, gS_fixed_, gS_slide_;        ///< moments of weight [Nm], [Nm], [N]
  std::array<double, 2> angle_sin_, angle_cos_;  ///< of the linkage offsets
  std::array<double, 3> negligible_;  ///< weight below which a direction is not evaluated
  Kinematics last_;                   ///< of the last z
};

/// Terminal constraint: the tip is at the goal, x and z [m].
class ReferenceGoal final : public TerminalModel {
 public:
  explicit ReferenceGoal(std::shared_ptr<const ReferenceProblem> problem)
      : problem_(std::move(problem)) {}
  int count() const override { return 2; }
  void bounds(double* lower, double* upper) const override;
  void value(const double* q, double* g) override;
  void jacobian(const double* q, double* jacobian) override;
  void add_hessian(const double* q, const double* multiplier, double* hessian) override;

 private:
  std::shared_ptr<const ReferenceProblem> problem_;
};

/// Makes the whole NLP with its initial guess.
Transcription reference_transcription(std::shared_ptr<const ReferenceProblem> problem);

}  // namespace sparflow::bench
