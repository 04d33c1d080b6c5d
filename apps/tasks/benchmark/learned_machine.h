#pragma once
/// What a fitted model lends to the controllers of the benchmark: valves and predicted power.
#include "models/chain/crane_model.h"
#include "simulator/controllers/section_valves.h"

namespace sparflow {

/// Sections by the model's valve gains and, where it has that effect, dead bands; where nothing was learned those of the
/// machine file.
std::vector<control::ValveSection> learned_sections(const CraneModel& model);

/// The pumps' power by the exact law.
class LearnedPower : public control::PowerModel {
 public:
  /// @param model must outlive this object
  explicit LearnedPower(const CraneModel& model) : chain_(model) {}
  double power(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, double payload) override {
    return chain_.evaluate({q.data(), qd.data()}, payload).power;
  }

 private:
  Chain chain_;
};

}  // namespace sparflow
