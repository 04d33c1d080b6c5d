#include "models/machine/kinematics.h"

namespace sparflow {

ChainGeometry::ChainGeometry(const Machine& machine)
    : rotation(machine.joints.size()), origin(machine.joints.size()), axis(machine.joints.size()) {
  for (const Joint& joint : machine.joints) revolute.push_back(joint.type == JointType::kRevolute);
}

void ChainGeometry::update(const Machine& machine, const double* q) {
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < machine.joints.size(); ++k) {
    const Joint& joint = machine.joints[k];
    p += r * joint.origin.translation();
    r = (r * joint.origin.linear()).eval();
    axis[k] = r * joint.axis;
    if (revolute[k]) {
      r = (r * Eigen::AngleAxisd(q[k], joint.axis).toRotationMatrix()).eval();
    } else {
      p += q[k] * axis[k];
    }
    rotation[k] = r;
    origin[k] = p;
  }
}

Eigen::Vector3d ChainGeometry::point(int joint, const Eigen::Vector3d& local) const {
  if (joint < 0) return local;
  const auto k = static_cast<std::size_t>(joint);
  return origin[k] + rotation[k] * local;
}

Eigen::Vector3d point_jacobian(const ChainGeometry& chain, int joint, const Eigen::Vector3d& p,
                               int k) {
  if (k > joint) return Eigen::Vector3d::Zero();
  const auto i = static_cast<std::size_t>(k);
  if (!chain.revolute[i]) return chain.axis[i];
  return chain.axis[i].cross(p - chain.origin[i]);
}

Eigen::Vector3d point_hessian(const ChainGeometry& chain, int i, const Eigen::Vector3d& column_k) {
  const auto j = static_cast<std::size_t>(i);
  if (!chain.revolute[j]) return Eigen::Vector3d::Zero();
  return chain.axis[j].cross(column_k);
}

Eigen::Matrix3Xd point_jacobian_matrix(const Machine& machine, const Eigen::VectorXd& q, int joint,
                                       const Eigen::Vector3d& local) {
  ChainGeometry chain(machine);
  chain.update(machine, q.data());
  const Eigen::Vector3d p = chain.point(joint, local);
  Eigen::Matrix3Xd jacobian(3, machine.joint_count());
  for (int k = 0; k < machine.joint_count(); ++k)
    jacobian.col(k) = point_jacobian(chain, joint, p, k);
  return jacobian;
}

}  // namespace sparflow
