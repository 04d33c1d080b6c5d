#pragma once
/// Evidence of some of the motions alone, for estimates and errors of a cross-validation.
#include <vector>

#include "diagnosis/evidence/evidence.h"

namespace sparflow {

/// The channel without the rows in the masks; a block that loses rows in its middle becomes two.
/// @param leave_out [logs] masks of samples, suspect logs first; logs beyond the list keep all rows
EvidenceChannel without_rows(const EvidenceChannel& all, const std::vector<Mask>& leave_out);

}  // namespace sparflow
