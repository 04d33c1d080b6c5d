#include "identification/comparison/error_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "identification/comparison/compare_parts.h"
#include "identification/comparison/report_numbers.h"
#include "identification/signals/steady.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// [blocks] sums of a value before and after the change.
struct BlockSums {
  VectorXd before, after, weight;
  explicit BlockSums(std::size_t blocks)
      : before(VectorXd::Zero(static_cast<Index>(blocks))), after(before), weight(before) {}

  double used() const { return static_cast<double>((weight.array() > 0.0).count()); }

  /// @return whether sum(after) / sum(weight) exceeds sum(before) / sum(weight) significantly, by the variation between
  ///   blocks
  bool grew(const ErrorChangeOptions& options) const {
    const double all = weight.sum();
    if (!(all > 0.0)) return false;
    const VectorXd more = after - before;
    const double mean = more.sum() / all;
    if (mean <= 0.0) return false;
    const double n = used();
    if (n < options.fewest_blocks) return false;
    const double error = std::sqrt((more - mean * weight).squaredNorm() * n / (n - 1.0)) / all;
    return mean > options.standard_errors * error;
  }
};

/// Motions, and the pieces that replace them where too few motions show a quantity.
struct Blocks {
  std::vector<CompareBlock> motions, pieces;
  int fewest;
  Blocks(const CompareResult& result, const ErrorChangeOptions& options)
      : motions(compare_blocks(result, options.blocks.longest_s)),
        pieces(compare_blocks(result, options.piece_s)),
        fewest(options.fewest_blocks) {}

  /// @param sums_over callable that returns the BlockSums of a list of blocks
  template <class F>
  BlockSums enough(const F& sums_over) const {
    BlockSums sums = sums_over(motions);
    return sums.used() < fewest ? sums_over(pieces) : sums;
  }
};

/// @return [samples] block of motion of every sample of a log, -1 = rest
Eigen::VectorXi blocks_of(const std::vector<CompareBlock>& blocks, std::size_t log, Index samples) {
  Eigen::VectorXi out = Eigen::VectorXi::Constant(samples, -1);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (blocks[b].log != log) continue;
    out.segment(blocks[b].samples.begin, blocks[b].samples.size()).setConstant(static_cast<int>(b));
  }
  return out;
}

/// Calls visit(before, after, log, block numbers) for each quantity that both results have.
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

bool counts(const ComparedSeries& s, const std::string& regime, Index k, bool everywhere = false) {
  if (!std::isfinite(s.measured[k]) || !std::isfinite(s.predicted[k])) return false;
  if (!regime.empty() && s.regimes[static_cast<std::size_t>(s.regime[k])] != regime) return false;
  return everywhere || s.extrapolated.size() == 0 || !s.extrapolated[k];
}

/// @param everywhere also outside the training range of a pressure model
BlockSums squared_errors(const CompareResult& before, const CompareResult& after,
                         const std::vector<CompareBlock>& blocks, const StageScore& of,
                         bool everywhere = false) {
  BlockSums sums(blocks.size());
  for_each_pair(before, after, blocks,
                [&](const ComparedSeries& b, const ComparedSeries& a, std::size_t,
                    const Eigen::VectorXi& block) {
                  if (b.stage != of.stage || b.at != of.at) return;
                  for (Index k = 0; k < b.measured.size(); ++k) {
                    if (block[k] < 0 || !counts(b, of.regime, k, everywhere) ||
                        !counts(a, of.regime, k, everywhere))
                      continue;
                    sums.before[block[k]] += std::pow(b.predicted[k] - b.measured[k], 2);
                    sums.after[block[k]] += std::pow(a.predicted[k] - a.measured[k], 2);
                    sums.weight[block[k]] += 1.0;
                  }
                });
  return sums;
}

/// Squared errors of a force in steady motion, and their number.
struct SteadySquares {
  double before = 0.0, after = 0.0, n = 0.0;
};

SteadySquares steady_errors(const Machine& machine, const CompareResult& before,
                            const CompareResult& after, const StageScore& of,
                            const ErrorChangeOptions& options) {
  SteadySquares sums;
  const int cylinder = machine.cylinder_index(of.at);
  if (of.stage != "force" || cylinder < 0) return sums;
  for_each_pair(
      before, after, {},
      [&](const ComparedSeries& b, const ComparedSeries& a, std::size_t l, const Eigen::VectorXi&) {
        if (b.stage != of.stage || b.at != of.at) return;
        const MachineSignals& s = after.logs[l].signals;
        const VectorXd since = since_unsteady(s, s.cylinders[static_cast<std::size_t>(cylinder)],
                                              options.unsteady_span);
        for (Index k = 0; k < b.measured.size(); ++k) {
          if (since[k] < options.settled_s || !counts(b, of.regime, k) || !counts(a, of.regime, k))
            continue;
          sums.before += std::pow(b.predicted[k] - b.measured[k], 2);
          sums.after += std::pow(a.predicted[k] - a.measured[k], 2);
          sums.n += 1.0;
        }
      });
  return sums;
}

/// Energy error of each block, with the sign that makes the total error positive; weight: measured energy. The total is
/// tested, in which errors of single motions may cancel.
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

/// @return whether the change moved this quantity's prediction by at least `share` of its error
bool acts_on(const CompareResult& before, const CompareResult& after,
             const std::vector<CompareBlock>& blocks, const StageScore& of, double share) {
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
  return moved > share * share * error && moved > 0.0;
}

/// @param before, after RMS errors over the samples that count, SI
HarmedError harm(const StageScore& b, double before, double after) {
  const bool kilo = b.unit.name == "N" && after >= 1e3;
  const double si = kilo ? 1e3 : b.unit.si;
  return {b.stage,
          b.at,
          b.regime,
          before,
          after,
          fmt::format("the error of {} {}{} grew from {} to {} {}", b.stage, b.at,
                      b.regime.empty() ? "" : " " + b.regime, plain_number(before / si, 3),
                      plain_number(after / si, 3), kilo ? "kN" : b.unit.name)};
}

std::vector<HarmedError> harmed_energies(const Machine& machine, const CompareResult& before,
                                         const CompareResult& after, const Blocks& blocks,
                                         const ErrorChangeOptions& options) {
  std::vector<HarmedError> harmed;
  for (const Pump& pump : machine.pumps) {
    const BlockSums sums = blocks.enough([&](const std::vector<CompareBlock>& over) {
      return energy_errors(before, after, over, pump);
    });
    const double all = sums.weight.sum();
    if (!(all > 0.0) || !sums.grew(options)) continue;
    const double b = sums.before.sum() / all, a = sums.after.sum() / all;
    if (a - b < options.energy_moves) continue;
    harmed.push_back({"energy", pump.name, "", b, a,
                      fmt::format("the error of the energy of pump {} grew from {:.2f} to {:.2f} %",
                                  pump.name, 100.0 * b, 100.0 * a)});
  }
  return harmed;
}

/// Standard error of log(overall) from each block's contribution to it, to first order.
class OverallNoise {
 public:
  explicit OverallNoise(std::size_t blocks)
      : added_(VectorXd::Zero(static_cast<Index>(blocks))), weight_(added_) {}

  /// @param n number of samples in the quantity's score
  void add(const BlockSums& sums, double n) {
    const double both = sums.before.sum() + sums.after.sum(), counted = sums.weight.sum();
    if (!(both > 0.0) || !(counted > 0.0)) return;
    added_ += n / both * (sums.after - sums.before);
    weight_ += n / counted * sums.weight;
  }
  double deviation() const {
    const auto used = static_cast<double>((weight_.array() > 0.0).count());
    if (used < 2.0) return 0.0;
    const double mean = added_.sum() / weight_.sum();
    return std::sqrt((added_ - mean * weight_).squaredNorm() * used / (used - 1.0)) / weight_.sum();
  }

 private:
  VectorXd added_, weight_;
};

}  // namespace

bool ErrorChange::worse(const ErrorChangeOptions& options) const {
  return own > options.largest_own || overall > options.refit_moves || !harmed.empty();
}

ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const std::string& stage,
                         const std::string& at) {
  return error_change(machine, before, after, ChangedPlace{{stage}, at}, {});
}

ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const std::vector<std::string>& stages,
                         const std::string& at) {
  return error_change(machine, before, after, ChangedPlace{stages, at}, {});
}

ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const ChangedPlace& place,
                         const ErrorChangeOptions& options) {
  const std::vector<std::string>& stages = place.stages;
  const std::string& at = place.at;
  const Blocks blocks(before, options);
  const bool known_stages = std::all_of(stages.begin(), stages.end(), [](const std::string& s) {
    return s == "force" || s == "flow" || s == "pressure" || s == "pump";
  });
  const auto in_stage = [&](const StageScore& s) {
    return !known_stages || std::find(stages.begin(), stages.end(), s.stage) != stages.end();
  };
  const bool one_place =
      known_stages && std::any_of(before.scores.begin(), before.scores.end(),
                                  [&](const StageScore& s) { return in_stage(s) && s.at == at; });
  ErrorChange out;
  OverallNoise noise(blocks.motions.size());
  double all = 0.0, all_n = 0.0;
  SteadySquares steady;
  struct Pool {
    double before = 0.0, after = 0.0, n = 0.0;
    double won = 0.0, lost = 0.0;  // decrease and increase of squared error, summed over quantities
    std::vector<HarmedError> harmed;
  };
  std::map<std::string, Pool> own;  // by stage, since its quantities have one unit
  for (const StageScore& b : before.scores) {
    const StageScore* a = after.find(b.stage, b.at, b.regime);
    if (a == nullptr || a->n == 0 || b.n == 0 || !(b.rmse > 0.0) || !(a->rmse > 0.0)) continue;
    const double n = 0.5 * static_cast<double>(a->n + b.n);
    const double change = std::log(a->rmse / b.rmse);
    all += n * change;
    all_n += n;
    noise.add(squared_errors(before, after, blocks.motions, b, true), n);
    const bool is_own =
        in_stage(b) &&
        (one_place ? b.at == at : acts_on(before, after, blocks.motions, b, options.acts_share));
    if (is_own) {
      Pool& pool = own[b.stage];
      const double was = n * b.rmse * b.rmse, is = n * a->rmse * a->rmse;
      pool.before += was;
      pool.after += is;
      pool.n += n;
      (is < was ? pool.won : pool.lost) += std::abs(is - was);
      const SteadySquares moving = steady_errors(machine, before, after, b, options);
      steady.before += moving.before;
      steady.after += moving.after;
      steady.n += moving.n;
    }
    const BlockSums sums = blocks.enough([&](const std::vector<CompareBlock>& over) {
      return squared_errors(before, after, over, b);
    });
    const double counted = std::max(1.0, sums.weight.sum());
    const double was = std::sqrt(sums.before.sum() / counted);
    const double is = std::sqrt(sums.after.sum() / counted);
    if (is > options.large_change * was && sums.grew(options))
      (is_own ? own[b.stage].harmed : out.harmed).push_back(harm(b, was, is));
  }
  // Where the change acts on several quantities, a small increase of one is accepted for a large decrease of others.
  for (auto& [name, pool] : own) {
    if (pool.lost <= options.largest_loss * pool.won) continue;
    out.harmed.insert(out.harmed.end(), pool.harmed.begin(), pool.harmed.end());
  }
  const std::vector<HarmedError> energies =
      harmed_energies(machine, before, after, blocks, options);
  out.harmed.insert(out.harmed.end(), energies.begin(), energies.end());
  if (all_n > 0.0) out.overall = std::exp(all / all_n);
  out.overall_deviation = noise.deviation();
  double log_own = 0.0, own_n = 0.0;
  for (const auto& [name, pool] : own) {
    log_own += pool.n * 0.5 * std::log(pool.after / pool.before);
    own_n += pool.n;
  }
  out.own = own_n > 0.0 ? std::exp(log_own / own_n) : out.overall;
  out.own_steady = steady.n >= options.fewest_steady && steady.before > 0.0 && own.size() == 1
                       ? std::sqrt(steady.after / steady.before)
                       : out.own;
  return out;
}

}  // namespace sparflow
