#pragma once
/// The page of selftest: power of every effect, indistinguishable sets, effects that the logs cannot reveal.
#include "apps/report/page/page.h"
#include "diagnosis/selftest/selftest.h"
#include "models/chain/crane_model.h"

namespace sparflow {

Page selftest_page(const CraneModel& model, const Selftest& result);

}  // namespace sparflow
