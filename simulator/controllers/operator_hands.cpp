#include "simulator/controllers/operator_hands.h"

#include <algorithm>
#include <cmath>

namespace sparflow::control {

std::vector<Gain> OperatorGains::table() {
  const OperatorGains g;
  return {{"approach", "1/s", g.approach, 0.2, 5.0}, {"hurry", "-", g.hurry, 0.5, 1.0}};
}

const Eigen::VectorXd& Seen::look(const Measurement& now) {
  past_.emplace_back(now.t, now.q);
  while (past_.size() > 1 && past_[1].first <= now.t - kReaction) past_.pop_front();
  return past_.front().second;
}

const std::vector<double>& Hands::move(const std::vector<double>& wanted) {
  for (std::size_t c = 0; c < lever_.size(); ++c)
    lever_[c] += std::clamp(wanted[c] - lever_[c], -most_, most_);
  return lever_;
}

double careful_speed(double left, double cruise, double approach) {
  if (std::abs(left) < kArrived) return 0.0;
  return std::copysign(std::min(cruise, approach * std::abs(left)), left);
}

}  // namespace sparflow::control
