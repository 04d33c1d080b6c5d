#include "diagnosis/regression/least_squares_comparison.h"

#include <cmath>

namespace sparflow {

using Eigen::VectorXd;

LeastSquaresResidual least_squares_residual(const Evidence& evidence,
                                            const std::vector<const EffectDesign*>& base,
                                            const EffectDesign& effect,
                                            const std::vector<bool>& active) {
  std::vector<const EffectDesign*> with;
  for (const EffectDesign* b : base) {
    bool meets = false;
    for (std::size_t c = 0; c < active.size(); ++c) meets = meets || (active[c] && b->touches(c));
    if (meets) with.push_back(b);
  }
  with.push_back(&effect);
  FitControl control;
  control.active = active;
  control.ordinary = true;
  control.keep_residuals = true;
  LeastSquaresResidual out;
  out.residual = fit_effects(evidence, with, nullptr, control).residual;
  for (std::size_t c = 0; c < active.size(); ++c) out.channels.push_back(effect.touches(c));
  return out;
}

double least_squares_advantage(const Evidence& evidence, const LeastSquaresResidual& other,
                               const LeastSquaresResidual& one, const RegressionOptions& options) {
  std::vector<double> differences;
  double rows = 0.0, sum = 0.0;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    if (!one.channels[c] || !other.channels[c]) continue;
    const EvidenceChannel& channel = evidence.channels[c];
    const VectorXd &a = one.residual[c], &b = other.residual[c];
    const auto n = static_cast<double>(channel.rows());
    const double unit = a.squaredNorm() / n;
    if (!(unit > 0.0)) continue;
    rows += n;
    for (const NoiseBlock& block : channel.blocks) {
      const Eigen::Index length = block.last - block.first;
      const double d = (a.segment(block.first, length).squaredNorm() -
                        b.segment(block.first, length).squaredNorm()) /
                       unit;
      differences.push_back(d);
      sum += d;
    }
  }
  const auto count = static_cast<double>(differences.size());
  if (count < 2.0 || sum < options.least_advantage * rows) return 0.0;
  double squares = 0.0;
  for (const double d : differences) squares += (d - sum / count) * (d - sum / count);
  return sum > options.advantage_standard_errors * std::sqrt(squares * count / (count - 1.0)) ? sum
                                                                                              : 0.0;
}

}  // namespace sparflow
