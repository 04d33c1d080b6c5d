#pragma once
/// The crane's law at a knot with derivatives by other methods, to measure the gain of those derived by hand.
#include <memory>

#include "optimizer/crane/crane_knot_model.h"

namespace sparflow::bench {

/// Forwards all calls to another model.
class WrappedKnotModel : public KnotModel {
 public:
  explicit WrappedKnotModel(std::shared_ptr<KnotModel> inner) : inner_(std::move(inner)) {}
  int joint_count() const override { return inner_->joint_count(); }
  bool uses_acceleration() const override { return inner_->uses_acceleration(); }
  void begin_node(int knot, int interval) override { inner_->begin_node(knot, interval); }
  bool split_at(int knot) const override { return inner_->split_at(knot); }
  double cost(const double* z) override { return inner_->cost(z); }
  double cost_derivatives(const double* z, double* gradient, double* hessian) override {
    return inner_->cost_derivatives(z, gradient, hessian);
  }
  int path_count() const override { return inner_->path_count(); }
  void path_bounds(double* lower, double* upper) const override {
    inner_->path_bounds(lower, upper);
  }
  bool path_uses_velocity(int row) const override { return inner_->path_uses_velocity(row); }
  bool path_uses_acceleration(int row) const override {
    return inner_->path_uses_acceleration(row);
  }
  std::string path_name(int row) const override { return inner_->path_name(row); }
  void path(const double* z, double* g) override { inner_->path(z, g); }
  void path_jacobian(const double* z, double* g, double* jacobian) override {
    inner_->path_jacobian(z, g, jacobian);
  }
  void add_path_hessian(const double* z, const double* multiplier, double* hessian) override {
    inner_->add_path_hessian(z, multiplier, hessian);
  }

 protected:
  std::shared_ptr<KnotModel> inner_;
};

/// Replaces derivatives of cost and path: central differences for first, four-point ones for second derivatives.
std::shared_ptr<KnotModel> with_finite_differences(std::shared_ptr<KnotModel> inner);

/// Replaces the cost's gradient and Hessian by those of ADOL-C (Griewank, Juedes and Utke 1996), with one tape for each
/// set of modes, recorded at its first use and then replayed; derivatives of path rows stay as they are.
/// @param model without effects; every cylinder's mode is held  @param options of the wrapped model
/// @return null when the program was built without ADOL-C
std::shared_ptr<KnotModel> with_adolc(const CraneModel& model, const MotionProblem& problem,
                                      const CraneKnotOptions& options,
                                      std::shared_ptr<KnotModel> inner);

/// Returns the largest difference of two models' cost gradients and Hessians at random points, relative to the largest
/// entry of each. @param points number of points
double largest_difference(KnotModel& a, KnotModel& b, const MotionProblem& problem,
                          const ModeTable& modes, int points);

}  // namespace sparflow::bench
