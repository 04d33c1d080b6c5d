#pragma once
/// Forward kinematics and Jacobians of the serial chain (paper eq. 1), base frame, SI.
#include <vector>

#include "models/machine/machine.h"
#include "models/math/scalar.h"

namespace sparflow {

/// Pose of a link frame in the base frame.
template <class T>
struct Frame {
  Matrix3<T> rotation;
  Vector3<T> position;
};

/// Frames of all links, base to tip; the scalar is a plain or a dual number.
/// @param q joint coordinates in the machine's order, [rad] or [m]
template <class T>
std::vector<Frame<T>> forward_kinematics(const Machine& machine,
                                         const Eigen::Matrix<T, Eigen::Dynamic, 1>& q) {
  using std::cos;
  using std::sin;
  std::vector<Frame<T>> frames;
  Matrix3<T> rotation = Matrix3<T>::Identity();
  Vector3<T> position = Vector3<T>::Zero();
  for (int k = 0; k < machine.joint_count(); ++k) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(k)];
    position = (position + rotation * joint.origin.translation().cast<T>()).eval();
    rotation = (rotation * joint.origin.linear().eval().template cast<T>()).eval();
    const Vector3<T> axis = joint.axis.cast<T>();
    if (joint.type == JointType::kPrismatic) {
      const Vector3<T> shift = rotation * axis;
      for (int i = 0; i < 3; ++i) position[i] += q[k] * shift[i];
    } else {
      const T c = cos(q[k]), s = sin(q[k]), v = T(1.0) - c;
      Matrix3<T> turn;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) turn(i, j) = v * axis[i] * axis[j] + (i == j ? c : T(0.0));
      }
      turn(0, 1) -= s * axis[2];
      turn(1, 0) += s * axis[2];
      turn(0, 2) += s * axis[1];
      turn(2, 0) -= s * axis[1];
      turn(1, 2) -= s * axis[0];
      turn(2, 1) += s * axis[0];
      rotation = (rotation * turn).eval();
    }
    frames.push_back({rotation, position});
  }
  return frames;
}

/// A point given in the frame of `joint` (-1 = base), in the base frame [m].
template <class T>
Vector3<T> point_in_base(const std::vector<Frame<T>>& frames, int joint,
                         const Eigen::Vector3d& point) {
  if (joint < 0) return point.cast<T>();
  const Frame<T>& f = frames[static_cast<std::size_t>(joint)];
  return f.position + f.rotation * point.cast<T>();
}

/// Tip position [m] in the base frame.
template <class T>
Vector3<T> tip_position(const Machine& machine, const Eigen::Matrix<T, Eigen::Dynamic, 1>& q) {
  return point_in_base(forward_kinematics(machine, q), machine.tip.joint, machine.tip.xyz);
}

/// Joint axes and origins in the base frame at one configuration, from which all geometric derivatives follow. Calls of
/// update() reuse the memory.
struct ChainGeometry {
  std::vector<Eigen::Matrix3d> rotation;  ///< link frames
  std::vector<Eigen::Vector3d>
      origin;  ///< joint origins (a prismatic joint's frame moves with it) [m]
  std::vector<Eigen::Vector3d> axis;  ///< unit joint axes
  std::vector<bool> revolute;

  explicit ChainGeometry(const Machine& machine);
  void update(const Machine& machine, const double* q);
  Eigen::Vector3d point(int joint, const Eigen::Vector3d& local) const;
};

/// d p / d q_k of a point `p` (base frame) fixed to link `joint`; zero for k > joint. [m/rad] or [-]
Eigen::Vector3d point_jacobian(const ChainGeometry& chain, int joint, const Eigen::Vector3d& p,
                               int k);

/// d^2 p / d q_i d q_k with i <= k, from the Jacobian column k, which joint i rotates.
Eigen::Vector3d point_hessian(const ChainGeometry& chain, int i, const Eigen::Vector3d& column_k);

/// 3 x n Jacobian of a point fixed to a link.
Eigen::Matrix3Xd point_jacobian_matrix(const Machine& machine, const Eigen::VectorXd& q, int joint,
                                       const Eigen::Vector3d& local);

}  // namespace sparflow
