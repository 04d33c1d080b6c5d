#include "diagnosis/evidence/filled_chambers.h"

#include <algorithm>
#include <cmath>

#include "identification/log/segments.h"

namespace sparflow {

using Eigen::Index;

Mask chambers_filled(const MachineSignals& signals, const CylinderSignals& cylinder,
                     double least_pressure) {
  const Index samples = cylinder.speed.size();
  Mask filled = Mask::Constant(samples, true);
  const Eigen::VectorXd &a = cylinder.pressure_a_smooth, &b = cylinder.pressure_b_smooth;
  if (a.size() != samples || b.size() != samples) return filled;
  const bool commanded = cylinder.has_command();
  constexpr double kClearly = 5.0;  // times the speed threshold, above what noise at rest reaches
  const SegmentOptions rest;
  const auto half = static_cast<Index>(std::lround(0.5 * signals.window / signals.step));
  for (Index k = 0; k < samples; ++k) {
    const double speed = cylinder.speed[k], command = commanded ? cylinder.command[k] : 0.0;
    const bool extends = speed > kClearly * rest.speed || command > rest.command;
    const bool retracts = speed < -kClearly * rest.speed || command < -rest.command;
    if (!((extends && a[k] < least_pressure) || (retracts && b[k] < least_pressure))) continue;
    const Index first = std::max<Index>(0, k - half);
    filled.segment(first, std::min(samples, k + half + 1) - first).setConstant(false);
  }
  return filled;
}

}  // namespace sparflow
