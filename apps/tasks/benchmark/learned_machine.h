#pragma once
/// What a fitted model lends to the controllers of the benchmark: valves and predicted power.
#include "models/chain/crane_model.h"
#include "problems/problem.h"
#include "simulator/controllers/section_valves.h"

namespace sparflow {

/// Sections by the model's valve gains and, where it has that effect, dead bands; where nothing was learned those of the
/// machine file.
std::vector<control::ValveSection> learned_sections(const CraneModel& model);

/// Limits accelerations to those with which a valve takes its rod to full speed in no less than a time.
/// @param q posture of the lever arms  @param ramp [s] 0: no limit
void limit_accelerations(const CraneModel& model, const Eigen::VectorXd& q, double ramp,
                         MotionLimits& limits);

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
