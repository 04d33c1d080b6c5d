#pragma once
/// Reads measurement files of the ASAM standard MDF, versions 4.00 to 4.20. docs/recordings.md says what is read.
#include <string>
#include <string_view>

#include "identification/log/recordings/recording_formats.h"

namespace sparflow {

/// @return one channel for each numeric channel of a group with a master of time
/// @throws InputError with the byte and the block of what is damaged, and where no channel is left
Recording read_mdf(std::string_view bytes, const std::string& file,
                   const RecordingOptions& options);

}  // namespace sparflow
