// Free durations of phases: their contributions to gradient and Hessian.
#include <cmath>

#include "models/math/error.h"
#include "optimizer/transcription/transcription.h"

namespace sparflow {

void Transcription::check_phases() const {
  if (phase_count_ == 0) return;
  const PhaseTimes& p = spec_.phases;
  SPARFLOW_CHECK(static_cast<int>(p.of_interval.size()) == intervals_,
                 "every interval has a phase");
  SPARFLOW_CHECK(p.of_interval.front() == 0, "phases are numbered from 0");
  for (std::size_t k = 1; k < p.of_interval.size(); ++k) {
    const int step = p.of_interval[k] - p.of_interval[k - 1];
    SPARFLOW_CHECK(step == 0 || step == 1, "phases follow one another");
  }
  SPARFLOW_CHECK(p.lower.size() == phase_count_ && p.upper.size() == phase_count_,
                 "every phase has bounds of its duration");
  SPARFLOW_CHECK((p.lower.array() > 0.0).all(),
                 "the lower bound of a phase's duration must be positive");
}

void Transcription::time_gradient(const double* x, Out gradient) const {
  gradient.tail(phase_count_).array() += spec_.phases.price;
  for (std::size_t s = 0; s < nodes_.size(); ++s) {
    for (const int side : {nodes_[s].before, nodes_[s].after}) {
      if (side >= 0) gradient[tau_index(phase(side))] += 0.5 * share_[side] * node_cost_[s];
    }
  }
  if (!spec_.acceleration_weight_times_step) return;
  for (int k = 0; k < intervals_; ++k) {
    for (int i = 0; i < n_; ++i) {
      const double qdd = x[qdd_index(k, i)];
      gradient[tau_index(phase(k))] += spec_.acceleration_weight[i] * share_[k] * qdd * qdd;
    }
  }
}

void Transcription::time_hessian(const double* x, double objective_factor, const double* multiplier,
                                 Out value) const {
  const int* place = time_node_hessian_.data();
  for (std::size_t s = 0; s < nodes_.size(); ++s) {
    const double* gradient = node_cost_gradient_.data() + s * static_cast<std::size_t>(z_size_);
    for (const int side : {nodes_[s].before, nodes_[s].after}) {
      if (side < 0) continue;
      for (int i = 0; i < z_size_; ++i, ++place) {
        // In the restoration phase the factor is zero, possibly before any evaluation of the objective.
        if (objective_factor != 0.0)
          value[*place] += objective_factor * 0.5 * share_[side] * gradient[i];
      }
    }
  }
  place = time_defect_hessian_.data();
  for (std::size_t row = 0; row < defects_.size(); ++row) {
    const Defect& d = defects_[row];
    const double m = multiplier[row] * share_[d.interval];
    if (d.velocity) {
      value[*place++] -= m;
    } else {
      value[*place++] -= 0.5 * m;
      value[*place++] -= 0.5 * m;
    }
  }
  if (!spec_.acceleration_weight_times_step) return;
  place = time_acceleration_hessian_.data();
  for (int k = 0; k < intervals_; ++k) {
    for (int i = 0; i < n_; ++i) {
      value[*place++] +=
          2.0 * objective_factor * spec_.acceleration_weight[i] * share_[k] * x[qdd_index(k, i)];
    }
  }
}

}  // namespace sparflow
