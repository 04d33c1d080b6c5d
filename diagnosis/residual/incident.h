#pragma once
/// Something large that happened once. The gate draws its noise from the residuals, block by block: what sits in one
/// block alone may as well be that block's own, so no law is proven by it; but it is no noise either.
#include <cstddef>
#include <string>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

/// Where an effect lowers the error most.
struct Incident {
  std::size_t channel = 0, log = 0;
  double from = 0.0, to = 0.0;  ///< [s] in that log
  double before = 0.0,
         after = 0.0;  ///< [SI of the channel] RMS from `from` to `to`, without and with the effect
  double share = 0.0;  ///< of all that the effect explains in that channel
};

/// @param null, with fits of the same evidence without and with the effect
/// @return share = 0 when it lowers no error
Incident where_it_shows(const Evidence& evidence, const EffectFit& null, const EffectFit& with);

/// @param key of the effect that would explain it
std::string incident_sentence(const Evidence& evidence, const Incident& incident,
                              const std::string& key);

}  // namespace sparflow
