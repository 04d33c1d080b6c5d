#pragma once
/// Experiment design: the motion that best distinguishes an effect from its rivals. Each of a list of motions that an
/// operator can drive is synthesised on the machine inside its limits, with the effect at its estimated size. The gain
/// of the part that the refitted rivals cannot explain is computed with the noise of the user's own channels.
#include <string>
#include <vector>

#include "diagnosis/experiment/experiment_options.h"
#include "diagnosis/regression/effect_fit.h"
#include "diagnosis/selection/effect_search.h"

namespace sparflow {

/// One leg of a motion: some joints move together from rest to rest.
struct MotionLeg {
  std::vector<int> joints;  ///< empty: a pause
  double to = 0.5;          ///< 0..1 end position, as share of each joint's range
  double speed = 0.5;       ///< 0..1 mean speed, as share of the limit by joint, valve and pump
  double pause = 1.0;       ///< [s] at rest afterwards
  double payload = 0.0;     ///< [kg]
};

struct MotionRecipe {
  std::string words;            ///< what to record, as an instruction to an operator
  std::vector<MotionLeg> legs;  ///< repeated in turn until the duration is reached
  bool steps = false;           ///< trapezoidal speed with short ramps, else a half cosine
  bool warms_up = false;        ///< the oil warms from 20 to 60 degC
};

/// Motions that may be worth recording on this machine.
/// @param heaviest [kg] the larger of two payloads
std::vector<MotionRecipe> motion_menu(const Machine& machine, double heaviest,
                                      const MotionOptions& options = {});

/// A synthetic log of the recipe: joint positions, commands, chamber pressures, pump pressures, payload and oil
/// temperature of the model's machine, quasi-static and without noise.
/// @param step [s]  @param duration [s]
Log synthesise_motion(const CraneModel& model, const MotionRecipe& recipe, double step,
                      double duration = 60.0, const MotionOptions& options = {});

struct BetterMotion {
  std::string words;             ///< empty: no motion of the list distinguishes them
  double nats_per_minute = 0.0;  ///< gain of the effect over the best of its rivals
  double nats_here = 0.0;        ///< the same on the user's own logs, per minute
  std::vector<EffectAt>
      apart;  ///< rivals that it distinguishes from the effect: all, or those that any motion does
};

/// Effects between which the evidence cannot decide.
struct IndistinguishableSet {
  AppliedEffect found;           ///< with its values
  std::vector<EffectAt> rivals;  ///< effects that explain the evidence as well
};

/// @param fit with the noise models of the evidence's channels; quantities not measured there are left out
BetterMotion better_motion(const CraneModel& model, const Evidence& evidence, const EffectFit& fit,
                           const IndistinguishableSet& set, const ExperimentOptions& options = {});

/// What to record next to decide between the effects of an indistinguishable set.
struct Experiment {
  std::string reason;  ///< which effects it would distinguish
  std::string motion;  ///< what to record, in words: joint, direction, speeds, load
  /// Gain of the effect over its rivals in a minute of that motion, and in a minute of the present logs [nats]; 0 = no
  /// motion of the list distinguishes them, and `motion` is the catalogue's general advice for the effect.
  double nats_per_minute = 0.0, nats_here = 0.0;
  /// [nats] gain that decides, from which the number of minutes follows: that of the search.
  double decisive_nats = SearchOptions{}.same_nats;

  std::string sentence() const;  ///< with the number of minutes, without a full stop
};

/// What to record next to distinguish a found effect from its rivals; where no motion of the list does, the catalogue's
/// general advice for the effect.
Experiment next_experiment(const CraneModel& model, const Evidence& evidence, const EffectFit& fit,
                           const IndistinguishableSet& set, const ExperimentOptions& options = {});

}  // namespace sparflow
