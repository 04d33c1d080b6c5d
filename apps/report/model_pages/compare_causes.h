#pragma once
/// The part of a comparison's page that says where, when and in which regimes its error arises.
#include <string>

#include "apps/report/page/page.h"
#include "identification/comparison/compare.h"

namespace sparflow {

/// Own against inherited error of each stage, what repeats, errors by regime, worst motions, bad channels; each with a
/// figure or a table. Nothing where the comparison looked for no causes.
void add_causes(Page& page, const CompareResult& result, const std::string& heading_prefix);

}  // namespace sparflow
