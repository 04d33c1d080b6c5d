#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "models/effects/builtin.h"
#include "models/effects/instant.h"
#include "models/machine/static_force.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

/// Evaluates a function of all joints from its value, gradient and Hessian at the joints' plain values.
double lifted(double value, const auto&, const auto&, const std::vector<double>&) { return value; }
Jet lifted(double value, const auto& gradient, const auto& hessian, const std::vector<Jet>& q) {
  std::vector<Jet> away;
  away.reserve(q.size());
  for (const Jet& x : q) away.push_back(x - Jet(x.value));
  Jet result(value);
  for (std::size_t i = 0; i < q.size(); ++i) {
    const auto r = static_cast<Eigen::Index>(i);
    Jet slope(gradient[r]);
    for (std::size_t j = 0; j < q.size(); ++j) {
      slope += away[j] * Jet(0.5 * hessian(r, static_cast<Eigen::Index>(j)));
    }
    result += slope * away[i];
  }
  return result;
}

double chained(double, const Taylor3& x) { return x.d1; }
Jet chained(const Jet& q, const Taylor3& x) { return q.chain(x.d1, x.d2, x.d3); }

std::vector<double> plain_values(const std::vector<double>& q) { return q; }
std::vector<double> plain_values(const std::vector<Jet>& q) {
  std::vector<double> values;
  values.reserve(q.size());
  for (const Jet& x : q) values.push_back(x.value);
  return values;
}

/// Each revolute joint deflects by kappa times its static torque: F = tau(q') / (dx/dq)(q'') with
/// q' = q - kappa tau(q) and q'' = q - lever kappa tau(q).
class StructuralFlex final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "structural_flex",
        .title = "structural flexibility",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kMachine,
        .parameters = {{"kappa_first",
                        "deg/(kN m)",
                        units::kDegree / 1e3,
                        0.0,
                        2 * units::kDegree / 1e3,
                        0.006 * units::kDegree / 1e3,
                        "deflection of the first luffing joint's link per torque",
                        true,
                        {}},
                       {"kappa_rest",
                        "deg/(kN m)",
                        units::kDegree / 1e3,
                        0.0,
                        5 * units::kDegree / 1e3,
                        0.006 * units::kDegree / 1e3,
                        "the same for every revolute joint behind it",
                        true,
                        {}},
                       {"lever",
                        "-",
                        1.0,
                        0.0,
                        1.0,
                        0.0,
                        "0: the link bends beyond the rod pin; 1: the joint deflects, and the "
                        "cylinder's lever arm dx/dq changes as well",
                        false,
                        {0.0, 1.0},
                        true,
                        false,
                        {"the link bends", "the joint deflects"}}},
        .equation = "F = tau(q') / (dx/dq), q' = q - kappa tau(q)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"unmodelled_mass", "angle_offset", "payload_error"},
        .separated_by =
            "the same poses at several payloads: the deflection grows with the load, an angle "
            "offset does not",
        .citation =
            "Spong (1987), J. Dyn. Syst. Meas. Control 109(4), elastic joints; Khalil & "
            "Dombre (2002), ch. 11, joint compliance in calibration",
        .form_error = 0.1,
        .in_motion = "force"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return first_luffing_joint(machine) < 0 ? std::vector<int>{} : std::vector<int>{-1};
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  template <class T>
  void add_force_law(const Instant<T>& s, int, std::span<const double> p, std::span<T> out) const {
    if (p[0] == 0.0 && p[1] == 0.0) return;
    StaticForce statics(*s.machine);
    add_bent(statics, s, p, out);
  }
  SPARFLOW_EFFECT_LAW(add_force)

  /// @param statics workspace of s.machine
  template <class T>
  static void add_bent(StaticForce& statics, const Instant<T>& s, std::span<const double> p,
                       std::span<T> out) {
    const Machine& machine = *s.machine;
    const int order = std::is_same_v<T, double> ? 0 : 2;
    const std::vector<double> at = plain_values(s.q);
    statics.update(at.data(), s.payload, order);
    const auto torque = [&](int joint, const std::vector<T>& q) {
      return lifted(statics.torque()[joint], statics.torque_jacobian().row(joint),
                    statics.torque_hessian(joint), q);
    };
    std::vector<T> bent = s.q, lever = s.q, before;
    const int first = first_luffing_joint(machine);
    for (int k = 0; k < machine.joint_count(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      before.push_back(torque(k, s.q));
      if (machine.joints[i].type != JointType::kRevolute || k < first) continue;
      const T sag = before[i] * (k == first ? p[0] : p[1]);
      bent[i] -= sag;
      lever[i] -= sag * p[2];
    }
    const std::vector<double> at_bent = plain_values(bent);
    statics.update(at_bent.data(), s.payload, order);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const int joint = machine.cylinders[i].joint;
      const auto j = static_cast<std::size_t>(joint);
      const auto rate = [&](const T& q) {
        return chained(q, linkage_rates(machine, static_cast<int>(i), plain(q)));
      };
      out[i] += torque(joint, bent) / rate(lever[j]) - before[j] / rate(s.q[j]);
    }
  }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kForce) return false;
    const Machine& machine = *log.machine;
    const int first = first_luffing_joint(machine);
    columns.setConstant(log.samples(), 2, std::numeric_limits<double>::quiet_NaN());
    // The law is not linear in kappa; the column is its secant over about one degree of deflection, a size that matters.
    double largest[2] = {1.0, 1.0};
    StaticForce statics(machine);
    Eigen::VectorXd q(machine.joint_count());
    const auto usable = [&](Eigen::Index k) {
      q = log.q.row(k);
      return q.allFinite() && std::isfinite(log.payload[k]);
    };
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      if (!usable(k)) continue;
      try {
        statics.update(q.data(), log.payload[k], 0);
      } catch (const std::domain_error&) {
        continue;  // The four-bar cannot close in this pose.
      }
      for (int j = first; j < machine.joint_count(); ++j) {
        const Joint& joint = machine.joints[static_cast<std::size_t>(j)];
        if (joint.type != JointType::kRevolute) continue;
        double& most = largest[j == first ? 0 : 1];
        most = std::max(most, std::abs(statics.torque()[j]));
      }
    }
    Instant<double> instant = make_instant(machine);
    std::vector<double> out(machine.cylinders.size());
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      if (!usable(k)) continue;
      fill_instant(log, k, instant);
      try {
        for (int c = 0; c < 2; ++c) {
          const double kappa = units::kDegree / largest[c];
          const double p[] = {c == 0 ? kappa : 0.0, c == 1 ? kappa : 0.0, shape[0]};
          std::fill(out.begin(), out.end(), 0.0);
          add_bent<double>(statics, instant, p, out);
          columns(k, c) = out[static_cast<std::size_t>(measured.index)] / kappa;
        }
      } catch (const std::domain_error&) {
        columns.row(k).setConstant(std::numeric_limits<double>::quiet_NaN());
      }
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_structural_flex() { return std::make_unique<StructuralFlex>(); }

}  // namespace sparflow
