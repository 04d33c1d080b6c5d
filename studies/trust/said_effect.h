#pragma once
/// Are effects that are said with a probability of 90 % right in 90 % of cases? What a diagnosis says, beside the truth.
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "diagnosis/verdict/diagnose.h"

namespace sparflow::bench {

/// An effect that a diagnosis names as missing.
struct SaidEffect {
  std::string key;
  double probability = 0.0;      ///< [-] as said, that it is this effect
  double set_probability = 0.0;  ///< [-] as said, that it is this effect or one of its rivals
  bool right = false;            ///< it was hidden
  bool set_right = false;        ///< it or one of its rivals was hidden
};

/// The effects that a diagnosis names; none unless its verdict is that something is missing.
/// @param is_true whether an effect, given as id:place, was hidden
std::vector<SaidEffect> said_effects(const Diagnosis& d,
                                     const std::function<bool(const std::string&)>& is_true);

nlohmann::json said_json(const std::vector<SaidEffect>& said);

/// A line for each range of probabilities: how many were said, their mean probability, and how many of them were right.
std::string reliability_text(const std::vector<SaidEffect>& said);

}  // namespace sparflow::bench
