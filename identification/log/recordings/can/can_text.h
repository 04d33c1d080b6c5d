#pragma once
/// Reads CAN traces as text: `candump -l` of can-utils, e.g. `(1436509052.249713) vcan0 044#2A366C2BBA`.
#include <string>
#include <string_view>

#include "identification/log/recordings/recording_formats.h"

namespace sparflow {

bool is_candump(std::string_view bytes);
/// @throws InputError with the line of what is no frame, and as CanDecoder
Recording read_candump(std::string_view bytes, const std::string& file,
                       const RecordingOptions& options);

}  // namespace sparflow
