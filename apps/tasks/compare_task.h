#pragma once
/// The work of `compare`.
#include <string>
#include <vector>

#include "identification/comparison/compare.h"

namespace sparflow {

/// Compares a model with logs; a model that nothing was learned for is compared by forces and measured flows alone, because
/// pressures are learned.
/// @param learned whether the model is a fitted one  @param logs given back as soon as their signals are made
CompareResult compare_task(const CraneModel& model, std::vector<Log>&& logs, bool learned,
                           const CompareOptions& options = {});

}  // namespace sparflow
