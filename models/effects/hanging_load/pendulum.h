#pragma once
/// A weight on a rope below an accelerated point: the spherical pendulum of any deflection.
#include <Eigen/Dense>

namespace sparflow {

struct SwingDecay {
  double decay;         ///< [1/s] damping ratio times frequency
  double largest_step;  ///< [s] of integration
};

struct Pendulum {
  Eigen::Vector3d down, rate;  ///< unit vector from the point to the weight, its derivative [1/s]

  /// Second derivative of `down`. @param pull (g - acceleration) / rope [1/s^2]  @param decay damping ratio times frequency [1/s]
  Eigen::Vector3d slope(const Eigen::Vector3d& pull, double decay) const {
    return pull - down * (down.dot(pull) + rate.squaredNorm()) - 2.0 * decay * rate;
  }
  /// Moves by dt [s] while the pull changes linearly from one value to another.
  void move(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double dt,
            const SwingDecay& swing);

 private:
  Pendulum moved(const Eigen::Vector3d& by_down, const Eigen::Vector3d& by_rate) const {
    return {down + by_down, rate + by_rate};
  }
  void step(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double dt, double decay);
};

}  // namespace sparflow
