#include "identification/machine_from_log/sketch_samples.h"

#include <algorithm>
#include <cmath>

#include "identification/signals/signals.h"
#include "models/machine/linkage.h"
#include "models/math/nan.h"
#include "models/math/robust.h"

namespace sparflow::from_log {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Standard deviation of white noise, by third differences. Exact zeros are rests within one digit and tell nothing.
double white_noise(const Log& log, const VectorXd& values) {
  std::vector<double> size;
  for (const SampleRange& run : log.runs) {
    for (const double d : third_differences(values, run.begin, run.end)) {
      if (d != 0.0) size.push_back(d);
    }
  }
  if (size.empty()) return 0.0;
  return robust_std(VectorXd::Map(size.data(), static_cast<Index>(size.size()))) /
         kThirdDifferenceNoise;
}

/// Of each sample the rate in its window that is smallest in size; 0 where the window has both directions or leaves its run.
VectorXd least_rates(const Log& log, const VectorXd& rate, double window) {
  VectorXd least = VectorXd::Zero(rate.size());
  for (const SampleRange& run : log.runs) {
    Index first = run.begin, end = run.begin;
    for (Index k = run.begin; k < run.end; ++k) {
      const double from = log.time[k] - 0.5 * window, to = log.time[k] + 0.5 * window;
      while (log.time[first] < from) ++first;
      while (end < run.end && log.time[end] <= to) ++end;
      if (log.time[run.begin] > from || log.time[run.end - 1] < to) continue;
      const double lo = rate.segment(first, end - first).minCoeff();
      const double hi = rate.segment(first, end - first).maxCoeff();
      least[k] = lo > 0.0 ? lo : hi < 0.0 ? hi : 0.0;
    }
  }
  return least;
}

/// The rows of one log that are kept: every `stride`-th.
struct Picker {
  const Log& log;
  Index stride;
  Index at;    ///< first row of this log
  Index rows;  ///< of all logs
  Index count() const { return (log.samples() + stride - 1) / stride; }
  VectorXd picked(const VectorXd& values) const {
    VectorXd out(count());
    for (Index k = 0; k < out.size(); ++k) out[k] = values[k * stride];
    return out;
  }
};

/// Writes values of one log into its rows; `all` is made when the first log has it.
void put(const Picker& pick, const VectorXd& values, VectorXd& all) {
  if (all.size() == 0) all = VectorXd::Constant(pick.rows, kNaN);
  all.segment(pick.at, pick.count()) = pick.picked(values);
}

void put_channel(const Picker& pick, const SavitzkyGolay& filter, Role role, int index,
                 VectorXd& all) {
  const Channel* channel = pick.log.find(role, index);
  if (channel != nullptr) put(pick, filter.apply(channel->values, 0), all);
}

void put_cylinder(const Picker& pick, const SavitzkyGolay& filter, int index, CylinderRows& c) {
  if (const Channel* stroke = pick.log.find(Role::kStroke, index)) {
    put(pick, stroke->values, c.stroke);
    Smoothed smooth = filter.smooth(stroke->values);
    quieten_acceleration(pick.log.time, pick.log.runs, stroke->values, filter, smooth.second);
    put(pick, smooth.value, c.stroke_value);
    put(pick, smooth.first, c.stroke_rate);
    put(pick, least_rates(pick.log, smooth.first, filter.window()), c.stroke_rate_least);
    put(pick, smooth.second, c.stroke_bend);
    c.stroke_noise = std::max(c.stroke_noise, white_noise(pick.log, stroke->values));
  }
  put_channel(pick, filter, Role::kPressureA, index, c.pressure_a);
  put_channel(pick, filter, Role::kPressureB, index, c.pressure_b);
  put_channel(pick, filter, Role::kForce, index, c.force);
  put_channel(pick, filter, Role::kFlow, index, c.flow);
  if (pick.log.find(Role::kFlow, index) != nullptr) c.flow = c.flow.cwiseAbs().eval();
}

/// Blocks, and which of them are held out.
void put_blocks(const Picker& pick, bool test, bool share, const MachineFromLogOptions& options,
                SketchRows& out) {
  // Blocks of one log continue behind those of the log before and begin a cluster of their own.
  const int motion = options.hold_out_blocks;
  const int first_block = pick.at == 0 ? 0 : (out.block[pick.at - 1] / motion + 1) * motion;
  const Index at = pick.at;
  const int group = options.hold_out_every * options.hold_out_blocks;
  for (Index k = 0; k < pick.count(); ++k) {
    const double t = pick.log.time[k * pick.stride] - pick.log.time[0];
    const int block = static_cast<int>(t / options.block_s);
    out.block[at + k] = first_block + block;
    out.held_out[at + k] = test || (share && block % group >= group - options.hold_out_blocks);
  }
}

void put_log(const Machine& machine, const Picker& pick, const MachineFromLogOptions& options,
             SketchRows& out) {
  const Log& log = pick.log;
  const SavitzkyGolay filter = make_filter(log, options.smoothing);
  const Index at = pick.at, n = pick.count();
  out.time.segment(at, n) = pick.picked(log.time);
  for (int j = 0; j < machine.joint_count(); ++j) {
    const Channel* channel = log.find(Role::kJointPosition, j);
    if (channel == nullptr) continue;
    Smoothed smooth = filter.smooth(channel->values);
    quieten_acceleration(log.time, log.runs, channel->values, filter, smooth.second);
    out.position.col(j).segment(at, n) = pick.picked(channel->values);
    out.q.col(j).segment(at, n) = pick.picked(smooth.value);
    out.qd.col(j).segment(at, n) = pick.picked(smooth.first);
    out.qdd.col(j).segment(at, n) = pick.picked(smooth.second);
    out.qd_least.col(j).segment(at, n) =
        pick.picked(least_rates(log, smooth.first, filter.window()));
    const double noise = white_noise(log, channel->values);
    out.position_noise[j] = std::max(out.position_noise[j], noise);
    out.rate_noise[j] = std::max(out.rate_noise[j], noise * filter.noise_gain(1));
  }
  if (const Channel* payload = log.find(Role::kPayload)) {
    out.payload.segment(at, n) = pick.picked(payload->values);
  } else {
    out.payload_logged = false;
  }
  for (int i = 0; i < machine.cylinder_count(); ++i)
    put_cylinder(pick, filter, i, out.cylinders[static_cast<std::size_t>(i)]);
  for (const SampleRange& run : log.runs) {
    for (Index k = (run.begin + pick.stride - 1) / pick.stride; k * pick.stride < run.end; ++k) {
      const double t = log.time[k * pick.stride];
      const double edge = std::min(t - log.time[run.begin], log.time[run.end - 1] - t);
      out.usable[at + k] = edge >= 0.5 * filter.window() && std::isfinite(out.payload[at + k]);
    }
  }
}

}  // namespace

SketchRows sketch_rows(const Machine& machine, const std::vector<Log>& logs,
                       const std::vector<Log>& tests, const MachineFromLogOptions& options) {
  std::vector<const Log*> all;
  all.reserve(logs.size() + tests.size());
  for (const Log& log : logs) all.push_back(&log);
  for (const Log& log : tests) all.push_back(&log);
  Index total = 0;
  for (const Log* log : all) total += log->samples();
  const Index stride = std::max<Index>(1, total / std::max<Index>(1, options.rows));
  SketchRows out;
  Index rows = 0;
  for (const Log* log : all) rows += Picker{*log, stride, 0, 0}.count();
  const Index joints = machine.joint_count();
  out.time = VectorXd::Zero(rows);
  out.position = out.q = out.qd = out.qdd = out.qd_least =
      Eigen::MatrixXd::Constant(rows, joints, kNaN);
  out.position_noise = out.rate_noise = VectorXd::Zero(joints);
  out.payload = VectorXd::Zero(rows);
  out.block = out.log = Eigen::VectorXi::Zero(rows);
  out.held_out = out.usable = Mask::Constant(rows, false);
  out.cylinders.resize(machine.cylinders.size());
  Index at = 0;
  for (std::size_t l = 0; l < all.size(); ++l) {
    const Picker pick{*all[l], stride, at, rows};
    out.files.push_back(all[l]->file);
    out.log.segment(at, pick.count()).setConstant(static_cast<int>(l));
    put_log(machine, pick, options, out);
    put_blocks(pick, l >= logs.size(), tests.empty(), options, out);
    at += pick.count();
  }
  return out;
}

bool positions_from_strokes(const Machine& machine, int joint, SketchRows& rows) {
  const int cylinder = machine.cylinder_of_joint(joint);
  if (cylinder >= 0) {
    const CylinderRows& c = rows.cylinders[static_cast<std::size_t>(cylinder)];
    if (c.stroke_value.size() > 0) {
      const VectorXd q = joints_at_strokes(machine, cylinder, c.stroke_value);
      for (Index k = 0; k < rows.rows(); ++k) {
        if (std::isfinite(rows.q(k, joint)) || !std::isfinite(q[k])) continue;
        const Taylor3 x = linkage_rates(machine, cylinder, q[k]);
        rows.q(k, joint) = q[k];
        rows.qd(k, joint) = c.stroke_rate[k] / x.d1;
        rows.qd_least(k, joint) = c.stroke_rate_least[k] / x.d1;
        rows.qdd(k, joint) =
            (c.stroke_bend[k] - x.d2 * rows.qd(k, joint) * rows.qd(k, joint)) / x.d1;
      }
    }
  }
  return rows.q.col(joint).array().isFinite().any();
}

}  // namespace sparflow::from_log
