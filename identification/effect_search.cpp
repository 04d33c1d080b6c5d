#include "identification/effect_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool verbose() {
  static const bool on = std::getenv("SPARFLOW_TRACE") != nullptr;
  return on;
}

struct Candidate {
  EffectAt effect;
  std::vector<EffectDesign> designs;  // one a point of the grid
  double penalty = 0.0;               // [nats]
};

std::vector<std::vector<double>> grid_of(const Effect& effect) {
  std::vector<std::vector<double>> points = {{}};
  for (const EffectParameter& p : effect.info().parameters) {
    if (p.linear) continue;
    std::vector<std::vector<double>> next;
    for (const auto& point : points) {
      for (const double v : p.grid) {
        next.push_back(point);
        next.back().push_back(v);
      }
    }
    points = std::move(next);
  }
  return points;
}

class Search {
 public:
  Search(const Evidence& evidence, const std::vector<EffectAt>& effects,
         const SearchOptions& options, const SearchProgress& progress)
      : evidence_(evidence), options_(options), progress_(progress), random_(options.seed) {
    double rows = 0.0;
    for (const EvidenceChannel& c : evidence.channels)
      rows = std::max(rows, static_cast<double>(c.rows()));
    for (const EffectAt& e : effects) {
      Candidate c;
      c.effect = e;
      for (auto& shape : grid_of(*e.effect)) {
        EffectDesign d = make_design(evidence, e, shape);
        if (d.acts()) c.designs.push_back(std::move(d));
      }
      if (c.designs.empty()) continue;
      // Schwarz (1978): half a log of the rows for each parameter
      c.penalty = 0.5 * static_cast<double>(e.effect->info().parameters.size()) *
                  std::log(std::max(rows, 10.0));
      candidates_.push_back(std::move(c));
    }
  }

  SearchResult run() {
    SearchResult result;
    EffectFit current = fit_effects(evidence_, {});
    result.null = current;
    std::vector<FoundEffect> found;
    for (int step = 0; step < options_.max_effects; ++step) {
      struct Score {
        const Candidate* candidate;
        const EffectDesign* design;
        double gain;
      };
      std::vector<Score> scores;
      const std::vector<const EffectDesign*> base = designs_of(found);
      for (const Candidate& c : candidates_) {
        if (is_in(found, c.effect)) continue;
        Score best{&c, nullptr, -1e300};
        for (const EffectDesign& d : c.designs) {
          const double g = gain(base, d, current);
          if (g > best.gain) best = {&c, &d, g};
        }
        best.gain -= c.penalty;
        scores.push_back(best);
      }
      if (scores.empty()) break;
      std::sort(scores.begin(), scores.end(),
                [](const Score& a, const Score& b) { return a.gain > b.gain; });
      if (step == 0) {
        for (const Score& s : scores) result.ranking.emplace_back(s.candidate->effect, s.gain);
      }
      const Gate gate = null_gate(base, current);
      if (verbose()) {
        fmt::print(stderr, "step {} threshold {:.1f} (flip {:.1f})\n", step,
                   gate.threshold(options_.false_alarm), gate.flip_threshold(options_.false_alarm));
        for (std::size_t i = 0; i < std::min<std::size_t>(8, scores.size()); ++i) {
          const Score& s = scores[i];
          fmt::print(stderr, "   {:28s} gain {:10.1f} shape {} \n", key(s.candidate->effect),
                     s.gain, s.design->shape.empty() ? 0.0 : s.design->shape[0]);
        }
      }
      const double level = step == 0 ? options_.false_alarm : 0.5 * options_.false_alarm;
      if (step == 0) {
        result.threshold = gate.threshold(level);
        result.p_value = gate.p_value(scores[0].gain);
      }
      const double p = gate.p_value(scores[0].gain);
      if (p >= level) break;
      FoundEffect f;
      f.design = *scores[0].design;
      f.p_value = p;
      found.push_back(std::move(f));
      current = fit_effects(evidence_, designs_of(found), nullptr, control());
      if (verbose()) {
        fmt::print(stderr, "  + {} theta", key(scores[0].candidate->effect));
        for (Index i = 0; i < current.theta.size(); ++i)
          fmt::print(stderr, " {:.5g}", current.theta[i]);
        fmt::print(stderr, "\n");
        for (std::size_t c = 0; c < evidence_.channels.size(); ++c) {
          const auto& ch = evidence_.channels[c];
          fmt::print(
              stderr, "     {:40s} n {} sd {:.3g} floor {:.3g} {} phi {:.2f} {:.2f} off {:.3g}\n",
              ch.text, ch.rows(), current.noise[c].deviation() / ch.unit.si,
              ch.noise_floor / ch.unit.si, ch.unit.name, current.noise[c].phi1,
              current.noise[c].phi2, std::sqrt(current.noise[c].offset_variance) / ch.unit.si);
        }
      }
    }
    result.final = current;
    result.found = std::move(found);
    return result;
  }

 private:
  struct Gate {
    std::vector<double> normal, flipped;  // largest penalised gains under the null, sorted
    static double quantile_of(const std::vector<double>& v, double level) {
      return v.empty()
                 ? 0.0
                 : v[static_cast<std::size_t>((1.0 - level) * static_cast<double>(v.size() - 1))];
    }
    double threshold(double level) const { return quantile_of(normal, level); }
    double flip_threshold(double level) const { return quantile_of(flipped, level); }
    static double p_of(const std::vector<double>& v, double gain) {
      const auto above = v.end() - std::lower_bound(v.begin(), v.end(), gain);
      return (1.0 + static_cast<double>(above)) / (1.0 + static_cast<double>(v.size()));
    }
    double p_value(double gain) const { return std::max(p_of(normal, gain), p_of(flipped, gain)); }
  };

  std::string key(const EffectAt& e) const {
    return effect_key(e.effect->info(), *evidence_.series[0].machine, e.at);
  }
  static std::vector<const EffectDesign*> designs_of(const std::vector<FoundEffect>& found) {
    std::vector<const EffectDesign*> d;
    for (const FoundEffect& f : found) d.push_back(&f.design);
    return d;
  }
  static bool is_in(const std::vector<FoundEffect>& found, const EffectAt& e) {
    return std::any_of(found.begin(), found.end(), [&](const FoundEffect& f) {
      return f.design.effect.effect == e.effect && f.design.effect.at == e.at;
    });
  }
  static FitControl control() {
    FitControl c;
    c.keep_residuals = true;
    c.covariance = true;
    return c;
  }

  /// Channels a candidate touches, and all that share a parameter with them.
  std::vector<bool> connected(const std::vector<const EffectDesign*>& designs,
                              const EffectDesign& d) const {
    std::vector<bool> active(evidence_.channels.size());
    for (std::size_t c = 0; c < active.size(); ++c) active[c] = d.touches(c);
    for (bool grown = true; grown;) {
      grown = false;
      for (const EffectDesign* other : designs) {
        bool meets = false, outside = false;
        for (std::size_t c = 0; c < active.size(); ++c) {
          meets = meets || (other->touches(c) && active[c]);
          outside = outside || (other->touches(c) && !active[c]);
        }
        if (!meets || !outside) continue;
        grown = true;
        for (std::size_t c = 0; c < active.size(); ++c) active[c] = active[c] || other->touches(c);
      }
    }
    return active;
  }

  double gain(const std::vector<const EffectDesign*>& base, const EffectDesign& d,
              const EffectFit& current) const {
    FitControl c;
    c.active = connected(base, d);
    c.noise_passes = 2;
    std::vector<const EffectDesign*> with;
    for (const EffectDesign* b : base) {
      bool needed = false;
      for (std::size_t k = 0; k < c.active.size(); ++k)
        needed = needed || (b->touches(k) && c.active[k]);
      if (needed) with.push_back(b);
    }
    with.push_back(&d);
    return fit_effects(evidence_, with, &current, c).total() - current.total();
  }

  /// Largest gain over all candidates when nothing is missing: white noise in the whitened rows, and the rows'
  /// own residuals with the signs of whole blocks drawn at random (no shape of the noise is assumed there).
  Gate null_gate(const std::vector<const EffectDesign*>& base, const EffectFit& current) {
    const int sims = options_.simulations;
    const std::size_t channels = evidence_.channels.size();
    std::vector<MatrixXd> noise(channels), fixed(channels);
    std::normal_distribution<double> normal;
    for (std::size_t c = 0; c < channels; ++c) {
      const EvidenceChannel& channel = evidence_.channels[c];
      Index width = 0;
      for (const EffectDesign* d : base) width += d->columns[c].cols();
      MatrixXd columns(channel.rows(), width);
      Index at = 0;
      for (const EffectDesign* d : base) {
        if (d->columns[c].cols() == 0) continue;
        columns.middleCols(at, d->columns[c].cols()) = d->columns[c];
        at += d->columns[c].cols();
      }
      MatrixXd rows = whitened_rows(channel, current.noise[c], columns);
      fixed[c] = rows.leftCols(width);
      VectorXd r = rows.col(width);
      if (width > 0) r -= fixed[c] * fixed[c].colPivHouseholderQr().solve(r);
      r /= std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
      noise[c].resize(channel.rows(), 2 * sims);
      for (Index i = 0; i < channel.rows(); ++i) {
        for (int s = 0; s < sims; ++s) noise[c](i, s) = normal(random_);
      }
      // a block's sign is the same in all channels: logs' blocks of different channels overlap, so draw by time
      for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
        const NoiseBlock& block = channel.blocks[b];
        for (int s = 0; s < sims; ++s) {
          const double sign = (random_() & 1U) != 0U ? 1.0 : -1.0;
          noise[c].col(sims + s).segment(block.first, block.last - block.first) =
              sign * r.segment(block.first, block.last - block.first);
        }
      }
    }
    VectorXd largest = VectorXd::Constant(2 * sims, -1e300);
    for (const Candidate& candidate : candidates_) {
      VectorXd best = VectorXd::Constant(2 * sims, -1e300);
      for (const EffectDesign& d : candidate.designs) {
        MatrixXd n = MatrixXd::Zero(d.linear, d.linear), z = MatrixXd::Zero(d.linear, 2 * sims);
        for (std::size_t c = 0; c < channels; ++c) {
          if (!d.touches(c)) continue;
          MatrixXd x = whitened_rows(evidence_.channels[c], current.noise[c], d.columns[c])
                           .leftCols(d.linear);
          if (fixed[c].cols() > 0) x -= fixed[c] * fixed[c].colPivHouseholderQr().solve(x);
          const double s2 = current.noise[c].variance;
          n += x.transpose() * x / s2;
          z += x.transpose() * noise[c] / std::sqrt(s2);
        }
        n.diagonal().array() *= 1.0 + 1e-9;
        const MatrixXd solved = n.ldlt().solve(z);
        best = best.cwiseMax(0.5 * (z.cwiseProduct(solved)).colwise().sum().transpose());
      }
      largest = largest.cwiseMax((best.array() - candidate.penalty).matrix());
    }
    Gate gate;
    gate.normal.assign(largest.begin(), largest.begin() + sims);
    gate.flipped.assign(largest.begin() + sims, largest.end());
    std::sort(gate.normal.begin(), gate.normal.end());
    std::sort(gate.flipped.begin(), gate.flipped.end());
    return gate;
  }

  const Evidence& evidence_;
  const SearchOptions& options_;
  const SearchProgress& progress_;
  std::mt19937_64 random_;
  std::vector<Candidate> candidates_;
};

}  // namespace

SearchResult search_effects(const Evidence& evidence, const std::vector<EffectAt>& candidates,
                            const SearchOptions& options, const SearchProgress& progress) {
  return Search(evidence, candidates, options, progress).run();
}

}  // namespace sparflow
