#pragma once
/// Reads CAN traces as text, as `candump` of can-utils writes them: `(1436509052.249713) vcan0 044#2A366C2BBA` with -l, and
/// `(1436509052.249713)  vcan0  044   [5]  2A 36 6C 2B BA` with -ta. Source: can-utils, candump.c and the log format of -l.
#include <string>
#include <string_view>

#include "identification/log/recordings/recording_formats.h"

namespace sparflow {

bool is_candump(std::string_view bytes);
/// @throws InputError with the line of what is no frame, for frames without time stamps, and as CanDecoder
Recording read_candump(std::string_view bytes, const std::string& file,
                       const RecordingOptions& options);

}  // namespace sparflow
