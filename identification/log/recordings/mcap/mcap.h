#pragma once
/// Reads bags in the container format MCAP: messages of ROS 2 (encoding `cdr`, described by `ros2msg`) and JSON.
/// docs/recordings.md says what is read.
#include <string>
#include <string_view>

#include "identification/log/recordings/recording_formats.h"

namespace sparflow {

/// @return one channel for each number in the messages of a topic
/// @throws InputError with the byte and the record of what is damaged, and where no channel is left
Recording read_mcap(std::string_view bytes, const std::string& file,
                    const RecordingOptions& options);

}  // namespace sparflow
