#pragma once
/// What logs could reveal, as a page: power of every effect, what would be confused, what is missing from the logs.
#include "apps/report/page/page.h"
#include "diagnosis/selftest/selftest.h"
#include "models/chain/crane_model.h"

namespace sparflow {

Page selftest_page(const CraneModel& model, const Selftest& result);

}  // namespace sparflow
