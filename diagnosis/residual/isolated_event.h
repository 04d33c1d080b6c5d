#pragma once
/// An isolated event: a deviation at one place in time only. The null distribution is simulated from the residuals of
/// whole blocks, so a deviation in a single block proves no law; but it is too large to be noise.
#include <cstddef>
#include <string>

#include "diagnosis/regression/effect_fit.h"
#include "diagnosis/residual/residual_options.h"

namespace sparflow {

/// The interval in which an effect reduces the error most.
struct IsolatedEvent {
  std::size_t channel = 0, log = 0;
  double from = 0.0, to = 0.0;  ///< [s] in that log
  double before = 0.0,
         after = 0.0;  ///< [SI] RMS error in the interval, without and with the effect
  double share =
      0.0;  ///< 0..1 share of the interval in all that the effect explains in that channel
};

/// @param null, with fits of the same evidence without and with the effect
/// @return share = 0 when the effect reduces no error
IsolatedEvent locate_isolated_event(const Evidence& evidence, const EffectFit& null,
                                    const EffectFit& with, const IsolatedEventOptions& options);

/// Sentence without full stop. @param key of the effect that would explain the event
std::string isolated_event_sentence(const Evidence& evidence, const IsolatedEvent& isolated_event,
                                    const std::string& key);

}  // namespace sparflow
