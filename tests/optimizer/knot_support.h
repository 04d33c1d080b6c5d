#pragma once
/// Shared by the tests of crane knots: numeric derivatives, states and problems of any machine.
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "models/files/machine_file.h"
#include "problems/bundled.h"
#include "problems/problem.h"

namespace sparflow::test_support {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

/// Central differences with one Richardson step: error O(h^4), so h may be large enough to keep rounding down.
inline Vector numeric_gradient(const std::function<double(const Vector&)>& f, const Vector& z,
                               double h) {
  Vector g(z.size());
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const auto central = [&](double step) {
      Vector a = z, b = z;
      a[i] += step;
      b[i] -= step;
      return (f(a) - f(b)) / (2.0 * step);
    };
    g[i] = (4.0 * central(0.5 * h) - central(h)) / 3.0;
  }
  return g;
}

inline MotionProblem problem_for(const Machine& machine, unsigned seed) {
  MotionProblem problem;
  problem.machine = machine;
  problem.payload = 350.0;
  problem.limits = limits_of(machine);
  for (double& p : problem.limits.pump_max_pressure) p = std::max(p, 1.0);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.2, 0.8);
  const auto posture = [&] {
    Vector q(machine.joint_count());
    for (int j = 0; j < machine.joint_count(); ++j) {
      const Range& r = machine.joints[static_cast<std::size_t>(j)].position;
      q[j] = r.lo + unit(random) * (r.hi - r.lo);
    }
    return q;
  };
  problem.start = posture();
  problem.goal = TipGoal{tip_position<double>(machine, posture())};
  problem.tip_line = TipLine{0.5};
  problem.obstacles.push_back({"ball", Sphere{{3.0, 0.2, 1.0}, 0.4}});
  problem.obstacles.push_back({"box", Box{{5.0, 0.1, 0.5}, {0.6, 0.8, 0.5}}});
  problem.obstacles.push_back({"ground", HalfSpace{{0.0, 0.0, -1.0}, {0.0, 0.0, 1.0}}});
  return problem;
}

inline Vector random_state(const Machine& machine, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const int n = machine.joint_count();
  Vector z(2 * n);
  for (int j = 0; j < n; ++j) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(j)];
    z[j] = joint.position.lo + (0.1 + 0.8 * unit(random)) * (joint.position.hi - joint.position.lo);
    // About every second speed is so small that it lies in the blending zone of the smooth law.
    const double slow = unit(random) < 0.5 ? 0.02 : 0.7;
    z[n + j] = slow * (2.0 * unit(random) - 1.0) * joint.velocity.hi;
  }
  return z;
}

inline std::vector<std::string> machine_files() {
  std::vector<std::string> names;
  for (const std::string& path : bundled_files("machines", ".yaml"))
    names.push_back(path.substr(path.rfind('/') + 1));
  return names;
}

inline std::string machine_test_name(const ::testing::TestParamInfo<std::string>& info) {
  std::string name = info.param.substr(0, info.param.find('.'));
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

}  // namespace sparflow::test_support
