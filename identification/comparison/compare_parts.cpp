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

/// Calls `visit` with the signals of a quantity, one at a time.
void each_signal(const Machine& machine, const MachineSignals& log, const ComparedSeries& series,
                 const std::function<void(RegimeSignal&&)>& visit) {
  for_each_regime_signal(machine, log, series, visit);
  if (series.stage == "force") {  // Coulomb friction depends on the direction only
    const VectorXd direction =
        series.regime.cast<double>().unaryExpr([](double r) { return r == 0.0 ? 1.0 : -1.0; });
    visit({"direction", "direction of motion", "", 1.0, direction});
  }
}

/// Which quantity a part is of.
struct PartKey {
  std::string stage, at, regime;
};

/// Calls `use` for the series of a quantity in each log. @param use (log, series)
template <class Use>
void each_series(const CompareResult& result, const PartKey& key, const Use& use) {
  for (std::size_t l = 0; l < result.logs.size(); ++l) {
    for (const ComparedSeries& s : result.logs[l].series) {
      if (s.stage == key.stage && s.at == key.at) use(l, s);
    }
  }
}

/// The signals at a part's samples. @param used [parts of logs] number of the part's samples in each log's series
std::vector<RegimeSignal> gathered_signals(const Machine& machine, const CompareResult& result,
                                           const PartKey& key,
                                           const std::vector<std::vector<int>>& rows) {
  Index count = 0;
  for (const std::vector<int>& r : rows) count += static_cast<Index>(r.size());
  std::vector<RegimeSignal> out;
  std::size_t series = 0;
  Index before = 0;
  each_series(result, key, [&](std::size_t l, const ComparedSeries& s) {
    const std::vector<int>& here = rows[series];
    const bool first = series++ == 0;
    each_signal(machine, result.logs[l].signals, s, [&](RegimeSignal&& g) {
      auto known = std::find_if(out.begin(), out.end(),
                                [&](const RegimeSignal& o) { return o.key == g.key; });
      if (known == out.end()) {
        if (!first) return;
        out.push_back({g.key, g.words, g.unit, g.scale, VectorXd::Constant(count, kNaN)});
        known = out.end() - 1;
      }
      for (std::size_t i = 0; i < here.size(); ++i)
        known->values[before + static_cast<Index>(i)] = g.values[here[i]];
    });
    before += static_cast<Index>(here.size());
  });
  return out;
}

ComparedPart gather(const CompareResult& result, const std::vector<Eigen::VectorXi>& blocks,
                    const ComparedSeries& like, const std::string& regime) {
  ComparedPart part;
  part.stage = like.stage;
  part.at = like.at;
  part.regime = regime;
  part.words = part_words(like, regime);
  part.unit = like.unit.name;
  part.scale = like.unit.si;
  const PartKey key{like.stage, like.at, regime};
  const auto each_row = [&](const auto& use) {
    each_series(result, key, [&](std::size_t l, const ComparedSeries& s) {
      for (Index k = 0; k < s.measured.size(); ++k) {
        if (!std::isfinite(s.measured[k]) || blocks[l][k] < 0) continue;
        if (!regime.empty() && s.regimes[static_cast<std::size_t>(s.regime[k])] != regime) continue;
        use(l, s, k);
      }
    });
  };
  Index count = 0;
  each_row([&](std::size_t, const ComparedSeries&, Index) { ++count; });
  part.error.resize(count);
  part.block.reserve(static_cast<std::size_t>(count));
  part.sample.reserve(static_cast<std::size_t>(count));
  Index row = 0;
  each_row([&](std::size_t l, const ComparedSeries& s, Index k) {
    part.error[row++] = s.predicted[k] - s.measured[k];
    part.block.push_back(blocks[l][k]);
    part.sample.push_back(static_cast<int>(k));
  });
  return part;
}

/// Rows of a part in each log's series, from the samples that it has in order of the logs.
std::vector<std::vector<int>> rows_by_series(const CompareResult& result, const PartKey& key,
                                             const ComparedPart& part,
                                             const std::vector<CompareBlock>& blocks) {
  std::vector<std::vector<int>> rows;
  std::size_t i = 0;
  each_series(result, key, [&](std::size_t l, const ComparedSeries&) {
    rows.emplace_back();
    if (result.logs.size() == 1) rows.back().reserve(part.sample.size());
    for (; i < part.block.size() && blocks[static_cast<std::size_t>(part.block[i])].log == l; ++i)
      rows.back().push_back(part.sample[i]);
  });
  return rows;
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
        ComparedPart part = gather(result, of_sample, s, regime);
        if (part.error.size() == 0) continue;
        out.push_back(std::move(part));
      }
    }
  }
  for (ComparedPart& made : out) {
    made.gather_signals = [&machine, &result, &blocks](const ComparedPart& part) {
      const PartKey key{part.stage, part.at, part.regime};
      return gathered_signals(machine, result, key, rows_by_series(result, key, part, blocks));
    };
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
