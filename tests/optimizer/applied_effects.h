#pragma once
/// Effects applied to a model with typical values times a strength.
#include <string>

#include "models/chain/crane_model.h"
#include "models/effects/registry.h"

namespace sparflow::test_support {

/// Typical values times `strength`; nonlinear parameters (shapes, switches) stay typical.
inline AppliedEffect applied(const EffectAt& place, double strength = 1.0) {
  AppliedEffect e{place.effect, place.at, {}, {}, {}};
  for (const EffectParameter& p : place.effect->info().parameters) {
    e.values.push_back(p.linear ? strength * p.typical : p.typical);
  }
  return e;
}

inline AppliedEffect applied(const std::string& key, const Machine& machine,
                             double strength = 1.0) {
  return applied(parse_effect(key, machine), strength);
}

}  // namespace sparflow::test_support
