#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "simulator/programmes/programmes.h"
#include "simulator/random/random.h"

namespace sparflow::plant {
namespace {

constexpr double kSpeedShare = 0.6;  // of what valve and pump allow, mean over a leg
constexpr double kRaise = 0.15;      // of a joint's range, by which a load is lifted
constexpr int kDraws = 12;           // postures of which the lowest is where a load lies
constexpr double kHandling = 1.5;    // [s] for taking and putting down

/// A move from rest to rest, then a rest in which the payload may change.
struct CycleLeg {
  Eigen::VectorXd to;
  std::optional<double> payload_after;
};

class WorkCycles : public Programme {
 public:
  WorkCycles(const Machine& machine, const PlantParameters& parameters, const WorkRequest& request)
      : machine_(machine),
        parameters_(parameters),
        levers_(machine, parameters),
        random_(request.seed, "cycles"),
        load_(request.payload.value_or(0.7 * usual_payload(machine))) {
    from_ = low_posture();
    plan();
  }
  std::vector<double> start() const override { return {from_.data(), from_.data() + from_.size()}; }
  double start_payload() const override { return 0.0; }

  ProgrammeStep step(const Record& r) override {
    ProgrammeStep s;
    if (begin_ < 0.0) start_leg(r);
    const double t = r.t - begin_;
    const CycleLeg& leg = legs_[now_];
    Eigen::VectorXd at = leg.to, rate = Eigen::VectorXd::Zero(at.size());
    if (t < duration_) {
      const double phase = std::numbers::pi * t / duration_;
      at = from_ + 0.5 * (1.0 - std::cos(phase)) * (leg.to - from_);
      rate = 0.5 * std::numbers::pi / duration_ * std::sin(phase) * (leg.to - from_);
    } else if (leg.payload_after && !handled_ && t > duration_ + 0.25 * kHandling) {
      s.payload = leg.payload_after;
      handled_ = true;
    }
    s.command = follow(levers_, r, at, rate);
    if (t > duration_ + (leg.payload_after ? kHandling : 0.3)) {
      from_ = leg.to;
      begin_ = -1.0;
      if (++now_ == legs_.size()) plan();
    }
    return s;
  }

 private:
  Eigen::VectorXd low_posture() {
    Eigen::VectorXd lowest;
    double least = 0.0;
    for (int i = 0; i < kDraws; ++i) {
      Eigen::VectorXd q(machine_.joint_count());
      for (int k = 0; k < machine_.joint_count(); ++k) {
        const Range r = machine_.joints[static_cast<std::size_t>(k)].position;
        const bool driven = machine_.cylinder_of_joint(k) >= 0;
        q[k] = r.lo + (r.hi - r.lo) * (driven ? random_.uniform(0.15, 0.75) : 0.5);
      }
      const double height = -machine_.gravity.dot(tip_position<double>(machine_, q));
      if (lowest.size() > 0 && height >= least) continue;
      lowest = q;
      least = height;
    }
    return lowest;
  }

  /// The posture with its load lifted: the joint that raises the tip most in a share of its range.
  Eigen::VectorXd raised(const Eigen::VectorXd& q) const {
    Eigen::VectorXd best = q;
    double most = -machine_.gravity.dot(tip_position<double>(machine_, q));
    for (int k = 0; k < machine_.joint_count(); ++k) {
      if (machine_.cylinder_of_joint(k) < 0) continue;
      const Range r = machine_.joints[static_cast<std::size_t>(k)].position;
      for (const double way : {kRaise, -kRaise}) {
        Eigen::VectorXd moved = q;
        moved[k] = std::clamp(q[k] + way * (r.hi - r.lo), r.lo + 0.05 * (r.hi - r.lo),
                              r.hi - 0.05 * (r.hi - r.lo));
        const double height = -machine_.gravity.dot(tip_position<double>(machine_, moved));
        if (height <= most) continue;
        best = moved;
        most = height;
      }
    }
    return best;
  }

  void plan() {
    const Eigen::VectorXd pick = now_ == 0 && legs_.empty() ? from_ : low_posture();
    const Eigen::VectorXd put = low_posture();
    const double load = std::round(load_ * random_.uniform(0.4, 1.0) / 10.0) * 10.0;
    legs_ = {{pick, load},
             {raised(pick), std::nullopt},
             {raised(put), std::nullopt},
             {put, 0.0},
             {raised(put), std::nullopt}};
    now_ = 0;
  }

  void start_leg(const Record& r) {
    begin_ = r.t;
    handled_ = false;
    // from where the machine stands, so that no error is made up in the first instant
    for (Eigen::Index k = 0; k < from_.size(); ++k) from_[k] = r.q[static_cast<std::size_t>(k)];
    duration_ = 0.8;
    std::vector<double> volume(machine_.pumps.size(), 0.0);
    for (int c = 0; c < machine_.cylinder_count(); ++c) {
      const Cylinder& drive = machine_.cylinders[static_cast<std::size_t>(c)];
      const double way = cylinder_length(machine_, c, legs_[now_].to[drive.joint]) -
                         cylinder_length(machine_, c, from_[drive.joint]);
      duration_ =
          std::max(duration_, std::abs(way) / (kSpeedShare * levers_.fastest(c, way > 0.0)));
      const int pump = machine_.pump_of_cylinder(c);
      if (pump >= 0 && drive.hydraulic())
        volume[static_cast<std::size_t>(pump)] +=
            std::abs(way) * (way > 0.0 ? drive.area_piston() : drive.area_rod());
    }
    for (std::size_t p = 0; p < volume.size(); ++p)
      duration_ = std::max(duration_, volume[p] / (kSpeedShare * parameters_.pumps[p].max_flow));
  }

  const Machine& machine_;
  const PlantParameters& parameters_;
  LeverMap levers_;
  simulator::Random random_;
  double load_;
  std::vector<CycleLeg> legs_;
  std::size_t now_ = 0;
  Eigen::VectorXd from_;
  double begin_ = -1.0, duration_ = 1.0;
  bool handled_ = false;
};

}  // namespace

std::unique_ptr<Programme> work_cycles(const Machine& machine, const PlantParameters& parameters,
                                       const WorkRequest& request) {
  return std::make_unique<WorkCycles>(machine, parameters, request);
}

}  // namespace sparflow::plant
