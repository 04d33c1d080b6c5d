#pragma once
/// Reads CAN traces in Vector's ASC text, classic and FD frames, e.g. `  2.501000 1  123  Rx  d 2 28 0A`.
/// Source: Vector Informatik, "CAN/CANFD/XLDE ASC logging files format specification" (CANalyzer help).
#include <string>
#include <string_view>

#include "identification/log/recordings/recording_formats.h"

namespace sparflow {

/// @return whether the first lines have a line `base hex` or `base dec` with `timestamps`
bool is_asc(std::string_view bytes);
/// Lines that are no data frames (events, errors, remote frames, statistics) are counted and left out.
/// @throws InputError with the line where a frame is damaged or time goes back, and as CanDecoder
Recording read_asc(std::string_view bytes, const std::string& file,
                   const RecordingOptions& options);

}  // namespace sparflow
