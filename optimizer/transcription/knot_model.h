#pragma once
/// Power and path constraints at one instant of a motion, with exact dense derivative blocks, as the transcription needs
/// them. Implemented by the crane (optimizer/crane/crane_knot_model.h) and by the reference problem (bench/).
#include <Eigen/Dense>
#include <string>

namespace sparflow {

/// z = [q; qd] (2 n values) or, when uses_acceleration(), [q; qd; qdd] (3 n values).
/// An object is a mutable workspace over an immutable model; each thread needs its own. No call allocates.
/// The transcription calls cost and then path, or cost_derivatives and then path_jacobian, at the same z, so that a model
/// can keep the kinematics of the last z.
class KnotModel {
 public:
  virtual ~KnotModel() = default;
  virtual int joint_count() const = 0;
  virtual bool uses_acceleration() const { return false; }
  int size() const { return joint_count() * (uses_acceleration() ? 3 : 2); }

  /// Called before every evaluation with the knot and the interval (knot - 1 or knot) whose law applies. A model whose
  /// law changes from interval to interval (modes) selects it here.
  virtual void begin_node(int /*knot*/, int /*interval*/) {}
  /// Whether the law differs on the two sides of this knot; the model is then evaluated once for each side.
  virtual bool split_at(int /*knot*/) const { return false; }

  /// Cost rate at z (power, in the problem's scaled unit).
  virtual double cost(const double* z) = 0;
  /// Cost rate, gradient [size] and full symmetric Hessian [size x size, column-major].
  virtual double cost_derivatives(const double* z, double* gradient, double* hessian) = 0;

  /// Path constraints lower <= g(z) <= upper, the same at every knot.
  virtual int path_count() const { return 0; }
  virtual void path_bounds(double* /*lower*/, double* /*upper*/) const {}
  /// Whether row `row` depends on the velocities (rows that do not get a narrower Jacobian block).
  virtual bool path_uses_velocity(int /*row*/) const { return true; }
  /// Whether row `row` depends on the accelerations. Rows that do are imposed at both ends of every
  /// interval with that interval's qdd, the others once a knot.
  virtual bool path_uses_acceleration(int /*row*/) const { return uses_acceleration(); }
  /// Whether row `row` is imposed at this knot (limits that hold at the end or at stops only).
  virtual bool path_imposed_at(int /*row*/, int /*knot*/) const { return true; }
  /// Name for messages, e.g. "flow of pump main".
  virtual std::string path_name(int row) const { return "path row " + std::to_string(row); }
  virtual void path(const double* /*z*/, double* /*g*/) {}
  /// Values and Jacobian [path_count x size, row-major].
  virtual void path_jacobian(const double* /*z*/, double* /*g*/, double* /*jacobian*/) {}
  /// Adds sum_row multiplier[row] * Hessian of row to `hessian` [size x size, column-major].
  virtual void add_path_hessian(const double* /*z*/, const double* /*multiplier*/,
                                double* /*hessian*/) {}
};

/// Equalities that couple both ends of an interval: further dynamics of the joints' motion, for example of a load that hangs
/// from the tip. Each row is linear in the interval's acceleration, a function of the positions at both ends, and has no mixed
/// derivatives, so that its Hessian lies in the blocks of the two knots.
class IntervalModel {
 public:
  virtual ~IntervalModel() = default;
  /// Rows of an interval; each is to vanish.
  virtual int count() const = 0;
  /// @param q0, q1 [n] positions at both ends  @param qdd [n] acceleration of the interval
  struct Ends {
    const double* q0;
    const double* q1;
    const double* qdd;
  };
  virtual void value(int interval, const Ends& at, double* g) = 0;
  /// [count x 3 n, row-major], columns q0, q1, qdd
  virtual void jacobian(int interval, const Ends& at, double* jacobian) = 0;
  /// Adds sum_row multiplier[row] * Hessian to the blocks of q0 and q1 [n x n each, column-major].
  virtual void add_hessian(int interval, const Ends& at, const double* multiplier, double* hessian0,
                           double* hessian1) = 0;
  /// Name for messages.
  virtual std::string name(int row) const { return "interval row " + std::to_string(row); }
};

/// Equality or range constraints on the last configuration (tip at the goal, or none).
class TerminalModel {
 public:
  virtual ~TerminalModel() = default;
  virtual int count() const = 0;
  virtual void bounds(double* lower, double* upper) const = 0;
  virtual void value(const double* q, double* g) = 0;
  /// [count x n, row-major]
  virtual void jacobian(const double* q, double* jacobian) = 0;
  /// Adds sum_row multiplier[row] * Hessian to `hessian` [n x n, column-major].
  virtual void add_hessian(const double* q, const double* multiplier, double* hessian) = 0;
  /// Name for messages, e.g. "x of the tip at the goal".
  virtual std::string name(int row) const { return "goal row " + std::to_string(row); }
};

}  // namespace sparflow
