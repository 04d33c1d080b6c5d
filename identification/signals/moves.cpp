#include "identification/signals/moves.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sparflow {
namespace {

using Eigen::Index;

/// Whether a cylinder moves at each sample.
Mask any_moves(const MachineSignals& s) {
  Mask moves = Mask::Constant(s.samples(), false);
  for (const CylinderSignals& c : s.cylinders) moves = moves || c.moving;
  return moves;
}

/// Stretches of motion; rests shorter than `pause` do not end one.
std::vector<Segment> stretches(const MachineSignals& s, double pause) {
  const auto cylinders = static_cast<Index>(s.cylinders.size());
  Eigen::MatrixXd velocity(s.samples(), cylinders);
  for (Index i = 0; i < cylinders; ++i) {
    const CylinderSignals& c = s.cylinders[static_cast<std::size_t>(i)];
    velocity.col(i) = c.moving.select(c.speed.array(), 0.0);  // one definition of moving
  }
  SegmentOptions options;
  options.pause_s = pause;
  std::vector<Segment> out = find_segments(s.time, velocity, {}, s.runs, options);
  std::erase_if(out, [](const Segment& segment) { return !segment.moving; });
  return out;
}

/// Cuts a stretch that is too long at its longest rest, and its parts again.
void cut(const MachineSignals& s, const Mask& moves, const SampleRange& stretch, double longest,
         std::vector<SampleRange>& out) {
  SampleRange rest;
  double most = 0.0;
  if (s.time[stretch.end - 1] - s.time[stretch.begin] > longest) {
    Index begin = stretch.begin;
    for (Index k = stretch.begin; k < stretch.end; ++k) {
      if (!moves[k]) continue;
      const double pause = k > begin + 1 ? s.time[k] - s.time[begin] : 0.0;
      if (pause > most) {
        most = pause;
        rest = {begin + 1, k};
      }
      begin = k;
    }
  }
  if (rest.size() < 1) {
    out.push_back(stretch);
    return;
  }
  cut(s, moves, {stretch.begin, rest.begin}, longest, out);
  cut(s, moves, {rest.end, stretch.end}, longest, out);
}

double way_of(const MachineSignals& s, const SampleRange& range) {
  double way = 0.0;
  for (const CylinderSignals& c : s.cylinders) {
    for (Index k = range.begin; k + 1 < range.end; ++k) {
      if (c.moving[k] && std::isfinite(c.speed[k]))
        way += std::abs(c.speed[k]) * (s.time[k + 1] - s.time[k]);
    }
  }
  return way;
}

double gain_of(const MachineSignals& s, const SampleRange& range) {
  double gain = 0.0;
  for (const CylinderSignals& c : s.cylinders) {
    double x = 0.0;
    for (Index k = range.begin; k + 1 < range.end; ++k) {
      if (c.moving[k] && std::isfinite(c.speed[k])) x += c.speed[k] * (s.time[k + 1] - s.time[k]);
    }
    gain += std::abs(x);
  }
  return gain;
}

}  // namespace

std::vector<RecordedMove> recorded_moves(const MachineSignals& signals,
                                         const MoveOptions& options) {
  const Mask moves = any_moves(signals);
  std::vector<RecordedMove> out;
  for (const Segment& stretch : stretches(signals, options.pause_s)) {
    const SampleRange& run = signals.runs[static_cast<std::size_t>(stretch.run)];
    std::vector<SampleRange> parts;
    cut(signals, moves, stretch.samples, options.longest_s, parts);
    for (const SampleRange& part : parts) {
      RecordedMove move;
      move.from_rest = part.begin > run.begin;
      move.to_rest = part.end < run.end;
      move.samples = {part.begin - (move.from_rest ? 1 : 0), part.end + (move.to_rest ? 1 : 0)};
      move.way = way_of(signals, move.samples);
      move.gain = gain_of(signals, move.samples);
      if (move.way >= options.least_way) out.push_back(move);
    }
  }
  return out;
}

PumpTrace measured_pumps(const Machine& machine, const MachineSignals& signals,
                         const SampleRange& range) {
  const auto pumps = static_cast<Index>(machine.pumps.size());
  PumpTrace trace;
  trace.t = signals.time.segment(range.begin, range.size());
  trace.flow = Eigen::MatrixXd::Zero(range.size(), pumps);
  trace.pressure = Eigen::MatrixXd::Constant(range.size(), pumps, std::nan(""));
  for (Index p = 0; p < pumps; ++p) {
    const PumpSignals& pump = signals.pumps[static_cast<std::size_t>(p)];
    if (pump.pressure.size() > 0)
      trace.pressure.col(p) = pump.pressure.segment(range.begin, range.size());
  }
  for (std::size_t i = 0; i < signals.cylinders.size(); ++i) {
    const int p = machine.pump_of_cylinder(static_cast<int>(i));
    if (p >= 0) trace.flow.col(p) += signals.cylinders[i].flow.segment(range.begin, range.size());
  }
  return trace;
}

std::vector<double> measured_energy(const Machine& machine, const MachineSignals& signals,
                                    const SampleRange& range) {
  const PumpTrace trace = measured_pumps(machine, signals, range);
  std::vector<double> energy(machine.pumps.size(), 0.0);
  for (std::size_t p = 0; p < energy.size(); ++p) {
    const auto column = static_cast<Index>(p);
    if (signals.pumps[p].pressure.size() == 0) {
      energy[p] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    const auto power = [&](Index k) {
      const double flow = trace.flow(k, column);
      return flow == 0.0 ? 0.0 : trace.pressure(k, column) * flow;
    };
    double before = power(0);
    for (Index k = 1; k < trace.t.size(); ++k) {
      const double now = power(k);
      energy[p] += 0.5 * (before + now) * (trace.t[k] - trace.t[k - 1]);
      before = now;
    }
  }
  return energy;
}

double time_at_rest(const MachineSignals& signals) {
  const Mask moves = any_moves(signals);
  double time = 0.0;
  for (const SampleRange& run : signals.runs) {
    for (Index k = run.begin; k + 1 < run.end; ++k)
      if (!moves[k]) time += signals.time[k + 1] - signals.time[k];
  }
  return time;
}

}  // namespace sparflow
