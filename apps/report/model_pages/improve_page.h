#pragma once
/// The page of extend and improve.
#include "apps/report/page/page.h"
#include "diagnosis/extension/extend.h"

namespace sparflow {

/// Appends the steps: errors after each step beside the sensors' noise, parameters, curves before and after.
/// @param heading_prefix put before each section's heading, e.g. "Test logs: "
void add_steps(Page& page, const ExtendResult& result, const std::string& heading_prefix = "");

/// Makes the page of `extend` or `improve`.
Page improve_page(const ExtendResult& result);

}  // namespace sparflow
