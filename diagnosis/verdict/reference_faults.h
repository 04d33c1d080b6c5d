#pragma once
/// References that are further from the model than the log which is compared with them: what differs is then the reference.
#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// Channels in which the references differ more from the model than the suspect logs do, beyond chance and by
/// VerdictOptions::least_excess_ratio, before any effect is searched for; the largest ratio first. By the test that a residual of the
/// suspect logs must pass to exceed that of the references (residual_levels.h), with the groups exchanged.
/// @return none without references
std::vector<ReferenceFault> reference_faults(const CraneModel& model,
                                             const DiagnosisSignals& signals,
                                             const DiagnoseOptions& options);

}  // namespace sparflow
