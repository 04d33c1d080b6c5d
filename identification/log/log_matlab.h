#pragma once
/// Reads logs saved by MATLAB (`save`): v4 to v7 by mat_file.h, v7.3 with the library matio.
#include <string>
#include <string_view>

#include "identification/log/log_table.h"
#include "models/math/door.h"

namespace sparflow {

/// @return true for the first bytes of a .mat file of v5 or v7.3; v4 has no signature and is recognised by its name
bool is_matlab(std::string_view bytes, const std::string& path);

/// Reads one of: numeric vectors of equal length, named as columns; one struct with such fields; one matrix with a
/// signal in each column beside `names` (cell of char, or char matrix). A scalar gives a constant column.
/// @param bytes the file's content; matio reads v7.3 from `path` again
/// @throws InputError when the file was cut or is damaged, and when the variables have another shape
RawTable read_matlab(const std::string& path, std::string_view bytes, const DoorLimits& limits);

}  // namespace sparflow
