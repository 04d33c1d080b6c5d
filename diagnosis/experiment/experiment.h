#pragma once
/// The motion that would tell an effect from others that explain the same logs: a menu of motions an operator can
/// drive, each synthesised on the machine inside its limits, the effect put on it at the size that was found, and
/// what its rivals, refitted, could not take over, measured in the noise of the user's own channels.
#include <string>
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

/// One leg of a motion: joints go together, rest to rest.
struct MotionLeg {
  std::vector<int> joints;  ///< empty: a pause
  double to = 0.5;          ///< where to, as share of each joint's range
  double speed = 0.5;       ///< mean speed, as share of what joint, valve and pump allow
  double pause = 1.0;       ///< [s] at rest afterwards
  double payload = 0.0;     ///< [kg]
};

struct MotionRecipe {
  std::string words;            ///< what to record, as one says it to an operator
  std::vector<MotionLeg> legs;  ///< repeated in turn until a minute is full
  bool steps = false;           ///< speeds change as fast as the joints can, else smoothly
  bool warms_up = false;        ///< the oil goes from 20 to 60 degC meanwhile
};

/// Motions worth recording on this machine; joints the two effects sit at come first.
/// @param heaviest [kg] the larger of two loads
std::vector<MotionRecipe> motion_menu(const Machine& machine, double heaviest);

/// A log of the recipe: joint positions, commands, both chamber pressures, pump pressures, payload and oil temperature
/// of the model's machine, quasi-static and without noise.
/// @param step [s]  @param duration [s]
Log synthesise_motion(const CraneModel& model, const MotionRecipe& recipe, double step,
                      double duration = 60.0);

struct BetterMotion {
  std::string words;             ///< empty: no motion of the menu tells them apart
  double nats_per_minute = 0.0;  ///< likelihood that the best of the rivals would lose
  double nats_here = 0.0;        ///< the same on the user's own logs, per minute
  std::vector<EffectAt>
      apart;  ///< the rivals it tells the effect from: all, or those that any motion does
};

/// @param fit gives the noise of the evidence's channels; what is not measured there is not counted on either
/// @param found with its values  @param rivals that explain the evidence as well
BetterMotion better_motion(const CraneModel& model, const Evidence& evidence, const EffectFit& fit,
                           const AppliedEffect& found, const std::vector<EffectAt>& rivals);

/// What to record next so that one set of effects is told apart.
struct Experiment {
  std::string reason;  ///< which effects it would tell apart
  std::string motion;  ///< what to record, in words: joint, direction, speeds, load
  /// Likelihood the wrong ones would lose in a minute of it, and in a minute of the logs at hand [nats]; 0 = no motion
  /// of the menu was found to tell them apart and `motion` is the catalogue's general word on the effect.
  double nats_per_minute = 0.0, nats_here = 0.0;

  std::string sentence() const;  ///< with how many minutes of it, without a full stop
};

/// What to record next to tell a found effect from its rivals; where no motion of the menu does, the catalogue's
/// general word on the effect.
Experiment next_experiment(const CraneModel& model, const Evidence& evidence, const EffectFit& fit,
                           const AppliedEffect& found, const std::vector<EffectAt>& rivals);

}  // namespace sparflow
