#include "diagnosis/evidence/sensor_noise.h"

#include <cmath>
#include <vector>

#include "models/math/nan.h"
#include "models/math/robust.h"

namespace sparflow {

double raw_noise(const Eigen::VectorXd& x, int fewest_differences) {
  std::vector<double> d = third_differences(x, 0, x.size());
  if (d.size() < static_cast<std::size_t>(fewest_differences)) return kNaN;
  return robust_std(Eigen::Map<Eigen::VectorXd>(d.data(), static_cast<Eigen::Index>(d.size()))) /
         kThirdDifferenceNoise;
}

void MeanNoise::add(const Eigen::VectorXd& raw, double gain) {
  const double noise = raw_noise(raw, fewest_);
  if (!std::isfinite(noise)) return;
  sum_ += noise * gain;
  ++logs_;
}

double MeanNoise::value() const { return logs_ > 0 ? sum_ / logs_ : kNaN; }

}  // namespace sparflow
