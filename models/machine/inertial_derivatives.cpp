#include "models/machine/inertial_derivatives.h"

#include <algorithm>
#include <array>

#include "models/machine/inertial_masses.h"
#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "models/math/taylor.h"

namespace sparflow {
namespace {

using Vec = Eigen::Vector3d;

constexpr int kMost = Jet::kMax / 3;
/// Number of a pair of joints, whichever comes first, so that the pairs of the first m joints come first.
constexpr int pair_of(int a, int b) { return a < b ? b * (b + 1) / 2 + a : a * (a + 1) / 2 + b; }
constexpr int kPairs = pair_of(kMost - 1, kMost - 1) + 1;

template <class Value, int count>
using Array = std::array<Value, static_cast<std::size_t>(count)>;
constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// A vector in the base frame with its first and second derivative by time along the motion.
struct Moving {
  Vec v = Vec::Zero(), d = Vec::Zero(), dd = Vec::Zero();

  Moving& operator+=(const Moving& b) {
    v += b.v;
    d += b.d;
    dd += b.dd;
    return *this;
  }
  friend Moving operator-(const Moving& a, const Moving& b) {
    return {a.v - b.v, a.d - b.d, a.dd - b.dd};
  }
  friend Moving operator*(double f, const Moving& a) { return {f * a.v, f * a.d, f * a.dd}; }
  friend Moving cross(const Moving& a, const Moving& b) {
    return {a.v.cross(b.v), a.d.cross(b.v) + a.v.cross(b.d),
            a.dd.cross(b.v) + 2.0 * a.d.cross(b.d) + a.v.cross(b.dd)};
  }
};

/// A frame's rate of turning and its derivative by time.
struct Turning {
  Vec rate = Vec::Zero(), change = Vec::Zero();

  /// A vector that turns with the frame.
  Moving carried(const Vec& v) const {
    const Vec d = rate.cross(v);
    return {v, d, change.cross(v) + rate.cross(d)};
  }
};

/// A point with its derivatives by the coordinates of the first `joints` joints.
struct PointDerivatives {
  int joints = 0;
  Moving point;
  Array<Moving, kMost> first;
  Array<Moving, kPairs> second;
  int curve = -1;           ///< joint by which a linkage's mass moves along a curve; -1: none
  Vec third = Vec::Zero();  ///< by that joint thrice
};

/// Torques, and their derivatives by position (q), rate (v) and acceleration (a) of the joints.
struct Derivatives {
  Array<double, kMost> torque{};
  Array<double, kMost * kMost> q{}, v{}, a{};
  Array<double, kMost * kPairs> qq{}, vv{};
  Array<double, kMost * kMost * kMost> vq{}, aq{};

  static std::size_t one(int i, int j) { return at(i * kMost + j); }
  static std::size_t two(int i, int j, int k) { return at(i * kPairs + pair_of(j, k)); }
  static std::size_t mixed(int i, int j, int l) { return at((i * kMost + j) * kMost + l); }
};

class ClosedForm {
 public:
  ClosedForm(const Machine& machine, const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
             const Eigen::VectorXd& qdd)
      : machine_(machine),
        q_(q),
        qd_(qd),
        qdd_(qdd),
        frames_(forward_kinematics<double>(machine, q)) {
    Turning parent;
    Moving origin;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      const Joint& joint = machine.joints[k];
      const auto c = static_cast<Eigen::Index>(k);
      axes_[k] = parent.carried(frames_[k].rotation * joint.axis);
      revolute_[k] = joint.type == JointType::kRevolute;
      origin += parent.carried(rotation * joint.origin.translation());
      if (revolute_[k]) {
        parent.rate += axes_[k].v * qd[c];
        parent.change += axes_[k].v * qdd[c] + axes_[k].d * qd[c];
      } else {
        origin += along(k, q[c], 1.0);
      }
      origins_[k] = origin;
      turning_[k] = parent;
      rotation = frames_[k].rotation;
    }
  }

  void add_link(const Link& link) {
    if (link.joint < 0 && link.slides_with < 0) return;
    PointDerivatives& d = point_;
    d.curve = -1;
    d.joints = std::max(link.joint, link.slides_with) + 1;
    const int s = link.slides_with;
    const Moving p = fixed(link.joint, link.cog);
    const Moving slide = s < 0 ? Moving() : along(at(s), link.fraction * q_[s], link.fraction);
    d.point = p;
    d.point += slide;
    for (int j = 0; j < d.joints; ++j) {
      Moving& first = d.first[at(j)] = j <= link.joint ? by_joint(j, p) : Moving();
      if (j < s && revolute_[at(j)]) first += cross(axes_[at(j)], slide);
      if (j == s) first += link.fraction * axes_[at(j)];
    }
    second_order(d);
    add(link.mass, d);
    if (link.joint >= 0 && link.inertia != 0.0) add_inertia(link);
  }

  void add_linkage(int cylinder) {
    constexpr int kOrder = 4;  // no threshold: of the highest derivative in use
    using Series = TaylorSeries<kOrder>;
    const int j = machine_.cylinders[at(cylinder)].joint;
    masses_.clear();
    append_linkage_masses(machine_, cylinder, Series::variable(q_[j]), masses_);
    for (const LinkageMass<Series>& m : masses_) {
      Array<Vec, kOrder + 1> x;  // derivatives of its position by q_j
      for (int order = 0; order <= kOrder; ++order) {
        for (int i = 0; i < 3; ++i) x[at(order)][i] = m.position[i].derivative(order);
        if (j > 0) x[at(order)] = (frames_[at(j - 1)].rotation * x[at(order)]).eval();
      }
      PointDerivatives& d = point_;
      d.joints = j + 1;
      d.point = on_curve(j, x[0], x[1], x[2]);
      if (j > 0) d.point += origins_[at(j - 1)];
      for (int k = 0; k < j; ++k) d.first[at(k)] = by_joint(k, d.point);
      d.first[at(j)] = on_curve(j, x[1], x[2], x[3]);
      second_order(d);
      d.second[at(pair_of(j, j))] = on_curve(j, x[2], x[3], x[4]);
      d.curve = j;
      d.third = x[3];
      add(m.mass, d);
    }
  }

  const Derivatives& result() const { return out_; }

 private:
  /// A point fixed in the frame of a joint.
  Moving fixed(int joint, const Vec& local) const {
    if (joint < 0) return {local, Vec::Zero(), Vec::Zero()};
    Moving p = turning_[at(joint)].carried(frames_[at(joint)].rotation * local);
    p += origins_[at(joint)];
    return p;
  }

  /// A way along the axis of prismatic joint k, `share` of its coordinate.
  Moving along(std::size_t k, double way, double share) const {
    const auto c = static_cast<Eigen::Index>(k);
    const double rate = share * qd_[c], change = share * qdd_[c];
    const Moving& z = axes_[k];
    return {way * z.v, way * z.d + rate * z.v, way * z.dd + 2.0 * rate * z.d + change * z.v};
  }

  /// A vector in the frame before joint j that depends on q_j, with its derivatives by q_j; all turned into the base frame.
  Moving on_curve(int j, const Vec& x, const Vec& x1, const Vec& x2) const {
    const Vec d = x1 * qd_[j], dd = x2 * (qd_[j] * qd_[j]) + x1 * qdd_[j];
    if (j == 0) return {x, d, dd};
    const Turning& parent = turning_[at(j - 1)];
    Moving m = parent.carried(x);
    m.d += d;
    m.dd += dd + 2.0 * parent.rate.cross(d);
    return m;
  }

  /// Derivative of a point beyond joint j by its coordinate.
  Moving by_joint(int j, const Moving& p) const {
    return revolute_[at(j)] ? cross(axes_[at(j)], p - origins_[at(j)]) : axes_[at(j)];
  }

  /// D_ab = z_a x D_b for a <= b where joint a turns, else zero.
  void second_order(PointDerivatives& d) const {
    for (int b = 0; b < d.joints; ++b) {
      for (int a = 0; a <= b; ++a)
        d.second[at(pair_of(a, b))] =
            revolute_[at(a)] ? cross(axes_[at(a)], d.first[at(b)]) : Moving();
    }
  }

  /// The inertia tensor I z z^T about the axis z of the last revolute joint is that of masses I/2, I/2 and -I/2 at the unit vectors across
  /// and along z, which have no place of their own.
  void add_inertia(const Link& link) {
    int joint = link.joint;
    while (joint >= 0 && !revolute_[at(joint)]) --joint;
    if (joint < 0) return;
    const Vec z = axes_[at(joint)].v, u = z.unitOrthogonal();
    const std::array<Vec, 3> vectors = {u, z.cross(u), z};
    PointDerivatives& d = point_;
    d.curve = -1;
    d.joints = joint + 1;
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      d.point = turning_[at(joint)].carried(vectors[i]);
      for (int k = 0; k < d.joints; ++k)
        d.first[at(k)] = revolute_[at(k)] ? cross(axes_[at(k)], d.point) : Moving();
      second_order(d);
      add((i < 2 ? 0.5 : -0.5) * link.inertia, d);
    }
  }

  void add(double mass, const PointDerivatives& d) {
    const int n = d.joints;
    const Vec force = mass * d.point.dd;
    // D_abc . force for a <= b <= c is D_bc . (force x z_a) where joint a turns
    Array<Vec, kMost> lever;
    for (int a = 0; a < n; ++a)
      lever[at(a)] = revolute_[at(a)] ? Vec(force.cross(axes_[at(a)].v)) : Vec(Vec::Zero());
    const auto third = [&](int a, int b, int c) {
      const int least = std::min({a, b, c});
      if (least == d.curve) return d.third.dot(force);
      const int other = least == a ? pair_of(b, c) : least == b ? pair_of(a, c) : pair_of(a, b);
      return d.second[at(other)].v.dot(lever[at(least)]);
    };
    for (int i = 0; i < n; ++i) {
      const Moving& one = d.first[at(i)];
      const Vec f = mass * one.v;
      out_.torque[at(i)] += one.v.dot(force);
      for (int l = 0; l < n; ++l) {
        const Vec& two = d.second[at(pair_of(i, l))].v;
        const Vec g = mass * two;
        const Moving& other = d.first[at(l)];
        out_.q[Derivatives::one(i, l)] += two.dot(force) + f.dot(other.dd);
        out_.v[Derivatives::one(i, l)] += 2.0 * f.dot(other.d);
        out_.a[Derivatives::one(i, l)] += f.dot(other.v);
        for (int m = 0; m <= l; ++m) {
          const Moving& pair = d.second[at(pair_of(l, m))];
          out_.qq[Derivatives::two(i, l, m)] += third(i, l, m) + g.dot(d.first[at(m)].dd) +
                                                mass * d.second[at(pair_of(i, m))].v.dot(other.dd) +
                                                f.dot(pair.dd);
          out_.vv[Derivatives::two(i, l, m)] += 2.0 * f.dot(pair.v);
        }
        for (int j = 0; j < n; ++j) {
          const Moving& pair = d.second[at(pair_of(j, l))];
          out_.vq[Derivatives::mixed(i, j, l)] += 2.0 * (g.dot(d.first[at(j)].d) + f.dot(pair.d));
          out_.aq[Derivatives::mixed(i, j, l)] += g.dot(d.first[at(j)].v) + f.dot(pair.v);
        }
      }
    }
  }

  const Machine& machine_;
  const Eigen::VectorXd &q_, &qd_, &qdd_;
  std::vector<Frame<double>> frames_;
  Array<Moving, kMost> axes_, origins_;
  Array<Turning, kMost> turning_;
  Array<bool, kMost> revolute_{};
  std::vector<LinkageMass<TaylorSeries<4>>> masses_;
  PointDerivatives point_;
  Derivatives out_;
};

/// Which variable a Jet is; -1 for a constant.
constexpr int kConstant = -1, kOther = -2;  // no threshold: names
int variable_of(const Jet& x) {
  int found = kConstant;
  for (int i = 0; i < x.variables(); ++i) {
    for (int j = 0; j <= i; ++j) {
      if (x.hessian(i, j) != 0.0) return kOther;
    }
    if (x.gradient(i) == 0.0) continue;
    if (x.gradient(i) != 1.0 || found >= 0) return kOther;
    found = i;
  }
  return found;
}

}  // namespace

std::vector<Jet> inertial_torque_of_variables(const Machine& machine, const std::vector<Jet>& q,
                                              const std::vector<Jet>& qd,
                                              const std::vector<Jet>& qdd, double payload) {
  const int n = machine.joint_count();
  // what each variable of the Jets is: joint + n * (0 position, 1 rate, 2 acceleration)
  Array<int, Jet::kMax> meaning;
  meaning.fill(kConstant);
  int count = 0;
  std::array<Eigen::VectorXd, 3> values;
  const std::array<const std::vector<Jet>*, 3> inputs = {&q, &qd, &qdd};
  for (int group = 0; group < 3; ++group) {
    Eigen::VectorXd& v = values[at(group)];
    v.resize(n);
    for (int j = 0; j < n; ++j) {
      const Jet& x = (*inputs[at(group)])[at(j)];
      v[j] = x.value;
      const int variable = variable_of(x);
      if (variable == kOther || (variable >= 0 && meaning[at(variable)] != kConstant)) return {};
      if (variable >= 0) meaning[at(variable)] = group * n + j;
      count = std::max(count, x.variables());
    }
  }
  ClosedForm form(machine, values[0], values[1], values[2]);
  add_all_masses(machine, payload, form);
  const Derivatives& d = form.result();

  std::vector<Jet> torque;
  torque.reserve(at(n));
  for (int i = 0; i < n; ++i) {
    const auto gradient = [&](int variable) {
      const int m = meaning[at(variable)];
      if (m == kConstant) return 0.0;
      const Array<double, kMost* kMost>& part = m < n ? d.q : m < 2 * n ? d.v : d.a;
      return part[Derivatives::one(i, m % n)];
    };
    const auto hessian = [&](int one, int other) {
      int m = meaning[at(one)], l = meaning[at(other)];
      if (m == kConstant || l == kConstant) return 0.0;
      if (m < l) std::swap(m, l);
      const int late = m / n, early = l / n;  // 0 position, 1 rate, 2 acceleration
      if (late == 0) return d.qq[Derivatives::two(i, m, l)];
      if (early == 0) return (late == 1 ? d.vq : d.aq)[Derivatives::mixed(i, m % n, l)];
      return late == 1 ? d.vv[Derivatives::two(i, m % n, l % n)] : 0.0;
    };
    torque.push_back(Jet::of(d.torque[at(i)], count, gradient, hessian));
  }
  return torque;
}

}  // namespace sparflow
