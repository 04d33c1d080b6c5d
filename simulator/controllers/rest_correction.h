#pragma once
/// Brings a rod that the motion holds at rest back to its place, and then leaves its valve closed. A plain position loop
/// cannot: near the dead band it either does nothing or hunts.
#include <algorithm>
#include <cmath>

namespace sparflow::control {

struct RestCorrectionOptions {
  /// Error on which a correction begins, as the way by which it moves the tip.
  /// @threshold [m] 0..0.05; tuned: prediction_study on problems/scenarios/tuning; a rod's own error says little, as booms
  /// magnify it ten times and a slewing rack forty times
  double begin = 0.005;
  /// Error at which a correction ends, as the same way.
  /// @threshold [m] 0..0.05; chosen: the sensors' noise at a long boom
  double end = 0.001;
  /// Time constant of the error on which a correction begins.
  /// @threshold [s] 0..2; chosen: a load that swings to and fro in two or three seconds presses rods together and
  /// apart, which is over before a correction has acted
  double filter = 1.0;
  /// Share of the full speed that a correction asks for at least.
  /// @threshold [-] 0..0.05; chosen: the least that leaves the dead band as it was learned
  double creep = 0.01;
  /// Growth of that share while the rod does not move.
  /// @threshold [1/s] 0..0.2; chosen: a dead band that was learned 0.02 too small is crossed within a second
  double creep_rise = 0.03;
  /// Time by which the rod's movement is looked ahead.
  /// @threshold [s] 0..1; chosen: as the tracker's lead
  double lead = 0.2;
  /// Growth of the error on which a correction begins, where it takes back the one before.
  /// @threshold [-] 1..4; tuned: prediction_study on problems/scenarios/tuning; a valve whose dead band is crossed late makes a
  /// rod overshoot each time, and a tip that is moved again and again never rests
  double calming = 2.0;
};

class RestCorrection {
 public:
  explicit RestCorrection(const RestCorrectionOptions& options = {})
      : options_(options), begin_(options.begin) {}

  /// What it needs to know of a rod at one sample.
  struct Rod {
    double error = 0.0;        ///< [m] wanted less measured length
    double speed = 0.0;        ///< [m/s] measured
    double tip_way = 1.0;      ///< [-] way of the tip over that of the rod
    double full_speed = 0.1;   ///< [m/s] towards the wanted length
    double sample_time = 0.0;  ///< [s]
  };
  /// The motion moves this rod: a correction follows when it comes to rest.
  void moving();
  /// The motion holds this rod. @param proportional [1/s] speed over error @return [m/s] to ask for, 0: closed
  double speed(const Rod& rod, double proportional);

 private:
  RestCorrectionOptions options_;
  double filtered_ = 0.0;  // [m] error
  double creep_ = 0.0;     // [-] of the full speed
  int way_ = 0;            // of the correction: 1 extends, -1 retracts, 0 none
  int last_ = 0;           // way of the correction before
  double begin_ = 0.0;     // [m] error on which the next one begins, as the way of the tip
  bool moved_ = false;     // by the motion, at the sample before
};

inline void RestCorrection::moving() {
  way_ = 0;
  moved_ = true;
}

inline double RestCorrection::speed(const Rod& rod, double proportional) {
  const RestCorrectionOptions& o = options_;
  if (moved_) {
    filtered_ = rod.error;
    begin_ = o.begin;
    last_ = 0;
  }
  moved_ = false;
  filtered_ += rod.sample_time / (o.filter + rod.sample_time) * (rod.error - filtered_);
  const double coming = rod.error - o.lead * rod.speed;  // where the rod is about to be
  const double end = o.end / rod.tip_way;
  if (way_ != 0 && way_ * coming < end) {
    way_ = 0;
    filtered_ = coming;  // what was before the correction is no reason for the next one
  }
  if (way_ == 0) {
    const bool begins = std::abs(filtered_) > begin_ / rod.tip_way && filtered_ * coming > 0.0 &&
                        std::abs(coming) > end;
    if (!begins) return 0.0;
    way_ = filtered_ > 0.0 ? 1 : -1;
    if (way_ * last_ < 0) begin_ *= o.calming;
    last_ = way_;
    creep_ = o.creep;
  }
  const double least = creep_ * rod.full_speed;
  if (way_ * rod.speed < 0.5 * o.creep * rod.full_speed) creep_ += o.creep_rise * rod.sample_time;
  return way_ * std::max(proportional * way_ * rod.error, least);
}

}  // namespace sparflow::control
