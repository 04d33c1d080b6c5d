#include "identification/comparison/worst_segments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "identification/comparison/compare.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// @return e.g. "boom extending, jib retracting", for motions in at least `share` of the block's samples
std::string motions(const Machine& machine, const MachineSignals& signals, SampleRange range,
                    double share) {
  std::string out;
  for (std::size_t i = 0; i < signals.cylinders.size(); ++i) {
    const CylinderSignals& c = signals.cylinders[i];
    double up = 0.0, down = 0.0;
    for (Index k = range.begin; k < range.end; ++k) {
      if (!c.moving[k]) continue;
      (c.speed[k] > 0.0 ? up : down) += 1.0;
    }
    const double least = share * static_cast<double>(range.size());
    const std::string way = up > least && down > least ? " both ways"
                            : up > least               ? " extending"
                            : down > least             ? " retracting"
                                                       : "";
    if (way.empty()) continue;
    out += (out.empty() ? "" : ", ") + machine.cylinders[i].name + way;
  }
  return out.empty() ? "hardly any motion" : out;
}

std::string size_text(double value, const std::string& unit) {
  return value >= 1000.0 ? fmt::format("{:.0f} {}", value, unit)
                         : fmt::format("{:.3g} {}", value, unit);
}

/// The level of a factor at every sample.
struct Factor {
  std::string name;
  std::vector<int> level;  ///< index into `order`; -1 = unknown
  std::vector<std::string> order;

  static std::vector<int> unknown(Index samples) {
    return std::vector<int>(static_cast<std::size_t>(samples), -1);
  }
};

Factor terciles(const std::string& name, const VectorXd& values,
                const std::vector<std::string>& words) {
  Factor f{name, Factor::unknown(values.size()), words};
  VectorXd known(values.size());
  Index n = 0;
  for (const double v : values) {
    if (std::isfinite(v)) known[n++] = v;
  }
  known.conservativeResize(n);
  if (n == 0) return f;
  const double lo = quantile(known, 1.0 / 3.0), hi = quantile(known, 2.0 / 3.0);
  const double span = known.maxCoeff() - known.minCoeff();
  constexpr double kConstant = 1e-6;  // of the size; a signal that varies by rounding has no levels
  if (!(span > kConstant * known.cwiseAbs().maxCoeff()) || !(hi > lo)) return f;
  for (Index k = 0; k < values.size(); ++k) {
    if (!std::isfinite(values[k])) continue;
    f.level[static_cast<std::size_t>(k)] = values[k] <= lo ? 0 : values[k] <= hi ? 1 : 2;
  }
  return f;
}

/// @return a factor with a level for each value where there are few values, else for each tercile
Factor values_or_terciles(const std::string& name, const VectorXd& values,
                          std::size_t most_values) {
  std::set<double> seen;
  for (const double v : values) {
    if (std::isfinite(v)) seen.insert(v);
    if (seen.size() > most_values) return terciles(name, values, {"low", "medium", "high"});
  }
  Factor f{name, Factor::unknown(values.size()), {}};
  if (seen.size() < 2) return f;
  for (const double v : seen) f.order.push_back(fmt::format("{:g}", v));
  for (Index k = 0; k < values.size(); ++k) {
    if (!std::isfinite(values[k])) continue;
    // of values with the same six digits the first
    const auto at = std::find(f.order.begin(), f.order.end(), fmt::format("{:g}", values[k]));
    f.level[static_cast<std::size_t>(k)] = static_cast<int>(at - f.order.begin());
  }
  return f;
}

const RegimeSignal* signal_of(const std::vector<RegimeSignal>& signals, const std::string& prefix) {
  for (const RegimeSignal& s : signals) {
    if (s.key.starts_with(prefix)) return &s;
  }
  return nullptr;
}

/// @return the factor "one or several cylinders active at a time"
Factor functions_moving(const CompareResult& result, const ComparedPart& part,
                        const std::vector<CompareBlock>& blocks) {
  Factor f{"functions", {}, {"one", "several"}};
  for (std::size_t i = 0; i < part.block.size(); ++i) {
    const MachineSignals& s =
        result.logs[blocks[static_cast<std::size_t>(part.block[i])].log].signals;
    int moving = 0;
    for (const CylinderSignals& c : s.cylinders) moving += c.direction[part.sample[i]] != 0 ? 1 : 0;
    f.level.push_back(moving > 1 ? 1 : 0);
  }
  return f;
}

/// @return the factor of the regime: the load-sensing leader of a pump, the direction of other quantities
Factor regime_factor(const CompareResult& result, const ComparedPart& part,
                     const std::vector<CompareBlock>& blocks) {
  Factor f{part.stage == "pump" ? "leader" : "direction", {}, {}};
  for (std::size_t i = 0; i < part.block.size(); ++i) {
    const LogComparison& log = result.logs[blocks[static_cast<std::size_t>(part.block[i])].log];
    for (const ComparedSeries& s : log.series) {
      if (s.stage != part.stage || s.at != part.at) continue;
      if (f.order.empty()) f.order = s.regimes;
      f.level.push_back(s.regime[part.sample[i]]);
    }
  }
  return f;
}

std::vector<Factor> factors_of(const CompareResult& result, const ComparedPart& part,
                               const std::vector<CompareBlock>& blocks,
                               const WorstSegmentOptions& options) {
  std::vector<Factor> out;
  out.push_back(regime_factor(result, part, blocks));
  const std::vector<RegimeSignal> signals = part.all_signals();
  const RegimeSignal* speed = signal_of(signals, part.stage == "pump" ? "flow_lpm" : "speed_");
  if (speed != nullptr) out.push_back(terciles("speed", speed->values, {"slow", "medium", "fast"}));
  if (const RegimeSignal* load = signal_of(signals, "load_"))
    out.push_back(terciles("load", load->values, {"low", "medium", "high"}));
  for (const char* key : {"payload_kg", "oil_C"}) {
    if (const RegimeSignal* s = signal_of(signals, key))
      out.push_back(values_or_terciles(key, s->values, options.most_values));
  }
  out.push_back(functions_moving(result, part, blocks));
  return out;
}

RegimeError error_at(const ComparedPart& part, const Factor& factor, int level, Index blocks,
                     const BlockOptions& options) {
  RegimeError out;
  out.stage = part.stage;
  out.at = part.at;
  out.regime = part.regime;
  out.factor = factor.name;
  out.level = factor.order[static_cast<std::size_t>(level)];
  out.unit = part.unit;
  VectorXd count = VectorXd::Zero(blocks), sum = count, squares = count;
  for (std::size_t i = 0; i < part.block.size(); ++i) {
    if (factor.level[i] != level) continue;
    const double e = part.error[static_cast<Index>(i)] / part.scale;
    count[part.block[i]] += 1.0;
    sum[part.block[i]] += e;
    squares[part.block[i]] += e * e;
  }
  out.samples = std::lround(count.sum());
  if (out.samples == 0) return out;
  out.blocks = static_cast<int>((count.array() > 0.0).count());
  out.rmse = std::sqrt(squares.sum() / count.sum());
  out.bias = sum.sum() / count.sum();
  out.rmse_ci95 = block_interval(squares, count, true, options);
  out.bias_ci95 = block_interval(sum, count, false, options);
  return out;
}

}  // namespace

std::vector<WorstSegment> worst_segments(const Machine& machine, const CompareResult& result,
                                         const std::vector<ComparedPart>& parts,
                                         const std::vector<CompareBlock>& blocks,
                                         const WorstSegmentOptions& options) {
  std::vector<WorstSegment> out;
  for (const ComparedPart& part : parts) {
    VectorXd count = VectorXd::Zero(static_cast<Index>(blocks.size())), sum = count,
             squares = count;
    for (std::size_t i = 0; i < part.block.size(); ++i) {
      const double e = part.error[static_cast<Index>(i)] / part.scale;
      count[part.block[i]] += 1.0;
      sum[part.block[i]] += e;
      squares[part.block[i]] += e * e;
    }
    const double total = squares.sum(), samples = count.sum();
    if (!(total > 0.0)) continue;
    Index worst = -1;
    double most_excess = 0.0;
    for (Index b = 0; b < squares.size(); ++b) {
      const double error = squares[b] / total, share = count[b] / samples;
      if (error < options.contrast * share || error - share <= most_excess) continue;
      most_excess = error - share;
      worst = b;
    }
    if (worst < 0) continue;
    const CompareBlock& block = blocks[static_cast<std::size_t>(worst)];
    const MachineSignals& s = result.logs[block.log].signals;
    WorstSegment w;
    w.stage = part.stage;
    w.at = part.at;
    w.regime = part.regime;
    w.file = s.file;
    w.from_s = s.time[block.samples.begin];
    w.to_s = s.time[block.samples.end - 1];
    w.moved = motions(machine, s, block.samples, options.moved_share);
    w.rmse = std::sqrt(squares[worst] / count[worst]);
    w.bias = sum[worst] / count[worst];
    w.unit = part.unit;
    w.share_of_error = squares[worst] / total;
    w.share_of_samples = count[worst] / samples;
    w.sentence = fmt::format(
        "{:.1f} to {:.1f} s of {} ({}): {:.0f} % of the error of the {} in {} of its samples "
        "(RMSE {})",
        w.from_s, w.to_s, w.file, w.moved, 100.0 * w.share_of_error, part.words,
        w.share_of_samples < 0.005 ? std::string("less than 1 %")
                                   : fmt::format("{:.0f} %", 100.0 * w.share_of_samples),
        size_text(w.rmse, w.unit));
    out.push_back(std::move(w));
  }
  std::stable_sort(out.begin(), out.end(), [](const WorstSegment& a, const WorstSegment& b) {
    return a.share_of_error - a.share_of_samples > b.share_of_error - b.share_of_samples;
  });
  if (static_cast<int>(out.size()) > options.most)
    out.resize(static_cast<std::size_t>(options.most));
  return out;
}

std::vector<RegimeError> errors_by_regime(const CompareResult& result,
                                          const std::vector<ComparedPart>& parts,
                                          const std::vector<CompareBlock>& blocks,
                                          const WorstSegmentOptions& options) {
  std::vector<RegimeError> out;
  for (const ComparedPart& part : parts) {
    for (const Factor& factor : factors_of(result, part, blocks, options)) {
      for (int level = 0; level < static_cast<int>(factor.order.size()); ++level) {
        RegimeError e =
            error_at(part, factor, level, static_cast<Index>(blocks.size()), options.blocks);
        if (e.samples > 0) out.push_back(std::move(e));
      }
    }
  }
  return out;
}

}  // namespace sparflow
