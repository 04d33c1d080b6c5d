#include "bench/reference_model.h"

#include <algorithm>
#include <cmath>

namespace sparflow::bench {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {
constexpr double kPi = 3.14159265358979323846;
constexpr double kToLpm = 60000.0;  // m^3/s -> l/min
constexpr double kToKiloNewton = 1e-3;
constexpr double kBarLpmToKilowatt = 1.0 / 600.0;
}  // namespace

ReferenceKnot::ReferenceKnot(std::shared_ptr<const ReferenceProblem> problem)
    : problem_(std::move(problem)) {
  const ReferenceProblem& p = *problem_;
  last_.z.fill(std::nan(""));  // NaN, so that it equals no z
  // tau1 = gS_inner cos th1 + tau2, tau2 = (gS_fixed + gS_slide d) cos phi, tau3 = gS_slide sin phi
  gS_inner_ = p.gravity * (p.m_inner * p.s_inner + (p.m_outer + p.m_tele + p.m_payload) * p.L1);
  gS_fixed_ = p.gravity * (p.m_outer * p.s_outer + p.m_tele * p.s_tele0 + p.m_payload * p.L2);
  gS_slide_ = p.gravity * (p.m_tele * p.s_tele1 + p.m_payload);
  const std::array<double, 2> offset = {p.alpha1, kPi + p.alpha2};
  for (std::size_t i = 0; i < 2; ++i) {
    angle_sin_[i] = std::sin(offset[i]);
    angle_cos_[i] = std::cos(offset[i]);
  }
  // A direction of weight u is left out when that changes the power by less than 1e-13 relative: it changes the blended
  // pressure by at most u (bound_extend + bound_retract), the log-sum-exp by no more than that, and the pump
  // pressure is never below standby, so u (b_e + b_r) <= 1e-13 standby suffices. In the derivatives the same
  // terms carry (2/eps_v)^k, which is also the scale of the k-th derivative where the direction changes.
  for (std::size_t i = 0; i < 3; ++i) {
    negligible_[i] = 1e-13 * p.standby / (p.gp[i][0].bound + p.gp[i][1].bound);
  }
}

const ReferenceKnot::Kinematics& ReferenceKnot::kinematics(const double* z) {
  Kinematics& kin = last_;
  if (std::equal(kin.z.begin(), kin.z.end(), z)) return kin;  // A NaN never equals.
  const ReferenceProblem& p = *problem_;
  std::copy(z, z + 6, kin.z.begin());
  const std::array<double, 2> a = {p.a1, p.a2}, b = {p.b1, p.b2};
  const std::array<double, 2> s = {std::sin(z[0]), std::sin(z[1])};
  const std::array<double, 2> c = {std::cos(z[0]), std::cos(z[1])};
  kin.sin_1 = s[0];
  kin.cos_1 = c[0];
  kin.sin_phi = s[0] * c[1] + c[0] * s[1];
  kin.cos_phi = c[0] * c[1] - s[0] * s[1];
  for (std::size_t i = 0; i < 2; ++i) {
    const double sine = s[i] * angle_cos_[i] + c[i] * angle_sin_[i];
    const double cosine = c[i] * angle_cos_[i] - s[i] * angle_sin_[i];
    const double ab = a[i] * b[i];
    const double inverse = 1.0 / std::sqrt(a[i] * a[i] + b[i] * b[i] - 2.0 * ab * cosine);
    // c c' = ab sin, c c'' + c'^2 = ab cos, c c''' + 3 c' c'' = -ab sin
    Rate& r = kin.rate[i];
    r.ratio = ab * sine * inverse;
    r.d = (ab * cosine - r.ratio * r.ratio) * inverse;
    r.dd = (-ab * sine - 3.0 * r.ratio * r.d) * inverse;
  }
  kin.flow = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    kin.speed[i] = speed(i, kin.rate[i].ratio * z[3 + i]);
    kin.flow += kin.speed[i].flow;
  }
  return kin;
}

ReferenceKnot::Speed ReferenceKnot::speed(std::size_t i, double v) const {
  const ReferenceProblem& p = *problem_;
  Speed s;
  // The smaller weight is computed first, since 1 - w would cancel. Beyond 2|v|/eps = 40 it is below 5e-18.
  const double argument = 2.0 * std::abs(v) / p.eps_v;
  const double tail = argument < 40.0 ? std::exp(-argument) : 0.0;
  const double small = tail / (1.0 + tail), large = 1.0 / (1.0 + tail);
  s.extend = v >= 0.0 ? large : small;
  s.retract = v >= 0.0 ? small : large;
  s.d_extend = 2.0 * small * large / p.eps_v;
  s.dd_extend = 2.0 * s.d_extend * (s.retract - s.extend) / p.eps_v;

  const double root = std::sqrt(v * v + p.eps_v * p.eps_v);
  const double d_root = v / root, dd_root = p.eps_v * p.eps_v / (root * root * root);
  const double difference = p.area_piston[i] - p.area_rod[i];
  const double area = s.extend * p.area_piston[i] + s.retract * p.area_rod[i];
  const double d_area = difference * s.d_extend, dd_area = difference * s.dd_extend;
  s.flow = kToLpm * area * root;
  s.d_flow = kToLpm * (d_area * root + area * d_root);
  s.dd_flow = kToLpm * (dd_area * root + 2.0 * d_area * d_root + area * dd_root);
  return s;
}

std::array<double, 3> ReferenceKnot::forces(const Kinematics& kin) const {
  const double tau2 = (gS_fixed_ + gS_slide_ * kin.z[2]) * kin.cos_phi;
  const double tau1 = gS_inner_ * kin.cos_1 + tau2;
  const double tau3 = gS_slide_ * kin.sin_phi;
  return {kToKiloNewton * tau1 / kin.rate[0].ratio, kToKiloNewton * tau2 / kin.rate[1].ratio,
          kToKiloNewton * tau3};
}

/// Log-sum-exp over standby and the cylinders' demands; the largest term is factored out to prevent overflow. Terms
/// below exp(-40) of the largest are less than a tenth of the sum's last digit. It is a copy of the smooth law in
/// models/chain/pump_law.h, because the reference NLP is an independent second path and this is its hot loop;
/// tests/bench/reference_nlp_test.cpp holds it against the first.
/// @param share [3] weights of the softmax (derivatives), may be null
double ReferenceKnot::pump_pressure(const std::array<double, 3>& demand, double* share) const {
  const ReferenceProblem& p = *problem_;
  const double inverse = 1.0 / p.lse_temperature;
  const double top = std::max({p.standby, demand[0], demand[1], demand[2]});
  const auto term = [&](double pressure) {
    const double exponent = (pressure - top) * inverse;
    if (exponent == 0.0) return 1.0;
    return exponent < -40.0 ? 0.0 : std::exp(exponent);  // A NaN remains a NaN.
  };
  const std::array<double, 3> terms = {term(demand[0]), term(demand[1]), term(demand[2])};
  const double sum = term(p.standby) + terms[0] + terms[1] + terms[2];
  if (share != nullptr) {
    for (std::size_t i = 0; i < 3; ++i) share[i] = terms[i] / sum;
  }
  return top + p.lse_temperature * std::log(sum);
}

ReferenceKnot::State ReferenceKnot::state(const double* z) {
  const ReferenceProblem& p = *problem_;
  const Kinematics& kin = kinematics(z);
  State out;
  out.force = forces(kin);
  std::array<double, 3> demands;
  for (std::size_t i = 0; i < 3; ++i) {
    const Speed& s = kin.speed[i];
    double pressure = 0.0;
    const double weight[2] = {s.extend, s.retract};
    for (std::size_t side = 0; side < 2; ++side) {
      if (weight[side] <= negligible_[i]) continue;
      const ReferenceGp& gp = p.gp[i][side];
      pressure += weight[side] * kernel_sum(gp.centres(), s.flow * gp.inverse_length_flow,
                                            out.force[i] * gp.inverse_length_force);
    }
    out.flow[i] = s.flow;
    out.pressure[i] = pressure;
    const double q2 = s.flow * s.flow;
    demands[i] = pressure + p.margin * q2 / (q2 + p.q_eps * p.q_eps);
  }
  out.pump = pump_pressure(demands, nullptr);
  out.power = kBarLpmToKilowatt * out.pump * kin.flow;
  return out;
}

double ReferenceKnot::cost(const double* z) { return state(z).power; }

ReferenceKnot::Demand ReferenceKnot::demand(std::size_t i, const Speed& s, double force) const {
  const ReferenceProblem& p = *problem_;
  KernelSums side[2];
  const double weight[2] = {s.extend, s.retract};
  for (std::size_t k = 0; k < 2; ++k) {
    if (weight[k] <= negligible_[i]) continue;
    const ReferenceGp& gp = p.gp[i][k];
    const double iq = gp.inverse_length_flow, jf = gp.inverse_length_force;
    KernelSums& sums = side[k] = kernel_sum_derivatives(gp.centres(), s.flow * iq, force * jf);
    sums.d_x *= iq;
    sums.d_y *= jf;
    sums.d_xx *= iq * iq;
    sums.d_xy *= iq * jf;
    sums.d_yy *= jf * jf;
  }
  const auto mixed = [&](double KernelSums::*part) {
    return s.extend * side[0].*part + s.retract * side[1].*part;
  };
  const auto apart = [&](double KernelSums::*part) { return side[0].*part - side[1].*part; };
  const double q2 = s.flow * s.flow, e2 = p.q_eps * p.q_eps, sum = q2 + e2;
  const double d_margin = p.margin * 2.0 * e2 * s.flow / (sum * sum);
  const double dd_margin = p.margin * 2.0 * e2 * (e2 - 3.0 * q2) / (sum * sum * sum);
  const double d_q = mixed(&KernelSums::d_x) + d_margin;
  Demand d;
  d.value = mixed(&KernelSums::value) + p.margin * q2 / sum;
  d.d_v = s.d_extend * apart(&KernelSums::value) + d_q * s.d_flow;
  d.d_f = mixed(&KernelSums::d_y);
  d.d_vv = s.dd_extend * apart(&KernelSums::value) +
           2.0 * s.d_extend * s.d_flow * apart(&KernelSums::d_x) +
           (mixed(&KernelSums::d_xx) + dd_margin) * s.d_flow * s.d_flow + d_q * s.dd_flow;
  d.d_vf = s.d_extend * apart(&KernelSums::d_y) + mixed(&KernelSums::d_xy) * s.d_flow;
  d.d_ff = mixed(&KernelSums::d_yy);
  return d;
}

double ReferenceKnot::cost_derivatives(const double* z, double* gradient, double* hessian) {
  const ReferenceProblem& p = *problem_;
  const Kinematics& kin = kinematics(z);
  const Rate* rate = kin.rate.data();
  const Speed* speeds = kin.speed.data();
  const std::array<double, 3> force = forces(kin);
  Demand blend[3];
  std::array<double, 3> demands;
  for (std::size_t i = 0; i < 3; ++i) {
    blend[i] = demand(i, speeds[i], force[i]);
    demands[i] = blend[i].value;
  }

  // Power with respect to v and F of all cylinders: pump pressure times total flow.
  double share[3];
  const double pump = pump_pressure(demands, share);
  const double flow = kin.flow;
  Vector3d pump_v, pump_f, flow_v;
  for (int i = 0; i < 3; ++i) {
    pump_v[i] = share[i] * blend[i].d_v;
    pump_f[i] = share[i] * blend[i].d_f;
    flow_v[i] = speeds[i].d_flow;
  }
  const double k = kBarLpmToKilowatt, curl = 1.0 / p.lse_temperature;
  const Vector3d power_v = k * (flow * pump_v + pump * flow_v);
  const Vector3d power_f = k * flow * pump_f;
  const Vector3d flow_v_k = k * flow_v;
  const double fk = k * flow, fc = fk * curl;
  Matrix3d h_vv, h_vf, h_ff;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) {
      h_vv(r, c) = -fc * pump_v[r] * pump_v[c] + flow_v_k[r] * pump_v[c] + pump_v[r] * flow_v_k[c];
      h_vf(r, c) = -fc * pump_v[r] * pump_f[c] + flow_v_k[r] * pump_f[c];
      h_ff(r, c) = -fc * pump_f[r] * pump_f[c];
    }
    const Demand& b = blend[c];
    h_vv(c, c) += fk * share[c] * (b.d_vv + curl * b.d_v * b.d_v) + k * pump * speeds[c].dd_flow;
    h_vf(c, c) += fk * share[c] * (b.d_vf + curl * b.d_v * b.d_f);
    h_ff(c, c) += fk * share[c] * (b.d_ff + curl * b.d_f * b.d_f);
  }

  // Forces: F_i = 1e-3 tau_i / c_i'; gradients and Hessians with respect to q.
  const double sin_phi = kin.sin_phi, cos_phi = kin.cos_phi;
  const double arm = gS_fixed_ + gS_slide_ * z[2];
  const double tau2 = arm * cos_phi;
  const double inner_cos = gS_inner_ * kin.cos_1, inner_sin = gS_inner_ * kin.sin_1;
  const double tau[3] = {inner_cos + tau2, tau2, gS_slide_ * sin_phi};
  const Vector3d d_tau[3] = {{-inner_sin - arm * sin_phi, -arm * sin_phi, gS_slide_ * cos_phi},
                             {-arm * sin_phi, -arm * sin_phi, gS_slide_ * cos_phi},
                             {gS_slide_ * cos_phi, gS_slide_ * cos_phi, 0.0}};
  Matrix3d force_q;                    // row i = gradient of F_i
  Matrix3d curved = Matrix3d::Zero();  // sum_i power_f[i] * Hessian of F_i
  for (int i = 0; i < 3; ++i) {
    const Rate& r = rate[i];
    const double inv = kToKiloNewton / r.ratio;
    const double d_inv = -inv * r.d / r.ratio;
    const double dd_inv = inv * (2.0 * r.d * r.d / r.ratio - r.dd) / r.ratio;
    force_q.row(i) = inv * d_tau[i].transpose();
    force_q(i, i) += d_inv * tau[i];
    const double lambda = power_f[i];
    const double curvature =
        lambda * inv * -(i == 2 ? tau[2] : tau2);  // Both angles change phi equally.
    curved(0, 0) += curvature;
    curved(0, 1) += curvature;
    curved(1, 0) += curvature;
    curved(1, 1) += curvature;
    if (i == 0) curved(0, 0) -= lambda * inv * inner_cos;
    if (i < 2) {
      const double slide = -lambda * inv * gS_slide_ * sin_phi;
      curved(0, 2) += slide;
      curved(2, 0) += slide;
      curved(1, 2) += slide;
      curved(2, 1) += slide;
    }
    curved.row(i) += lambda * d_inv * d_tau[i].transpose();
    curved.col(i) += lambda * d_inv * d_tau[i];
    curved(i, i) += lambda * dd_inv * tau[i];
  }

  // v_i = c_i'(q_i) qd_i: one diagonal with respect to q (a), one with respect to qd (b).
  Vector3d a, b;
  for (int i = 0; i < 3; ++i) {
    a[i] = rate[i].d * z[3 + i];
    b[i] = rate[i].ratio;
  }
  Eigen::Map<Eigen::Matrix<double, 6, 1>> g(gradient);
  g.head<3>() = a.cwiseProduct(power_v);
  g.head<3>().noalias() += force_q.transpose() * power_f;
  g.tail<3>() = b.cwiseProduct(power_v);

  const Matrix3d vf_q = h_vf * force_q;  // d power_v through the forces
  Matrix3d qq = force_q.transpose() * h_ff * force_q + curved;
  Matrix3d q_qd;  // row qd, column q
  Eigen::Map<Eigen::Matrix<double, 6, 6>> h(hessian);
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) {
      qq(r, c) += a[r] * h_vv(r, c) * a[c] + a[r] * vf_q(r, c) + vf_q(c, r) * a[c];
      q_qd(r, c) = b[r] * (h_vv(r, c) * a[c] + vf_q(r, c));
      h(3 + r, 3 + c) = b[r] * h_vv(r, c) * b[c];
    }
    qq(c, c) += power_v[c] * rate[c].dd * z[3 + c];
    q_qd(c, c) += power_v[c] * rate[c].d;
  }
  h.topLeftCorner<3, 3>() = qq;
  h.bottomLeftCorner<3, 3>() = q_qd;
  h.topRightCorner<3, 3>() = q_qd.transpose();
  return k * pump * flow;
}

void ReferenceKnot::path_bounds(double* lower, double* upper) const {
  lower[0] = -kNoBound;
  upper[0] = problem_->q_total_max;
}

void ReferenceKnot::path(const double* z, double* g) { g[0] = kinematics(z).flow; }

void ReferenceKnot::path_jacobian(const double* z, double* g, double* jacobian) {
  const Kinematics& kin = kinematics(z);
  g[0] = kin.flow;
  for (std::size_t i = 0; i < 3; ++i) {
    jacobian[i] = kin.speed[i].d_flow * kin.rate[i].d * z[3 + i];
    jacobian[3 + i] = kin.speed[i].d_flow * kin.rate[i].ratio;
  }
}

void ReferenceKnot::add_path_hessian(const double* z, const double* multiplier, double* hessian) {
  const Kinematics& kin = kinematics(z);
  Eigen::Map<Eigen::Matrix<double, 6, 6>> h(hessian);
  for (int i = 0; i < 3; ++i) {
    const Speed& s = kin.speed.data()[i];
    const Rate& r = kin.rate.data()[i];
    const double a = r.d * z[3 + i], b = r.ratio, m = multiplier[0];
    const double cross = m * (s.dd_flow * a * b + s.d_flow * r.d);
    h(i, i) += m * (s.dd_flow * a * a + s.d_flow * r.dd * z[3 + i]);
    h(i, 3 + i) += cross;
    h(3 + i, i) += cross;
    h(3 + i, 3 + i) += m * s.dd_flow * b * b;
  }
}

void ReferenceGoal::bounds(double* lower, double* upper) const {
  for (std::size_t i = 0; i < 2; ++i) lower[i] = upper[i] = problem_->goal[i];
}

void ReferenceGoal::value(const double* q, double* g) {
  const ReferenceProblem& p = *problem_;
  const double phi = q[0] + q[1], reach = p.L2 + q[2];
  g[0] = p.base[0] + p.L1 * std::cos(q[0]) + reach * std::cos(phi);
  g[1] = p.base[1] + p.L1 * std::sin(q[0]) + reach * std::sin(phi);
}

void ReferenceGoal::jacobian(const double* q, double* jacobian) {
  const ReferenceProblem& p = *problem_;
  const double phi = q[0] + q[1], reach = p.L2 + q[2];
  const double s = std::sin(phi), c = std::cos(phi);
  const double rows[6] = {-p.L1 * std::sin(q[0]) - reach * s, -reach * s, c,
                          p.L1 * std::cos(q[0]) + reach * c,  reach * c,  s};
  std::copy(rows, rows + 6, jacobian);
}

void ReferenceGoal::add_hessian(const double* q, const double* multiplier, double* hessian) {
  const ReferenceProblem& p = *problem_;
  const double phi = q[0] + q[1], reach = p.L2 + q[2];
  const double s = std::sin(phi), c = std::cos(phi);
  const double turn = -reach * (multiplier[0] * c + multiplier[1] * s);
  const double slide = -multiplier[0] * s + multiplier[1] * c;
  Eigen::Map<Matrix3d> h(hessian);
  h.topLeftCorner<2, 2>().array() += turn;
  h(0, 0) -= p.L1 * (multiplier[0] * std::cos(q[0]) + multiplier[1] * std::sin(q[0]));
  h.block<2, 1>(0, 2).array() += slide;
  h.block<1, 2>(2, 0).array() += slide;
}

Transcription reference_transcription(std::shared_ptr<const ReferenceProblem> problem) {
  const ReferenceProblem& p = *problem;
  const auto vec = [](const std::array<double, 3>& v) -> Eigen::VectorXd {
    return Vector3d(v[0], v[1], v[2]);
  };
  const int n = p.intervals;
  TranscriptionSpec spec;
  spec.t = Eigen::VectorXd::LinSpaced(n + 1, 0.0, p.duration);
  spec.knot = std::make_shared<ReferenceKnot>(problem);
  spec.terminal = std::make_shared<ReferenceGoal>(problem);
  spec.bounds = TranscriptionBounds::uniform(
      n, {vec(p.q_lb), vec(p.q_ub)}, {vec(p.qd_lb), vec(p.qd_ub)}, {vec(p.qdd_lb), vec(p.qdd_ub)});
  spec.bounds.rest_to_rest(vec(p.q_start));
  spec.acceleration_weight = Eigen::VectorXd::Constant(3, p.w_acc);
  spec.acceleration_weight_times_step = false;
  spec.joint_names = {"th1", "th2", "d"};
  Transcription nlp(std::move(spec));

  // Straight line in joint space; the rates are its slope, except for rest at both ends.
  const Eigen::VectorXd first = vec(p.q_start), way = vec(p.q_goal_guess) - first;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(nlp.size().variables);
  for (int k = 0; k <= n; ++k) {
    for (int i = 0; i < 3; ++i) {
      x[nlp.q_index(k, i)] = first[i] + way[i] * k / n;
      if (k > 0 && k < n) x[nlp.qd_index(k, i)] = way[i] / p.duration;
    }
  }
  nlp.set_start(x);
  return nlp;
}

}  // namespace sparflow::bench
