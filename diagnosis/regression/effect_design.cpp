// Designs of effects: their columns in all channels; declared in effect_fit.h.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Noise floor of a channel; where it is not known, the rounding error of the measurement. [SI]
double noise_or_rounding(const EvidenceChannel& channel) {
  if (channel.noise_floor > 0.0) return channel.noise_floor;
  return 1e-9 * channel.y.cwiseAbs().maxCoeff() + 1e-300;
}

/// Column `k` of all channels in units of the noise floor, orthogonal to the columns before it.
VectorXd own_part(const Evidence& evidence, const EffectDesign& design, Index k) {
  Index rows = 0;
  for (const MatrixXd& c : design.columns) rows += c.cols() > 0 ? c.rows() : 0;
  MatrixXd stacked(rows, k + 1);
  Index at = 0;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    if (!design.touches(c)) continue;
    const MatrixXd& columns = design.columns[c];
    stacked.middleRows(at, columns.rows()) =
        columns.leftCols(k + 1) / noise_or_rounding(evidence.channels[c]);
    at += columns.rows();
  }
  for (Index i = 0; i <= k; ++i) {  // modified Gram-Schmidt
    for (Index before = 0; before < i; ++before) {
      const double square = stacked.col(before).squaredNorm();
      if (square > 0.0)
        stacked.col(i) -=
            stacked.col(before).dot(stacked.col(i)) / square * stacked.col(before).eval();
    }
  }
  return stacked.col(k);
}

/// Sets a linear parameter's columns to zero where it has no own effect even at its bound: it changes no measurement
/// (a point mass on the joint's own axis, beside its moment) or is collinear with the parameters before it (a scale
/// error where the load never changes). Its estimate would be determined by rounding alone.
void drop_negligible(const Evidence& evidence, EffectDesign& design) {
  if (!design.acts()) return;
  for (Index k = 0; k < design.linear; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double most = std::max(std::abs(design.lower[at]), std::abs(design.upper[at]));
    if (!(own_part(evidence, design, k).cwiseAbs().maxCoeff() * most <
          evidence.options.negligible_action))
      continue;
    for (MatrixXd& c : design.columns) {
      if (c.cols() > 0) c.col(k).setZero();
    }
  }
}

std::uint64_t next_number() {
  static std::atomic<std::uint64_t> last = 0;
  return ++last;
}

/// @param k index among the linear parameters
bool is_optional(const EffectDesign& design, Index k) {
  for (const EffectParameter& p : design.effect.effect->info().parameters) {
    if (p.linear && k-- == 0) return p.optional;
  }
  return false;
}

}  // namespace

bool EffectDesign::parameter_acts(Index k) const {
  return std::any_of(columns.begin(), columns.end(),
                     [&](const MatrixXd& m) { return m.cols() > 0 && !m.col(k).isZero(0.0); });
}

bool EffectDesign::acts() const {
  return std::any_of(columns.begin(), columns.end(),
                     [](const MatrixXd& c) { return c.cols() > 0; });
}

EffectDesign make_design(const Evidence& evidence, const EffectAt& effect,
                         std::vector<double> shape, std::span<const double> about, bool optional) {
  EffectDesign d;
  d.effect = effect;
  d.shape = std::move(shape);
  d.about.assign(about.begin(), about.end());
  for (const EffectParameter& p : effect.effect->info().parameters) {
    if (!p.linear) continue;
    ++d.linear;
    d.lower.push_back(p.lower);
    d.upper.push_back(p.upper);
  }
  if (d.shape.size() + d.lower.size() != effect.effect->info().parameters.size())
    throw std::invalid_argument("An effect's design needs a value of each nonlinear parameter.");
  for (const EvidenceChannel& c : evidence.channels)
    d.columns.push_back(evidence.columns(effect, d.shape, c, about));
  drop_negligible(evidence, d);
  d.number = next_number();
  if (!optional) return without_optional(std::move(d));
  for (Index k = 0; k < d.linear; ++k) {
    if (!is_optional(d, k)) continue;
    for (const MatrixXd& c : d.columns)
      d.optional = d.optional || (c.cols() > 0 && !c.col(k).isZero(0.0));
  }
  return d;
}

MatrixXd columns_of(const std::vector<const EffectDesign*>& designs, std::size_t channel,
                    Index rows) {
  Index width = 0, at = 0;
  for (const EffectDesign* d : designs) width += d->columns[channel].cols();
  MatrixXd all(rows, width);
  for (const EffectDesign* d : designs) {
    const Index w = d->columns[channel].cols();
    if (w > 0) all.middleCols(at, w) = d->columns[channel];
    at += w;
  }
  return all;
}

int optional_shapes(const EffectDesign& design) {
  if (design.shape.empty()) return 0;
  int count = 0;
  std::size_t k = 0;
  for (const EffectParameter& p : design.effect.effect->info().parameters) {
    if (p.linear) continue;
    count += p.optional && !is_absent(p, design.shape[k]) ? 1 : 0;
    ++k;
  }
  return count;
}

EffectDesign without_optional(EffectDesign design) {
  for (Index k = 0; k < design.linear; ++k) {
    if (!is_optional(design, k)) continue;
    for (MatrixXd& c : design.columns) {
      if (c.cols() > 0) c.col(k).setZero();
    }
  }
  design.optional = false;
  design.number = next_number();
  return design;
}

}  // namespace sparflow
