#include "identification/signals/recorded_motion.h"

namespace sparflow {

Trajectory recorded_motion(const Machine& machine, const MachineSignals& signals,
                           const SampleRange& range) {
  Trajectory motion;
  motion.t = signals.time.segment(range.begin, range.size());
  motion.q = signals.q.middleRows(range.begin, range.size());
  motion.qd = signals.qd.middleRows(range.begin, range.size());
  for (int j = 0; j < machine.joint_count(); ++j) {
    const int cylinder = machine.cylinder_of_joint(j);
    if (cylinder < 0) continue;
    const Mask& moving = signals.cylinders[static_cast<std::size_t>(cylinder)].moving;
    for (Eigen::Index k = 0; k < motion.size(); ++k) {
      if (!moving[range.begin + k]) motion.qd(k, j) = 0.0;
    }
  }
  motion.qdd.setZero(motion.q.rows(), motion.q.cols());
  for (Eigen::Index k = 0; k + 1 < motion.size(); ++k)
    motion.qdd.row(k) = (motion.qd.row(k + 1) - motion.qd.row(k)) / (motion.t[k + 1] - motion.t[k]);
  if (motion.size() > 1) motion.qdd.row(motion.size() - 1) = motion.qdd.row(motion.size() - 2);
  return motion;
}

SampleRange longest_stretch(const MachineSignals& signals) {
  SampleRange longest;
  for (const SampleRange& run : signals.runs) {
    Eigen::Index begin = run.begin;
    for (Eigen::Index k = run.begin; k <= run.end; ++k) {
      const bool known =
          k < run.end && signals.q.row(k).allFinite() && signals.qd.row(k).allFinite();
      if (known) continue;
      if (k - begin > longest.size()) longest = {begin, k};
      begin = k + 1;
    }
  }
  return longest;
}

}  // namespace sparflow
