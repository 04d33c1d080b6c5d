#pragma once
/// The part of a comparison's page that shows at which stage, when and in which regimes the error arises.
#include <string>

#include "apps/report/page/page.h"
#include "identification/comparison/compare.h"

namespace sparflow {

/// Appends a table of the faulty channels; nothing where there are none.
void add_bad_data(Page& page, const CompareResult& result);

/// Appends, each as a figure or a table: own and inherited error of each stage, systematic errors, errors by regime,
/// worst motions, bad channels. Appends nothing when the comparison was made without a search for causes.
void add_causes(Page& page, const Machine& machine, const CompareResult& result,
                const std::string& heading_prefix);

}  // namespace sparflow
