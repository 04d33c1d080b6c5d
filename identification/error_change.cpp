#include "identification/error_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "identification/compare_parts.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Refitting around something else moves centres and length-scales, and with them errors near the sensor's noise by
/// some percent. A tenth more is a loss that anybody would see.
constexpr double kLargeChange = 1.1;
/// With fewer blocks of motion no noise can be told: only a change so large counts.
constexpr int kFewestBlocks = 4;
constexpr double kStandardErrors = 2.0;
/// Everything together, noise included, may move by this much when it is learned again.
constexpr double kRefitMoves = 1.02;
/// Of what a change takes away where it acts, the share it may bring in at another place where it acts.
constexpr double kLargestLoss = 0.25;
/// A change acts on a quantity when it moves its prediction by this share of the error.
constexpr double kActs = 0.02;
/// A relative error of energy that moves by less does not matter to anybody: flows are measured to some percent.
constexpr double kEnergyMoves = 2e-3;

/// Sums of one value a block of motion, before and after.
struct BlockSums {
  VectorXd before, after, weight;
  explicit BlockSums(std::size_t blocks)
      : before(VectorXd::Zero(static_cast<Index>(blocks))), after(before), weight(before) {}

  /// Whether sum(after) / sum(weight) - sum(before) / sum(weight) is more than chance between blocks.
  bool grew() const {
    const double all = weight.sum();
    if (!(all > 0.0)) return false;
    const VectorXd more = after - before;
    const double mean = more.sum() / all;
    if (mean <= 0.0) return false;
    const auto used = static_cast<double>((weight.array() > 0.0).count());
    if (used < kFewestBlocks) return after.sum() > kLargeChange * kLargeChange * before.sum();
    const double error =
        std::sqrt((more - mean * weight).squaredNorm() * used / (used - 1.0)) / all;
    return mean > kStandardErrors * error;
  }
};

/// Block of motion of every sample of a log, -1 = rest.
Eigen::VectorXi blocks_of(const std::vector<CompareBlock>& blocks, std::size_t log, Index samples) {
  Eigen::VectorXi out = Eigen::VectorXi::Constant(samples, -1);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (blocks[b].log != log) continue;
    out.segment(blocks[b].samples.begin, blocks[b].samples.size()).setConstant(static_cast<int>(b));
  }
  return out;
}

/// Calls visit(before, after, log, block numbers) for each quantity of both.
template <class F>
void for_each_pair(const CompareResult& before, const CompareResult& after,
                   const std::vector<CompareBlock>& blocks, const F& visit) {
  for (std::size_t l = 0; l < std::min(before.logs.size(), after.logs.size()); ++l) {
    const Eigen::VectorXi block = blocks_of(blocks, l, before.logs[l].signals.samples());
    for (const ComparedSeries& b : before.logs[l].series) {
      for (const ComparedSeries& a : after.logs[l].series) {
        if (a.stage == b.stage && a.at == b.at && a.measured.size() == b.measured.size())
          visit(b, a, l, block);
      }
    }
  }
}

bool counts(const ComparedSeries& s, const std::string& regime, Index k) {
  if (!std::isfinite(s.measured[k]) || !std::isfinite(s.predicted[k])) return false;
  if (!regime.empty() && s.regimes[static_cast<std::size_t>(s.regime[k])] != regime) return false;
  return s.extrapolated.size() == 0 || !s.extrapolated[k];
}

BlockSums squared_errors(const CompareResult& before, const CompareResult& after,
                         const std::vector<CompareBlock>& blocks, const StageScore& of) {
  BlockSums sums(blocks.size());
  for_each_pair(before, after, blocks,
                [&](const ComparedSeries& b, const ComparedSeries& a, std::size_t,
                    const Eigen::VectorXi& block) {
                  if (b.stage != of.stage || b.at != of.at) return;
                  for (Index k = 0; k < b.measured.size(); ++k) {
                    if (block[k] < 0 || !counts(b, of.regime, k) || !counts(a, of.regime, k))
                      continue;
                    sums.before[block[k]] += std::pow(b.predicted[k] - b.measured[k], 2);
                    sums.after[block[k]] += std::pow(a.predicted[k] - a.measured[k], 2);
                    sums.weight[block[k]] += 1.0;
                  }
                });
  return sums;
}

/// Energy error of each block, with the sign that makes the whole's error positive; weight: measured energy. Errors of
/// motions that cancel each other are no accuracy, but they are what the whole is made of.
BlockSums energy_errors(const CompareResult& before, const CompareResult& after,
                        const std::vector<CompareBlock>& blocks, const Pump& pump) {
  BlockSums sums(blocks.size());
  for_each_pair(before, after, blocks,
                [&](const ComparedSeries& b, const ComparedSeries& a, std::size_t l,
                    const Eigen::VectorXi& block) {
                  if (b.stage != "pump" || b.at != pump.name) return;
                  const MachineSignals& s = after.logs[l].signals;
                  const VectorXd duration = sample_durations(s.time, s.runs);
                  for (Index k = 0; k < b.measured.size(); ++k) {
                    if (block[k] < 0 || !counts(b, "", k) || !counts(a, "", k)) continue;
                    double flow = 0.0;
                    for (const int i : pump.feeds) {
                      const VectorXd& q = s.cylinders[static_cast<std::size_t>(i)].flow;
                      if (q.size() > 0 && std::isfinite(q[k])) flow += q[k];
                    }
                    const double volume = flow * duration[k];
                    sums.before[block[k]] += (b.predicted[k] - b.measured[k]) * volume;
                    sums.after[block[k]] += (a.predicted[k] - a.measured[k]) * volume;
                    sums.weight[block[k]] += b.measured[k] * volume;
                  }
                });
  if (sums.before.sum() < 0.0) sums.before = -sums.before;
  if (sums.after.sum() < 0.0) sums.after = -sums.after;
  return sums;
}

/// Whether the change moved this quantity's prediction by a share of its error that matters.
bool acts_on(const CompareResult& before, const CompareResult& after,
             const std::vector<CompareBlock>& blocks, const StageScore& of) {
  double moved = 0.0, error = 0.0;
  for_each_pair(
      before, after, blocks,
      [&](const ComparedSeries& b, const ComparedSeries& a, std::size_t, const Eigen::VectorXi&) {
        if (b.stage != of.stage || b.at != of.at) return;
        for (Index k = 0; k < b.measured.size(); ++k) {
          if (!counts(b, of.regime, k) || !counts(a, of.regime, k)) continue;
          moved += std::pow(a.predicted[k] - b.predicted[k], 2);
          error += std::pow(b.predicted[k] - b.measured[k], 2);
        }
      });
  return moved > kActs * kActs * error && moved > 0.0;
}

/// @param before, after RMS errors over the samples that count, SI
HarmedError harm(const StageScore& b, double before, double after) {
  const bool kilo = b.unit.name == "N" && after >= 1e4;
  const double si = kilo ? 1e3 : b.unit.si;
  return {b.stage,
          b.at,
          b.regime,
          before,
          after,
          fmt::format("the error of {} {}{} grew from {:.3g} to {:.3g} {}", b.stage, b.at,
                      b.regime.empty() ? "" : " " + b.regime, before / si, after / si,
                      kilo ? "kN" : b.unit.name)};
}

void add_harmed_energy(const Machine& machine, const CompareResult& before,
                       const CompareResult& after, const std::vector<CompareBlock>& blocks,
                       std::vector<HarmedError>& harmed) {
  for (const Pump& pump : machine.pumps) {
    const BlockSums sums = energy_errors(before, after, blocks, pump);
    const double all = sums.weight.sum();
    if (!(all > 0.0) || !sums.grew()) continue;
    const double b = sums.before.sum() / all, a = sums.after.sum() / all;
    if (a - b < kEnergyMoves) continue;
    harmed.push_back({"energy", pump.name, "", b, a,
                      fmt::format("the error of the energy of pump {} grew from {:.2f} to {:.2f} %",
                                  pump.name, 100.0 * b, 100.0 * a)});
  }
}

}  // namespace

bool ErrorChange::worse() const { return own > 1.0 || overall > kRefitMoves || !harmed.empty(); }

ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const std::string& stage,
                         const std::string& at) {
  const std::vector<CompareBlock> blocks = compare_blocks(before);
  const bool one_stage =
      stage == "force" || stage == "flow" || stage == "pressure" || stage == "pump";
  const bool one_place =
      one_stage && std::any_of(before.scores.begin(), before.scores.end(),
                               [&](const StageScore& s) { return s.stage == stage && s.at == at; });
  ErrorChange out;
  double all = 0.0, all_n = 0.0;
  struct Pool {
    double before = 0.0, after = 0.0, n = 0.0;
    double won = 0.0, lost = 0.0;  // squared error taken away and brought in, by quantity
    std::vector<HarmedError> harmed;
  };
  std::map<std::string, Pool> own;  // by stage, whose quantities have one unit
  for (const StageScore& b : before.scores) {
    const StageScore* a = after.find(b.stage, b.at, b.regime);
    if (a == nullptr || a->n == 0 || b.n == 0 || !(b.rmse > 0.0) || !(a->rmse > 0.0)) continue;
    const double n = 0.5 * static_cast<double>(a->n + b.n);
    const double change = std::log(a->rmse / b.rmse);
    all += n * change;
    all_n += n;
    const bool is_own = (!one_stage || b.stage == stage) &&
                        (one_place ? b.at == at : acts_on(before, after, blocks, b));
    if (is_own) {
      Pool& pool = own[b.stage];
      const double was = n * b.rmse * b.rmse, is = n * a->rmse * a->rmse;
      pool.before += was;
      pool.after += is;
      pool.n += n;
      (is < was ? pool.won : pool.lost) += std::abs(is - was);
    }
    const BlockSums sums = squared_errors(before, after, blocks, b);
    const double counted = std::max(1.0, sums.weight.sum());
    const double was = std::sqrt(sums.before.sum() / counted);
    const double is = std::sqrt(sums.after.sum() / counted);
    if (is > kLargeChange * was && sums.grew())
      (is_own ? own[b.stage].harmed : out.harmed).push_back(harm(b, was, is));
  }
  // where it acts on several quantities, one may give a little for what the others win
  for (auto& [name, pool] : own) {
    if (pool.lost <= kLargestLoss * pool.won) continue;
    out.harmed.insert(out.harmed.end(), pool.harmed.begin(), pool.harmed.end());
  }
  add_harmed_energy(machine, before, after, blocks, out.harmed);
  if (all_n > 0.0) out.overall = std::exp(all / all_n);
  double log_own = 0.0, own_n = 0.0;
  for (const auto& [name, pool] : own) {
    log_own += pool.n * 0.5 * std::log(pool.after / pool.before);
    own_n += pool.n;
  }
  out.own = own_n > 0.0 ? std::exp(log_own / own_n) : out.overall;
  return out;
}

}  // namespace sparflow
