#include "identification/comparison/compare_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "identification/comparison/compare.h"
#include "models/math/nan.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

std::string part_words(const ComparedSeries& s, const std::string& regime) {
  const std::string side = regime.empty() ? "" : regime == "extend" ? " extending" : " retracting";
  if (s.stage == "pump") return "pressure of pump " + s.at;
  if (s.stage == "pressure") return "working pressure of " + s.at + side;
  if (s.stage == "flow") return "flow of " + s.at + side + " from its command";
  if (s.stage == "flow_sensor") return "flow of " + s.at + side + " at its sensor";
  return s.stage + " of " + s.at + side;
}

/// @return [samples] block of every sample of a log, -1 = none
Eigen::VectorXi block_of_sample(const std::vector<CompareBlock>& blocks, std::size_t log,
                                Index samples) {
  Eigen::VectorXi out = Eigen::VectorXi::Constant(samples, -1);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (blocks[b].log != log) continue;
    out.segment(blocks[b].samples.begin, blocks[b].samples.size()).setConstant(static_cast<int>(b));
  }
  return out;
}

std::vector<RegimeSignal> signals_of(const Machine& machine, const MachineSignals& log,
                                     const ComparedSeries& series) {
  std::vector<RegimeSignal> out = regime_signals(machine, log, series);
  if (series.stage == "force") {  // Coulomb friction depends on the direction only
    const VectorXd direction =
        series.regime.cast<double>().unaryExpr([](double r) { return r == 0.0 ? 1.0 : -1.0; });
    out.push_back({"direction", "direction of motion", "", 1.0, direction});
  }
  return out;
}

ComparedPart gather(const Machine& machine, const CompareResult& result,
                    const std::vector<Eigen::VectorXi>& blocks, const ComparedSeries& like,
                    const std::string& regime) {
  ComparedPart part;
  part.stage = like.stage;
  part.at = like.at;
  part.regime = regime;
  part.words = part_words(like, regime);
  part.unit = like.unit.name;
  part.scale = like.unit.si;
  std::vector<double> error, measured;
  std::vector<std::vector<double>> columns;
  bool first = true;
  for (std::size_t l = 0; l < result.logs.size(); ++l) {
    for (const ComparedSeries& s : result.logs[l].series) {
      if (s.stage != like.stage || s.at != like.at) continue;
      const std::vector<RegimeSignal> signals = signals_of(machine, result.logs[l].signals, s);
      if (first) {
        for (const RegimeSignal& g : signals)
          part.signals.push_back({g.key, g.words, g.unit, g.scale, {}});
        columns.resize(part.signals.size());
        first = false;
      }
      std::vector<const RegimeSignal*> source(columns.size(), nullptr);
      for (std::size_t c = 0; c < columns.size(); ++c) {
        for (const RegimeSignal& g : signals) {
          if (g.key == part.signals[c].key) source[c] = &g;
        }
      }
      for (Index k = 0; k < s.measured.size(); ++k) {
        if (!std::isfinite(s.measured[k]) || blocks[l][k] < 0) continue;
        if (!regime.empty() && s.regimes[static_cast<std::size_t>(s.regime[k])] != regime) continue;
        error.push_back(s.predicted[k] - s.measured[k]);
        measured.push_back(s.measured[k]);
        part.block.push_back(blocks[l][k]);
        part.sample.push_back(k);
        for (std::size_t c = 0; c < columns.size(); ++c)
          columns[c].push_back(source[c] == nullptr ? kNaN : source[c]->values[k]);
      }
    }
  }
  part.error = Eigen::Map<VectorXd>(error.data(), static_cast<Index>(error.size()));
  part.measured = Eigen::Map<VectorXd>(measured.data(), static_cast<Index>(measured.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    part.signals[c].values =
        Eigen::Map<VectorXd>(columns[c].data(), static_cast<Index>(columns[c].size()));
  }
  return part;
}

}  // namespace

std::vector<CompareBlock> compare_blocks(const CompareResult& result, double longest_s) {
  std::vector<CompareBlock> out;
  for (std::size_t l = 0; l < result.logs.size(); ++l) {
    const MachineSignals& s = result.logs[l].signals;
    for (const Segment& segment : s.segments) {
      if (!segment.moving) continue;
      const double seconds = s.time[segment.samples.end - 1] - s.time[segment.samples.begin];
      const auto parts = static_cast<Index>(std::max(1.0, std::ceil(seconds / longest_s - 1e-9)));
      for (Index p = 0; p < parts; ++p) {
        const SampleRange range = {
            segment.samples.begin + segment.samples.size() * p / parts,
            segment.samples.begin + segment.samples.size() * (p + 1) / parts};
        if (range.size() > 0) out.push_back({l, range});
      }
    }
  }
  return out;
}

std::vector<ComparedPart> compare_parts(const Machine& machine, const CompareResult& result,
                                        const std::vector<CompareBlock>& blocks) {
  std::vector<Eigen::VectorXi> of_sample;
  for (std::size_t l = 0; l < result.logs.size(); ++l)
    of_sample.push_back(block_of_sample(blocks, l, result.logs[l].signals.samples()));
  std::vector<ComparedPart> out;
  std::set<std::pair<std::string, std::string>> seen;
  for (const LogComparison& log : result.logs) {
    for (const ComparedSeries& s : log.series) {
      if (!seen.insert({s.stage, s.at}).second) continue;
      const bool whole = s.stage == "force" || s.stage == "pump";
      const std::vector<std::string> regimes = whole ? std::vector<std::string>{""} : s.regimes;
      for (const std::string& regime : regimes) {
        ComparedPart part = gather(machine, result, of_sample, s, regime);
        if (part.error.size() > 0) out.push_back(std::move(part));
      }
    }
  }
  return out;
}

Range block_interval(const VectorXd& numerator, const VectorXd& denominator, bool root,
                     const BlockOptions& options) {
  std::vector<Index> used;
  for (Index b = 0; b < denominator.size(); ++b) {
    if (denominator[b] > 0.0) used.push_back(b);
  }
  if (static_cast<int>(used.size()) < options.fewest) return {kNaN, kNaN};
  std::mt19937 random(12345);
  VectorXd ratio(options.resamples);
  for (double& r : ratio) {
    double top = 0.0, bottom = 0.0;
    for (std::size_t i = 0; i < used.size(); ++i) {
      const Index b = used[random() % used.size()];
      top += numerator[b];
      bottom += denominator[b];
    }
    r = root ? std::sqrt(top / bottom) : top / bottom;
  }
  return {quantile(ratio, 0.025), quantile(ratio, 0.975)};
}

}  // namespace sparflow
