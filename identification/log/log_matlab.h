#pragma once
/// Logs saved by MATLAB (`save`, v4 to v7.3) through matio.
#include <string>
#include <string_view>

#include "identification/log/log_table.h"

namespace sparflow {

/// True for the first bytes of a .mat file of v5 or v7.3 (v4 has no mark: go by the name).
bool is_matlab(std::string_view bytes, const std::string& path);

/// Reads one of: numeric vectors of one length, named as columns; one struct with such fields; one matrix
/// with a column a signal beside `names` (cell of char, or char matrix). A scalar stands for a constant column.
/// @throws InputError when the variables have no such shape
RawTable read_matlab(const std::string& path);

}  // namespace sparflow
