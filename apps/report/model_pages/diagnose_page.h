#pragma once
/// The page of diagnose: verdict, effects with their evidence, unexplained residuals.
#include "apps/report/page/page.h"
#include "diagnosis/extension/extend.h"

namespace sparflow {

/// @param diagnosis made of `model`
/// @param tested result of adding the effects found to the model, judged on test logs; may be null
Page diagnose_page(const CraneModel& model, const Diagnosis& diagnosis,
                   const ExtendResult* tested = nullptr);

}  // namespace sparflow
