#pragma once
/// What logs told about a machine: values with intervals, questions, errors on motions held out.
#include "apps/report/page/page.h"
#include "identification/machine_from_log/machine_from_log.h"

namespace sparflow {

Page machine_from_log_page(const MachineFromLog& found);

}  // namespace sparflow
