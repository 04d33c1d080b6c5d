#include "models/machine/inertial_torque.h"

#include "models/machine/inertial_masses.h"
#include "models/machine/linkage.h"
#include "models/math/jet.h"
#include "models/math/taylor.h"

namespace sparflow {
namespace {

template <class T>
using Vector = Eigen::Matrix<T, Eigen::Dynamic, 1>;

/// Value (and derivatives, where T has them) of a function of one joint coordinate with derivatives f0, f1, f2.
double lifted(double, double f0, double, double) { return f0; }
Jet lifted(const Jet& q, double f0, double f1, double f2) { return q.chain(f0, f1, f2); }

/// Motion of a link frame in the base frame.
template <class T>
struct Motion {
  Vector3<T> rate = Vector3<T>::Zero();          // [rad/s]
  Vector3<T> acceleration = Vector3<T>::Zero();  // [rad/s^2]
  Vector3<T> origin = Vector3<T>::Zero();        // acceleration of the frame's origin [m/s^2]

  /// Acceleration by rotation of a point at r, fixed in the frame. [m/s^2]
  Vector3<T> turning(const Vector3<T>& r) const {
    return acceleration.cross(r) + rate.cross(rate.cross(r).eval());
  }
};

/// Force [N] and moment [N m] about the base's origin that accelerate a link's masses.
template <class T>
struct Wrench {
  Vector3<T> force = Vector3<T>::Zero();
  Vector3<T> moment = Vector3<T>::Zero();

  void add(const Vector3<T>& f, const Vector3<T>& at) {
    force += f;
    moment += at.cross(f).eval();
  }
};

template <class T>
class NewtonEuler {
 public:
  NewtonEuler(const Machine& machine, const Vector<T>& q, const Vector<T>& qd, const Vector<T>& qdd)
      : machine_(machine),
        q_(q),
        qd_(qd),
        qdd_(qdd),
        frames_(forward_kinematics(machine, q)),
        axes_(frames_.size()),
        motions_(frames_.size()),
        wrenches_(frames_.size()),
        torque_(q.size()) {
    for (Eigen::Index k = 0; k < q.size(); ++k) torque_[k] = T(0.0);
    outward();
  }

  void add_link(const Link& link) {
    if (link.joint < 0 && link.slides_with < 0) return;
    Vector3<T> p = point_in_base(frames_, link.joint, link.cog);
    Vector3<T> a = acceleration_of(link.joint, link.cog);
    if (link.slides_with >= 0) {
      const auto s = static_cast<std::size_t>(link.slides_with);
      const Vector3<T> slide = axes_[s] * (T(link.fraction) * q_[link.slides_with]);
      p += slide;
      a += motions_[s].turning(slide) + along(s, T(link.fraction));
      const Vector3<T> f = a * T(link.mass);
      torque_[link.slides_with] += T(link.fraction) * axes_[s].dot(f);
    }
    if (link.joint < 0) return;
    Wrench<T>& wrench = wrenches_[static_cast<std::size_t>(link.joint)];
    wrench.add(a * T(link.mass), p);
    if (link.inertia == 0.0) return;
    for (int k = link.joint; k >= 0; --k) {  // down to the last revolute joint
      const auto i = static_cast<std::size_t>(k);
      if (machine_.joints[i].type != JointType::kRevolute) continue;
      const Vector3<T>& z = axes_[i];
      const Motion<T>& motion = motions_[static_cast<std::size_t>(link.joint)];
      // Euler's equation for the inertia tensor inertia * z z^T
      wrench.moment += z * (T(link.inertia) * z.dot(motion.acceleration)) +
                       motion.rate.cross(z).eval() * (T(link.inertia) * z.dot(motion.rate));
      break;
    }
  }

  void add_linkage(int cylinder) {
    using Series = TaylorSeries<4>;
    const int j = machine_.cylinders[static_cast<std::size_t>(cylinder)].joint;
    std::vector<LinkageMass<Series>> masses;
    append_linkage_masses(machine_, cylinder, Series::variable(plain(q_[j])), masses);
    for (const LinkageMass<Series>& m : masses) {
      Vector3<T> p, p1, p2;  // position and its derivatives by q_j, in the parent's frame
      for (int i = 0; i < 3; ++i) {
        const Series& x = m.position[i];
        p[i] = lifted(q_[j], x.derivative(0), x.derivative(1), x.derivative(2));
        p1[i] = lifted(q_[j], x.derivative(1), x.derivative(2), x.derivative(3));
        p2[i] = lifted(q_[j], x.derivative(2), x.derivative(3), x.derivative(4));
      }
      Vector3<T> a = p1 * qdd_[j] + p2 * (qd_[j] * qd_[j]);
      if (j > 0) {
        const auto parent = static_cast<std::size_t>(j - 1);
        const Frame<T>& frame = frames_[parent];
        const Motion<T>& motion = motions_[parent];
        const Vector3<T> r = frame.rotation * p;
        p1 = (frame.rotation * p1).eval();
        a = (frame.rotation * a).eval();
        a += motion.origin + motion.turning(r) + motion.rate.cross(p1).eval() * (T(2.0) * qd_[j]);
        wrenches_[parent].add(a * T(m.mass), frame.position + r);
      }
      torque_[j] += T(m.mass) * a.dot(p1);
    }
  }

  /// Inward recursion: a joint transmits the wrench of its link and of everything beyond it.
  Vector<T> torque() {
    Wrench<T> carried;
    for (Eigen::Index k = q_.size() - 1; k >= 0; --k) {
      const auto i = static_cast<std::size_t>(k);
      carried.force += wrenches_[i].force;
      carried.moment += wrenches_[i].moment;
      if (machine_.joints[i].type == JointType::kPrismatic) {
        torque_[k] += axes_[i].dot(carried.force);
      } else {
        const Vector3<T> about = carried.moment - frames_[i].position.cross(carried.force);
        torque_[k] += axes_[i].dot(about);
      }
    }
    return torque_;
  }

 private:
  void outward() {
    Motion<T> parent;
    Matrix3<T> parent_rotation = Matrix3<T>::Identity();
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      const Joint& joint = machine_.joints[k];
      const auto c = static_cast<Eigen::Index>(k);
      axes_[k] = frames_[k].rotation * joint.axis.cast<T>();
      const Vector3<T> r = parent_rotation * joint.origin.translation().cast<T>();
      Motion<T> motion = parent;
      motion.origin += parent.turning(r);
      if (joint.type == JointType::kRevolute) {
        const Vector3<T> turn = axes_[k] * qd_[c];
        motion.acceleration += axes_[k] * qdd_[c] + parent.rate.cross(turn);
        motion.rate += turn;
      } else {
        motions_[k] = parent;
        motion.origin += parent.turning(axes_[k] * q_[c]) + along(k, T(1.0));
      }
      motions_[k] = motion;
      parent = motion;
      parent_rotation = frames_[k].rotation;
    }
  }

  /// Coriolis and relative acceleration of a mass that moves by `share` of prismatic joint k.
  Vector3<T> along(std::size_t k, const T& share) const {
    const auto c = static_cast<Eigen::Index>(k);
    return motions_[k].rate.cross(axes_[k]).eval() * (T(2.0) * share * qd_[c]) +
           axes_[k] * (share * qdd_[c]);
  }

  Vector3<T> acceleration_of(int joint, const Eigen::Vector3d& local) const {
    if (joint < 0) return Vector3<T>::Zero();
    const auto k = static_cast<std::size_t>(joint);
    const Vector3<T> r = frames_[k].rotation * local.cast<T>();
    return motions_[k].origin + motions_[k].turning(r);
  }

  const Machine& machine_;
  const Vector<T>&q_, &qd_, &qdd_;
  std::vector<Frame<T>> frames_;
  std::vector<Vector3<T>> axes_;
  std::vector<Motion<T>> motions_;
  std::vector<Wrench<T>> wrenches_;
  Vector<T> torque_;
};

}  // namespace

template <class T>
Vector<T> inertial_torque(const Machine& machine, const Vector<T>& q, const Vector<T>& qd,
                          const Vector<T>& qdd, double payload) {
  NewtonEuler<T> dynamics(machine, q, qd, qdd);
  add_all_masses(machine, payload, dynamics);
  return dynamics.torque();
}

template Vector<double> inertial_torque<double>(const Machine&, const Vector<double>&,
                                                const Vector<double>&, const Vector<double>&,
                                                double);
template Vector<Jet> inertial_torque<Jet>(const Machine&, const Vector<Jet>&, const Vector<Jet>&,
                                          const Vector<Jet>&, double);

}  // namespace sparflow
