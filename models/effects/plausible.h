#pragma once
/// How large an effect may plausibly be on a machine, by the machine's own masses and areas. The catalogue's bounds hold for
/// any machine; these come from the machine file: a force of no more than the cylinder can push at the pump's largest
/// pressure, a mass of no more than the machine's own, a mass moment of no more than that mass at the tip, a pressure of
/// no more than the pump's largest.
#include <string>

#include "models/effects/effect.h"

namespace sparflow {

/// Largest plausible magnitude of a parameter [SI], by its unit and by the place where the effect acts.
/// @param at joint, cylinder or pump as the effect's place says; -1 = machine
/// @return infinity where the machine file says nothing about it
double plausible_limit(const Machine& machine, const EffectInfo& effect, int at,
                       const EffectParameter& parameter);

/// @return a sentence on the first parameter beyond its limit, without a full stop; "" when all are plausible
std::string beyond_plausible(const Machine& machine, const AppliedEffect& effect);

}  // namespace sparflow
