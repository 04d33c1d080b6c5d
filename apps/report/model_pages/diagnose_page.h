#pragma once
/// A diagnosis as a page: verdict, effects with their proofs, what is left.
#include "apps/report/page/page.h"
#include "diagnosis/extension/extend.h"

namespace sparflow {

/// @param diagnosis must have been made of `model`, which must still live
/// @param tested the effects found, added to the model and judged on test logs; may be null
Page diagnose_page(const CraneModel& model, const Diagnosis& diagnosis,
                   const ExtendResult* tested = nullptr);

}  // namespace sparflow
