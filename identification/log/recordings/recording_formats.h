#pragma once
/// Reads a file whose channels have clocks of their own, whatever its format: it is recognised by its content.
#include <string>
#include <string_view>
#include <vector>

#include "identification/log/recordings/recording.h"
#include "models/math/door.h"

namespace sparflow {

struct RecordingOptions {
  /// Databases (.dbc) that decode raw CAN frames. Where two of them describe one identifier, the first is taken.
  std::vector<std::string> dbc_files;
  DoorLimits limits;
};

/// A format that is read; the table of them stands in the .cpp file, one line each.
struct RecordingFormat {
  const char* name;
  bool (*recognises)(std::string_view bytes);  ///< by the first bytes or lines of the file
  /// @throws InputError, with the byte or line of what is wrong
  Recording (*read)(std::string_view bytes, const std::string& file,
                    const RecordingOptions& options);
};
const std::vector<RecordingFormat>& recording_formats();

/// @return whether a format recognises the first bytes of a file
bool is_recording(std::string_view bytes);

/// @param bytes the whole file  @param file its name, for messages
/// @return channels with unique names: where a name occurs more than once, its group precedes it
/// @throws InputError where no format recognises the file, and as its reader
Recording read_recording(std::string_view bytes, const std::string& file,
                         const RecordingOptions& options = {});

}  // namespace sparflow
