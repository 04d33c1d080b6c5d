#include "models/hydraulics/gaussian_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::VectorXd;

void require(bool condition, const char* key, const std::string& message) {
  if (!condition) throw InputError({}, key, message);
}

void check_parameters(const GpParameters& p) {
  const auto positive = [](double value, const char* key) {
    require(std::isfinite(value) && value > 0.0, key,
            fmt::format("got {}, expected a positive number", value));
  };
  positive(p.length_flow, "length_flow");
  positive(p.length_force, "length_force");
  require(std::isfinite(p.signal_std) && p.signal_std >= 0.0, "signal_std",
          fmt::format("got {}, expected a number that is not negative", p.signal_std));
  require(std::isfinite(p.mean_constant + p.mean_slope + p.mean_flow_slope), "mean_constant",
          "the mean is not finite");
  const Index n = p.weight.size();
  require(p.flow.size() == n && p.force.size() == n, "weight",
          fmt::format("got {} weights for {} flows and {} forces, expected as many of each", n,
                      p.flow.size(), p.force.size()));
  require(p.flow.allFinite() && p.force.allFinite() && p.weight.allFinite(), "weight",
          "a centre or weight is not finite");
  const Index rows = p.variance_core.rows();
  require(p.variance_core.size() == 0 ||
              ((rows == n + 2 || rows == n + 3) && p.variance_core.cols() == rows),
          "variance_core",
          fmt::format(
              "got {} x {}, expected {} x {} (centres + 2) or one more with a slope over the flow",
              rows, p.variance_core.cols(), n + 2, n + 2));
  require(p.variance_core.allFinite(), "variance_core", "a value is not finite");
  const BranchCorner& c = p.corner;
  require(std::isfinite(c.level + c.per_flow + c.per_force), "corner", "a value is not finite");
  const LoadsBeyond& b = p.beyond;
  require(b.side == 0 || (std::abs(b.side) == 1 && p.force_max >= p.force_min), "beyond.side",
          "expected 1 or -1, and a range of forces");
  if (b.side == 0) return;
  positive(b.static_slope, "beyond.static_slope");
  const auto rises = [&](double slope) { return slope >= 0.0 && slope <= b.static_slope; };
  require(rises(b.slope_heavier) && rises(b.slope_lighter), "beyond.slopes",
          "expected numbers from 0 to that of the static branch");
  require(std::isfinite(b.static_level) && std::isfinite(b.least), "beyond.static_level",
          "a value is not finite");
}

ArrayXd padded(const ArrayXd& values, double scale) {
  const std::size_t n = kernel_padded(static_cast<std::size_t>(values.size()));
  ArrayXd out = ArrayXd::Zero(static_cast<Index>(n));
  out.head(values.size()) = values * scale;
  return out;
}

/// One scratch array for each thread, so that threads can share a process.
double* scratch(std::size_t size) {
  thread_local std::vector<double> buffer;
  if (buffer.size() < size) buffer.resize(size);
  return buffer.data();
}

}  // namespace

const char* pressure_law_name(PressureLaw law) {
  return law == PressureLaw::kPlane ? "plane" : "plane + process";
}

GaussianProcess::GaussianProcess(GpParameters parameters) : parameters_(std::move(parameters)) {
  check_parameters(parameters_);
  inverse_length_flow_ = 1.0 / parameters_.length_flow;
  inverse_length_force_ = 1.0 / parameters_.length_force;
  scaled_flow_ = padded(parameters_.flow, inverse_length_flow_);
  scaled_force_ = padded(parameters_.force, inverse_length_force_);
  scaled_weight_ = padded(parameters_.weight, parameters_.signal_std * parameters_.signal_std);
}

KernelCentres GaussianProcess::centres() const {
  return {scaled_flow_.data(), scaled_force_.data(), scaled_weight_.data(),
          static_cast<std::size_t>(scaled_weight_.size())};
}

double GaussianProcess::force_scale() const {
  double scale = parameters_.length_force;
  if (parameters_.corner.there()) scale = std::min(scale, corner_width(parameters_.corner));
  if (parameters_.beyond.side != 0) scale = std::min(scale, loads_beyond::bend(parameters_.beyond));
  return scale;
}

double GaussianProcess::mean(double flow, double force) const {
  if (!is_beyond(force)) return learned_mean(flow, force);
  return pressure_beyond(parameters_.beyond, force, parameters_.force_min, parameters_.force_max,
                         [&](double f) { return learned_mean(flow, f); });
}

GpDerivatives GaussianProcess::mean_derivatives(double flow, double force) const {
  if (!is_beyond(force)) return learned_derivatives(flow, force);
  const Jet q = Jet::variable(flow, 0, 2);
  const Jet p = pressure_beyond(
      parameters_.beyond, Jet::variable(force, 1, 2), parameters_.force_min, parameters_.force_max,
      [&](const Jet& f) {
        const GpDerivatives g = learned_derivatives(flow, f.value);
        return Jet::chain(
            q, f, {g.value, g.d_flow, g.d_force, g.d_flow_flow, g.d_flow_force, g.d_force_force});
      });
  return {p.value, p.gradient(0), p.gradient(1), p.hessian(0, 0), p.hessian(1, 0), p.hessian(1, 1)};
}

double GaussianProcess::learned_mean(double flow, double force) const {
  const BranchCorner& corner = parameters_.corner;
  return parameters_.mean_constant + parameters_.mean_slope * force +
         parameters_.mean_flow_slope * flow +
         (corner.there() ? corner_rise(corner, flow, force).value : 0.0) +
         kernel_sum(centres(), flow * inverse_length_flow_, force * inverse_length_force_);
}

GpDerivatives GaussianProcess::learned_derivatives(double flow, double force) const {
  const double a = inverse_length_flow_, b = inverse_length_force_;
  const KernelSums s = kernel_sum_derivatives(centres(), flow * a, force * b);
  GpDerivatives out;
  out.value = parameters_.mean_constant + parameters_.mean_slope * force +
              parameters_.mean_flow_slope * flow + s.value;
  out.d_flow = s.d_x * a + parameters_.mean_flow_slope;
  out.d_force = s.d_y * b + parameters_.mean_slope;
  out.d_flow_flow = s.d_xx * a * a;
  out.d_flow_force = s.d_xy * a * b;
  out.d_force_force = s.d_yy * b * b;
  if (!parameters_.corner.there()) return out;
  const CornerRise rise = corner_rise(parameters_.corner, flow, force);
  out.value += rise.value;
  out.d_flow += rise.d_flow;
  out.d_force += rise.d_force;
  out.d_flow_flow += rise.d_flow_flow;
  out.d_flow_force += rise.d_flow_force;
  out.d_force_force += rise.d_force_force;
  return out;
}

double GaussianProcess::variance(double flow, double force) const {
  const double prior = parameters_.signal_std * parameters_.signal_std;
  if (parameters_.variance_core.size() == 0) return prior;
  const Index n = parameters_.weight.size();
  const Index stride = scaled_weight_.size() + 3, rows = parameters_.variance_core.rows();
  double* memory = scratch(static_cast<std::size_t>(2 * stride));
  kernel_vector(centres(), flow * inverse_length_flow_, force * inverse_length_force_, memory);
  Eigen::Map<VectorXd> basis(memory, rows), product(memory + stride, rows);
  basis.head(n) *= prior;
  basis[n] = 1.0;
  basis[n + 1] = force;
  if (rows == n + 3) basis[n + 2] = flow;
  product.noalias() = parameters_.variance_core * basis;
  // Rounding can leave a tiny negative number where the data determine the pressure precisely.
  return std::max(0.0, prior - basis.dot(product));
}

GpDerivatives GaussianProcess::variance_derivatives(double flow, double force) const {
  const double prior = parameters_.signal_std * parameters_.signal_std;
  GpDerivatives out;
  out.value = prior;
  if (parameters_.variance_core.size() == 0) return out;
  const Index n = parameters_.weight.size();
  const Index stride = scaled_weight_.size() + 3, rows = parameters_.variance_core.rows();
  double* memory = scratch(static_cast<std::size_t>(6 * stride));
  const double a = inverse_length_flow_, b = inverse_length_force_;
  kernel_vector(centres(), flow * a, force * b, memory);
  Eigen::Map<VectorXd> basis(memory, rows), d_flow(memory + stride, rows),
      d_force(memory + 2 * stride, rows), c_basis(memory + 3 * stride, rows),
      c_flow(memory + 4 * stride, rows), c_force(memory + 5 * stride, rows);
  basis.head(n) *= prior;
  const auto u = ((flow * a - scaled_flow_.head(n)) * a).matrix();
  const auto v = ((force * b - scaled_force_.head(n)) * b).matrix();
  d_flow.head(n) = -basis.head(n).cwiseProduct(u);
  d_force.head(n) = -basis.head(n).cwiseProduct(v);
  basis[n] = 1.0;
  basis[n + 1] = force;
  d_flow[n] = d_flow[n + 1] = d_force[n] = 0.0;
  d_force[n + 1] = 1.0;
  if (rows == n + 3) {
    basis[n + 2] = flow;
    d_flow[n + 2] = 1.0;
    d_force[n + 2] = 0.0;
  }
  c_basis.noalias() = parameters_.variance_core * basis;
  c_flow.noalias() = parameters_.variance_core * d_flow;
  c_force.noalias() = parameters_.variance_core * d_force;
  out.value = std::max(0.0, prior - basis.dot(c_basis));
  out.d_flow = -2.0 * d_flow.dot(c_basis);
  out.d_force = -2.0 * d_force.dot(c_basis);
  // Second derivatives of the kernel: k_uu = k (u^2 - a^2), k_uv = k u v; the mean's basis has none.
  const auto weighted = basis.head(n).cwiseProduct(c_basis.head(n));
  const double k_uu = weighted.dot((u.array().square() - a * a).matrix());
  const double k_uv = weighted.dot(u.cwiseProduct(v));
  const double k_vv = weighted.dot((v.array().square() - b * b).matrix());
  out.d_flow_flow = -2.0 * (d_flow.dot(c_flow) + k_uu);
  out.d_flow_force = -2.0 * (d_flow.dot(c_force) + k_uv);
  out.d_force_force = -2.0 * (d_force.dot(c_force) + k_vv);
  return out;
}

}  // namespace sparflow
