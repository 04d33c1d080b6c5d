#include <Eigen/Dense>
#include <algorithm>
#include <random>
#include <vector>

#include "bench/motion_speed_derivatives.h"

namespace sparflow::bench {
namespace {

// Steps in rad, m and their rates. The smooth maximum varies over 0.3 bar, some 3e-3 rad; these steps balance
// truncation and rounding there.
constexpr double kFirstStep = 1e-6;
constexpr double kSecondStep = 1e-4;

class Differenced final : public WrappedKnotModel {
 public:
  explicit Differenced(std::shared_ptr<KnotModel> inner)
      : WrappedKnotModel(std::move(inner)),
        z_(static_cast<std::size_t>(size())),
        ahead_(static_cast<std::size_t>(path_count())),
        behind_(ahead_) {}

  double cost_derivatives(const double* z, double* gradient, double* hessian) override {
    return differentiate([this](const double* x) { return inner_->cost(x); }, z, gradient, hessian,
                         1.0);
  }

  void path_jacobian(const double* z, double* g, double* jacobian) override {
    inner_->path(z, g);
    std::copy_n(z, z_.size(), z_.begin());
    const std::size_t n = z_.size();
    for (std::size_t i = 0; i < n; ++i) {
      z_[i] = z[i] + kFirstStep;
      inner_->path(z_.data(), ahead_.data());
      z_[i] = z[i] - kFirstStep;
      inner_->path(z_.data(), behind_.data());
      z_[i] = z[i];
      for (std::size_t r = 0; r < ahead_.size(); ++r)
        jacobian[r * n + i] = (ahead_[r] - behind_[r]) / (2.0 * kFirstStep);
    }
  }

  void add_path_hessian(const double* z, const double* multiplier, double* hessian) override {
    const auto weighted = [&](const double* x) {
      inner_->path(x, ahead_.data());
      double sum = 0.0;
      for (std::size_t r = 0; r < ahead_.size(); ++r) sum += multiplier[r] * ahead_[r];
      return sum;
    };
    std::vector<double> own(z_.size() * z_.size());
    differentiate(weighted, z, nullptr, own.data(), 1.0);
    for (std::size_t i = 0; i < own.size(); ++i) hessian[i] += own[i];
  }

 private:
  template <class Function>
  double differentiate(const Function& f, const double* z, double* gradient, double* hessian,
                       double scale) {
    const std::size_t n = z_.size();
    std::copy_n(z, n, z_.begin());
    const double centre = f(z_.data());
    const auto moved = [&](std::size_t i, double di, std::size_t j, double dj) {
      z_[i] += di;
      z_[j] += dj;
      const double value = f(z_.data());
      z_[i] = z[i];
      z_[j] = z[j];
      return value;
    };
    for (std::size_t i = 0; i < n; ++i) {
      const double h = kSecondStep;
      if (gradient != nullptr)
        gradient[i] = scale * (moved(i, kFirstStep, i, 0.0) - moved(i, -kFirstStep, i, 0.0)) /
                      (2.0 * kFirstStep);
      hessian[i * n + i] =
          scale * (moved(i, h, i, 0.0) - 2.0 * centre + moved(i, -h, i, 0.0)) / (h * h);
      for (std::size_t j = 0; j < i; ++j) {
        const double mixed =
            scale *
            (moved(i, h, j, h) - moved(i, h, j, -h) - moved(i, -h, j, h) + moved(i, -h, j, -h)) /
            (4.0 * h * h);
        hessian[i * n + j] = hessian[j * n + i] = mixed;
      }
    }
    return scale * centre;
  }

  std::vector<double> z_, ahead_, behind_;
};

}  // namespace

std::shared_ptr<KnotModel> with_finite_differences(std::shared_ptr<KnotModel> inner) {
  return std::make_shared<Differenced>(std::move(inner));
}

double largest_difference(KnotModel& a, KnotModel& b, const MotionProblem& problem,
                          const ModeTable& modes, int points) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  const int n = a.joint_count(), size = a.size();
  Eigen::VectorXd z(size), ga(size), gb(size);
  Eigen::MatrixXd ha(size, size), hb(size, size);
  double worst = 0.0;
  for (int k = 0; k < points; ++k) {
    const int interval = k % static_cast<int>(modes.rows());
    a.begin_node(interval, interval);
    b.begin_node(interval, interval);
    for (int j = 0; j < n; ++j) {
      const auto i = static_cast<std::size_t>(j);
      const Range& q = problem.limits.position[i];
      z[j] = q.lo + unit(random) * (q.hi - q.lo);
      const int c = problem.machine.cylinder_of_joint(j);
      const CylinderMode mode = modes(interval, c);
      const double rate = linkage_rates(problem.machine, c, z[j]).d1;
      double direction = 0.0;
      if (mode == CylinderMode::kExtend) direction = 1.0;
      if (mode == CylinderMode::kRetract) direction = -1.0;
      z[n + j] = direction * (rate > 0.0 ? 1.0 : -1.0) * unit(random) *
                 std::abs(problem.limits.velocity[i].hi);
    }
    const double va = a.cost_derivatives(z.data(), ga.data(), ha.data());
    const double vb = b.cost_derivatives(z.data(), gb.data(), hb.data());
    worst = std::max(worst, std::abs(va - vb) / std::max(1.0, std::abs(va)));
    worst =
        std::max(worst, (ga - gb).cwiseAbs().maxCoeff() / std::max(1.0, ga.cwiseAbs().maxCoeff()));
    worst =
        std::max(worst, (ha - hb).cwiseAbs().maxCoeff() / std::max(1.0, ha.cwiseAbs().maxCoeff()));
  }
  return worst;
}

}  // namespace sparflow::bench
