#include "planners/configuration_space.h"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>

#include <algorithm>
#include <memory>

#include "planners/tip_goal.h"

namespace sparflow {
namespace {

namespace ob = ompl::base;

const double* values(const ob::State* state) {
  return state->as<ob::RealVectorStateSpace::StateType>()->values;
}

class Validity : public ob::StateValidityChecker {
 public:
  Validity(const ob::SpaceInformationPtr& information, ClearanceModel& clearance,
           const Eigen::VectorXd& scale)
      : StateValidityChecker(information), clearance_(clearance), scale_(scale), q_(scale.size()) {}
  bool isValid(const ob::State* state) const override {
    if (!si_->satisfiesBounds(state)) return false;
    for (Eigen::Index i = 0; i < q_.size(); ++i) q_[i] = values(state)[i] * scale_[i];
    return clearance_.clear(q_.data());
  }

 private:
  ClearanceModel& clearance_;
  Eigen::VectorXd scale_;
  mutable Eigen::VectorXd q_;
};

class AdvancingMotionValidator : public ob::MotionValidator {
 public:
  AdvancingMotionValidator(const ob::SpaceInformationPtr& information, ClearanceModel& clearance,
                           const Eigen::VectorXd& scale)
      : MotionValidator(information),
        clearance_(clearance),
        scale_(scale),
        from_(scale.size()),
        to_(scale.size()) {}
  bool checkMotion(const ob::State* s1, const ob::State* s2) const override {
    return share(s1, s2) >= 1.0;
  }
  bool checkMotion(const ob::State* s1, const ob::State* s2,
                   std::pair<ob::State*, double>& last_valid) const override {
    const double clear = share(s1, s2);
    if (clear >= 1.0) return true;
    last_valid.second = std::max(0.0, clear);
    if (last_valid.first) {
      si_->getStateSpace()->interpolate(s1, s2, last_valid.second, last_valid.first);
    }
    return false;
  }

 private:
  double share(const ob::State* s1, const ob::State* s2) const {
    for (Eigen::Index i = 0; i < from_.size(); ++i) {
      from_[i] = values(s1)[i] * scale_[i];
      to_[i] = values(s2)[i] * scale_[i];
    }
    return clearance_.clear_share(from_.data(), to_.data());
  }
  ClearanceModel& clearance_;
  Eigen::VectorXd scale_;
  mutable Eigen::VectorXd from_, to_;
};

}  // namespace

ConfigurationSpace::ConfigurationSpace(const MotionProblem& problem, ClearanceModel& clearance)
    : scale_(speed_scale(problem)), limits_(problem.limits.position) {
  const auto joints = static_cast<unsigned>(scale_.size());
  auto space = std::make_shared<ob::RealVectorStateSpace>(joints);
  ob::RealVectorBounds bounds(joints);
  for (unsigned i = 0; i < joints; ++i) {
    bounds.setLow(i, limits_[i].lo / scale_[i]);
    bounds.setHigh(i, limits_[i].hi / scale_[i]);
  }
  space->setBounds(bounds);
  information_ = std::make_shared<ob::SpaceInformation>(space);
  information_->setStateValidityChecker(
      std::make_shared<Validity>(information_, clearance, scale_));
  information_->setMotionValidator(
      std::make_shared<AdvancingMotionValidator>(information_, clearance, scale_));
  information_->setup();
}

void ConfigurationSpace::write(const Eigen::VectorXd& q, ob::State* state) const {
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    state->as<ob::RealVectorStateSpace::StateType>()->values[i] = q[i] / scale_[i];
  }
}

void ConfigurationSpace::read(const ob::State* state, double* q) const {
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    q[i] = std::clamp(values(state)[i] * scale_[k], limits_[i].lo, limits_[i].hi);
  }
}

Eigen::MatrixXd ConfigurationSpace::rows(const ompl::geometric::PathGeometric& path) const {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(path.getStateCount()), scale_.size());
  Eigen::VectorXd q(scale_.size());
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    read(path.getState(static_cast<unsigned>(k)), q.data());
    rows.row(k) = q;
  }
  return rows;
}

}  // namespace sparflow
