#include "diagnosis/evidence/force_low_pass.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "diagnosis/evidence/sensor_noise.h"
#include "identification/signals/low_pass.h"
#include "models/machine/inertial_torque.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Noise of the accelerations over that of the pressures that is left.
/// @threshold [1] 1..10; tuned: with 1 logs whose accelerations are twice as noisy lost the rows at the ends of every motion, and a drifting
/// sensor with them; plants 743 and 748 keep their frictions
constexpr double kNoiseRatio = 3.0;
constexpr Index kPostures = 50;  // no threshold: an inertia changes little between them

VectorXd full_convolution(const VectorXd& a, const VectorXd& b) {
  VectorXd out = VectorXd::Zero(a.size() + b.size() - 1);
  for (Index k = 0; k < b.size(); ++k) out.segment(k, a.size()) += b[k] * a;
  return out;
}

/// Mean square of the force by which a cylinder accelerates the machine, by joint that accelerates. [joints, (N s^2)^2]
VectorXd squared_inertia(const Machine& machine, const MachineSignals& log, int cylinder) {
  const CylinderSignals& c = log.cylinders[static_cast<std::size_t>(cylinder)];
  const int joint = machine.cylinders[static_cast<std::size_t>(cylinder)].joint;
  const Index n = machine.joint_count();
  VectorXd sum = VectorXd::Zero(n);
  double count = 0.0;
  const VectorXd rest = VectorXd::Zero(n);
  for (Index k = 0; k < kPostures; ++k) {
    const Index row = k * log.q.rows() / kPostures;
    const VectorXd q = log.q.row(row);
    if (!log.usable[row] || !q.allFinite() || c.rate[row] == 0.0) continue;
    try {
      for (Index j = 0; j < n; ++j) {
        const VectorXd torque = inertial_torque<double>(
            machine, q, rest, VectorXd(VectorXd::Unit(n, j)), log.payload[row]);
        sum[j] += std::pow(torque[joint] / c.rate[row], 2);
      }
      count += 1.0;
    } catch (const std::domain_error&) {
      // a measured posture in which a linkage cannot close
    }
  }
  return count > 0.0 ? VectorXd(sum / count) : sum;
}

}  // namespace

ForceNoise::ForceNoise(const Machine& machine, const MachineSignals& log, int cylinder,
                       const EvidenceOptions& options)
    : step_(log.step), force_pass_(low_pass_of(log.step, log.window, log.order, 2)) {
  const CylinderSignals& c = log.cylinders[static_cast<std::size_t>(cylinder)];
  if (!c.has_force()) return;
  pressures_ = raw_noise(c.force, options.fewest_differences);
  const VectorXd inertia = squared_inertia(machine, log, cylinder);
  double squares = 0.0;
  for (Index j = 0; j < inertia.size(); ++j) {
    const double noise = raw_noise(log.q_measured.col(j), options.fewest_differences);
    if (std::isfinite(noise)) squares += noise * noise * inertia[j];
  }
  accelerations_ = std::sqrt(squares);
  for (const double f : c.force)
    if (std::isfinite(f)) largest_ = std::max(largest_, std::abs(f));
  known_ = std::isfinite(pressures_);
}

double ForceNoise::of_pressures(double width) const {
  return pressures_ * full_convolution(force_pass_, raised_cosine(width, step_)).norm();
}

double ForceNoise::of_accelerations(double width) const {
  const VectorXd differences = Eigen::Vector3d(1.0, -2.0, 1.0);
  const VectorXd second = full_convolution(force_pass_, differences) / (step_ * step_);
  return accelerations_ * full_convolution(second, raised_cosine(width, step_)).norm();
}

VectorXd raised_cosine(double width, double step) {
  const auto half = static_cast<Index>(std::lround(0.5 * width / step));
  if (half < 1) return VectorXd::Ones(1);
  const VectorXd at =
      VectorXd::LinSpaced(2 * half + 1, -static_cast<double>(half), static_cast<double>(half)) *
      (std::numbers::pi / static_cast<double>(half + 1));
  const VectorXd kernel = 1.0 + at.array().cos();
  return kernel / kernel.sum();
}

double low_pass_width(const Machine& machine, std::span<const MachineSignals* const> logs,
                      int cylinder, const EvidenceOptions& options) {
  double width = 0.0;
  if (options.force_widths.empty()) return width;
  const std::vector<double>& widths = options.force_widths;
  for (const MachineSignals* log : logs) {
    const ForceNoise noise(machine, *log, cylinder, options);
    if (!noise.known()) continue;
    const double matters = options.force_noise_share * noise.largest_force();
    const auto enough = std::find_if(widths.begin(), widths.end(), [&](double w) {
      return noise.of_accelerations(w) <= std::max(kNoiseRatio * noise.of_pressures(w), matters);
    });
    width = std::max(width, enough != widths.end() ? *enough : widths.back());
  }
  return width;
}

}  // namespace sparflow
