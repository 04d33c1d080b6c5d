#pragma once
/// Working pressure of one cylinder in one direction as a Gaussian process of (flow, static force):
///   p(Q, F) = m0 + m1 F + m2 Q + max(0, S - V) + sum_j w_j s^2 exp(-1/2 [((Q-Q_j)/l_Q)^2 + ((F-F_j)/l_F)^2])
/// Source: Rasmussen & Williams (2006), ch. 2.2, 2.7; sparse form: Titsias (2009), eqs. 6 and 9.
/// The mean is linear in F because a process with zero mean returns to a *low* pressure outside its data, which an
/// optimiser would exploit. max(0, S - V), where the samples show it, is the corner between the two branches of a supply
/// pressure (models/hydraulics/branch_corner.h). Beyond the learned loads the balance of forces continues the law where
/// it is known (models/hydraulics/loads_beyond.h).
#include <Eigen/Dense>

#include "models/hydraulics/branch_corner.h"
#include "models/hydraulics/gp_kernel.h"
#include "models/hydraulics/loads_beyond.h"

namespace sparflow {

/// Value, gradient and Hessian of a pressure (or its variance) with respect to (flow, force), SI.
struct GpDerivatives {
  double value = 0.0;  ///< [Pa]
  double d_flow = 0.0, d_force = 0.0;
  double d_flow_flow = 0.0, d_flow_force = 0.0, d_force_force = 0.0;
};

/// What a pressure model consists of.
enum class PressureLaw {
  kPlaneAndProcess,  ///< a plane and a Gaussian process about it
  kPlane  ///< a plane in flow and force, which predicts other motions not worse; all weights are zero
};

/// "plane" or "plane + process"
const char* pressure_law_name(PressureLaw law);

/// All parameters of the process, as stored in the model file. SI units.
struct GpParameters {
  double length_flow = 1.0;      ///< [m^3/s]
  double length_force = 1.0;     ///< [N]
  double signal_std = 1.0;       ///< [Pa]
  double noise_std = 1.0;        ///< [Pa], one measurement
  double mean_constant = 0.0;    ///< [Pa]
  double mean_slope = 0.0;       ///< [Pa/N]
  double mean_flow_slope = 0.0;  ///< [Pa s/m^3]; 0 where the mean is a line in the force
  Eigen::ArrayXd flow;           ///< [m^3/s] centres (all data, or inducing points)
  Eigen::ArrayXd force;          ///< [N] centres
  Eigen::ArrayXd weight;         ///< [1/Pa] so that signal_std^2 * weight is a pressure
  /// Latent variance is signal_std^2 - b^T C b with b = [k; 1; F] or, where the mean has a slope over the flow,
  /// [k; 1; F; Q], k the kernel vector at the n centres [Pa^2] and C this symmetric matrix, (n+2) x (n+2) or
  /// (n+3) x (n+3). Its last rows and columns are the uncertainty of the mean's coefficients, so that the variance
  /// grows far outside the data (Rasmussen & Williams 2006, eq. 2.42). Empty: the variance is not known, and signal_std^2 is returned.
  Eigen::MatrixXd variance_core;
  /// Range of the data [m^3/s], [N]; outside it the mean extrapolates and the variance grows.
  double flow_min = 0.0, flow_max = 0.0, force_min = 0.0, force_max = 0.0;
  PressureLaw law = PressureLaw::kPlaneAndProcess;
  int data_count = 0;   ///< number of measurements it was learned from
  BranchCorner corner;  ///< part of the mean
  LoadsBeyond beyond;   ///< outside force_min .. force_max
};

/// Objects are immutable and can be shared between threads. Evaluation allocates nothing, except that the variance keeps
/// one scratch array for each thread, which grows to the largest process that the thread has evaluated.
class GaussianProcess {
 public:
  GaussianProcess() = default;
  /// @throws InputError when sizes disagree, a length or deviation is not positive or a value not finite
  explicit GaussianProcess(GpParameters parameters);

  /// @param flow [m^3/s], always positive  @param force static force [N]  @return pressure [Pa]
  double mean(double flow, double force) const;
  /// Mean with exact first and second derivatives in one pass over the centres.
  GpDerivatives mean_derivatives(double flow, double force) const;
  /// Latent predictive variance [Pa^2] (measurement noise not included).
  double variance(double flow, double force) const;
  /// The same with exact first and second derivatives.
  GpDerivatives variance_derivatives(double flow, double force) const;

  const GpParameters& parameters() const { return parameters_; }
  bool empty() const { return parameters_.weight.size() == 0; }
  /// Smallest range of force over which the mean is curved: by the kernel, at the corner or beyond the learned loads. [N]
  double force_scale() const;

 private:
  GpParameters parameters_;
  KernelCentres centres() const;
  bool is_beyond(double force) const {
    return parameters_.beyond.side != 0 &&
           (force > parameters_.force_max || force < parameters_.force_min);
  }
  double learned_mean(double flow, double force) const;
  GpDerivatives learned_derivatives(double flow, double force) const;

  // Padded to whole vector registers; the weight is multiplied by the signal variance.
  Eigen::ArrayXd scaled_flow_, scaled_force_, scaled_weight_;
  double inverse_length_flow_ = 1.0, inverse_length_force_ = 1.0;
};

}  // namespace sparflow
