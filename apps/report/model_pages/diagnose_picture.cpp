// Data of the figures of a diagnosis: residuals with and without an effect, signals that may explain them.
#include <cmath>

#include "apps/report/model_pages/diagnose_charts.h"
#include "models/math/linear_algebra.h"
#include "models/math/nan.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// What an effect with its estimated parameters adds to the channel's rows. SI.
VectorXd contribution(const Evidence& evidence, const AppliedEffect& effect,
                      const EvidenceChannel& channel) {
  std::vector<double> linear, shape;
  const auto& parameters = effect.effect->info().parameters;
  for (std::size_t p = 0; p < effect.values.size(); ++p) {
    (parameters[p].linear ? linear : shape).push_back(effect.values[p]);
  }
  const Eigen::MatrixXd columns = evidence.columns({effect.effect, effect.at}, shape, channel);
  if (columns.cols() == 0) return VectorXd::Zero(channel.rows());
  return columns * Eigen::Map<const VectorXd>(linear.data(), columns.cols());
}

/// Residual of y after a least-squares fit of the channel's baseline.
VectorXd residual_of_baseline(const EvidenceChannel& channel, const VectorXd& y) {
  if (channel.baseline.cols() == 0) return y;
  return y - channel.baseline * least_squares(channel.baseline, y);
}

/// The measured quantity of a channel over one log.
const VectorXd& measured_of(const MachineSeries& log, const EvidenceChannel& channel) {
  const auto i = static_cast<std::size_t>(channel.index);
  switch (channel.kind) {
    case EvidenceKind::kForce:
      return log.cylinders[i].force;
    case EvidenceKind::kFlow:
      return log.cylinders[i].speed;
    case EvidenceKind::kReturnExtend:
    case EvidenceKind::kSupplyRetract:
      return log.cylinders[i].pressure_b;
    case EvidenceKind::kReturnRetract:
    case EvidenceKind::kSupplyExtend:
      return log.cylinders[i].pressure_a;
    case EvidenceKind::kReturnLine:
      return log.return_pressure;
    case EvidenceKind::kPump:
      break;
  }
  return log.pumps[i].pressure;
}

/// Values of the logs' samples at the channel's rows; NaN where a log does not have them.
/// @param get returns the samples of a MachineSeries, empty when they are not measured
template <class Get>
VectorXd at_rows(const Evidence& evidence, const EvidenceChannel& channel, const Get& get) {
  std::vector<VectorXd> by_log;
  for (const MachineSeries& log : evidence.series) by_log.push_back(get(log));
  VectorXd out = VectorXd::Constant(channel.rows(), kNaN);
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    const VectorXd& values = by_log[static_cast<std::size_t>(channel.log[b])];
    if (values.size() == 0) continue;
    for (Index r = channel.blocks[b].first; r < channel.blocks[b].last; ++r)
      out[r] = values[channel.sample[static_cast<std::size_t>(r)]];
  }
  return out;
}

VectorXd pump_flow(const MachineSeries& log, std::size_t pump, bool returning) {
  VectorXd sum = VectorXd::Zero(log.samples());
  for (const int i : log.machine->pumps[pump].feeds) {
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(i)];
    sum += returning ? c.return_flow : c.flow;
  }
  return sum;
}

VectorXd slope(const MachineSeries& log, const VectorXd& x) {
  if (x.size() < 3) return {};
  VectorXd d = VectorXd::Constant(x.size(), kNaN);
  for (Index k = 1; k + 1 < x.size(); ++k)
    d[k] = (x[k + 1] - x[k - 1]) / (log.time[k + 1] - log.time[k - 1]);
  return d;
}

}  // namespace

ChannelPicture channel_picture(const Diagnosis& d, int effect, std::size_t channel) {
  const Evidence& evidence = d.evidence;
  ChannelPicture out;
  out.channel = &evidence.channels[channel];
  const EvidenceChannel& c = *out.channel;
  out.measured =
      at_rows(evidence, c, [&](const MachineSeries& log) { return measured_of(log, c); });
  VectorXd rest = c.y, own = VectorXd::Zero(c.rows());
  for (std::size_t e = 0; e < d.effects.size(); ++e) {
    const VectorXd part = contribution(evidence, d.effects[e].applied, c);
    rest -= part;
    if (effect < 0 || static_cast<std::size_t>(effect) == e) own += part;
  }
  out.with = residual_of_baseline(c, rest);
  out.without = residual_of_baseline(c, rest + own);
  return out;
}

std::vector<ExplainingSignal> explaining_signals(const Evidence& evidence,
                                                 const EvidenceChannel& channel) {
  std::vector<ExplainingSignal> out;
  const Machine& machine = *evidence.series.front().machine;
  const auto add = [&](const char* id, const std::string& words, const std::string& unit,
                       double scale, const auto& get) {
    VectorXd values = at_rows(evidence, channel, get);
    if (!values.array().isFinite().any()) return;
    out.push_back({id, words, unit, values / scale});
  };
  const auto i = static_cast<std::size_t>(channel.index);
  const bool is_pump =
      channel.kind == EvidenceKind::kPump || channel.kind == EvidenceKind::kReturnLine;
  for (int j = 0; j < machine.joint_count(); ++j) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(j)];
    const bool turns = joint.type == JointType::kRevolute;
    add("angle", joint.name + (turns ? " angle" : " position"), turns ? "deg" : "m",
        turns ? units::kDegree : 1.0,
        [j](const MachineSeries& log) { return VectorXd(log.q.col(j)); });
  }
  if (!is_pump) {
    const std::string name = channel.at + " ";
    add("speed", name + "rod speed", "mm/s", 1e-3,
        [i](const MachineSeries& log) { return log.cylinders[i].speed; });
    add("acceleration", name + "rod acceleration", "m/s\u00B2", 1.0,
        [i](const MachineSeries& log) { return log.cylinders[i].acceleration; });
    add("length", name + "length", "m", 1.0,
        [i](const MachineSeries& log) { return log.cylinders[i].length; });
    add("load", name + "load", "kN", 1e3,
        [i](const MachineSeries& log) { return log.cylinders[i].static_force; });
    add("command", name + "command", "", 1.0,
        [i](const MachineSeries& log) { return log.cylinders[i].command; });
    add("command_slope", name + "command's rate", "1/s", 1.0,
        [i](const MachineSeries& log) { return slope(log, log.cylinders[i].command); });
    add("flow", name + "flow", "l/min", units::kLitrePerMinute,
        [i](const MachineSeries& log) { return log.cylinders[i].flow; });
  }
  const int pump = is_pump ? channel.index : machine.pump_of_cylinder(channel.index);
  if (pump >= 0) {
    const auto p = static_cast<std::size_t>(pump);
    add("pump_flow", "total flow", "l/min", units::kLitrePerMinute,
        [p](const MachineSeries& log) { return pump_flow(log, p, false); });
    add("all_return_flow", "total return flow", "l/min", units::kLitrePerMinute,
        [p](const MachineSeries& log) { return pump_flow(log, p, true); });
    if (is_pump) {
      add("demand", "pressure demand", "bar", units::kBar,
          [p](const MachineSeries& log) { return log.pumps[p].demand; });
      add("pressure_slope", "rate of the pump's pressure", "bar/s", units::kBar,
          [p](const MachineSeries& log) { return slope(log, log.pumps[p].pressure); });
    }
  }
  add("payload", "payload", "kg", 1.0, [](const MachineSeries& log) { return log.payload; });
  add("oil", "oil temperature", "\u00B0C", 1.0, [](const MachineSeries& log) { return log.oil; });
  return out;
}

}  // namespace sparflow
