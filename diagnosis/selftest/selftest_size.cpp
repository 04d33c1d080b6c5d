#include "diagnosis/selftest/selftest_size.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/effects/plausible.h"

namespace sparflow {
namespace {

double distance(double value, double typical) {
  return value > 0.0 && typical > 0.0 ? std::abs(std::log(value / typical))
                                      : std::abs(value - typical);
}

double whole_action(const EffectDesign& d) {
  double sum = 0.0;
  for (const Eigen::MatrixXd& c : d.columns) sum += c.squaredNorm();
  return sum;
}

}  // namespace

EffectSize size_effect(const Machine& machine, const SearchCandidate& candidate,
                       double largest_times) {
  const EffectInfo& info = candidate.effect.effect->info();
  std::vector<const EffectParameter*> shapes;
  std::vector<double> theta;
  bool share = false;
  EffectSize out;
  out.largest = largest_times;
  for (const EffectParameter& p : info.parameters) {
    if (!p.linear) {
      shapes.push_back(&p);
      continue;
    }
    theta.push_back(p.optional ? 0.0 : p.typical);
    if (p.optional) continue;
    share = share || p.lower > 0.0;
    if (p.typical != 0.0)
      out.largest = std::min(out.largest, plausible_limit(machine, info, candidate.effect.at, p) /
                                              std::abs(p.typical));
    if (p.typical > 0.0) out.largest = std::min(out.largest, p.upper / p.typical);
    if (p.typical < 0.0) out.largest = std::min(out.largest, p.lower / p.typical);
  }
  out.theta =
      Eigen::Map<const Eigen::VectorXd>(theta.data(), static_cast<Eigen::Index>(theta.size()));

  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t d = 0; d < candidate.designs.size(); ++d) {
    double far = 0.0;
    for (std::size_t k = 0; k < shapes.size(); ++k)
      far += distance(candidate.designs[d].shape[k], shapes[k]->typical);
    if (far < nearest) nearest = far, out.typical = d;
  }
  if (!share || shapes.empty()) return out;

  // only grid points with the same variant of the law
  const std::vector<double>& variant = candidate.designs[out.typical].shape;
  for (std::size_t d = 0; d < candidate.designs.size(); ++d) {
    const std::vector<double>& shape = candidate.designs[d].shape;
    if (std::equal(shape.begin() + 1, shape.end(), variant.begin() + 1))
      out.levels.push_back({d, shape[0], 0.0});
  }
  const auto action = [&](const SizeLevel& r) { return whole_action(candidate.designs[r.design]); };
  std::sort(out.levels.begin(), out.levels.end(),
            [&](const SizeLevel& a, const SizeLevel& b) { return action(a) < action(b); });
  // the grid of a limit depends on the range of the log, and so does its typical value: the middle of the grid
  const std::vector<double>& own = shapes[0]->grid;
  const bool by_log = std::find(own.begin(), own.end(), variant[0]) == own.end();
  if (by_log) out.typical = out.levels[out.levels.size() / 2].design;
  const EffectDesign& typical = candidate.designs[out.typical];
  for (SizeLevel& r : out.levels) {
    r.times = by_log ? std::sqrt(action(r) / whole_action(typical)) : r.value / typical.shape[0];
  }
  return out;
}

}  // namespace sparflow
