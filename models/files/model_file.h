#pragma once
/// A fitted model as one JSON file: the machine's own YAML text, every pressure model with all its numbers, margins,
/// standby, valve gains, the logs it was learned from and its quality. The keys are described in
/// docs/model_file.md. Numbers are written as the shortest text that reads back to the same double, so
/// that save and load lose nothing.
#include <string>

#include "models/chain/crane_model.h"

namespace sparflow {

/// Version of the file's layout that this program writes, and the newest it reads.
// no threshold: number of a version
inline constexpr int kModelFileVersion = 1;

/// "0.1.0"
const char* program_version();

/// The model as the text of a model file. Deterministic: no date, no host, no path.
std::string model_to_json(const CraneModel& model);

/// @param file name of the text in messages
/// @throws InputError with file (line:column where it stops being JSON), key path, what was found and what
///   was expected; also for a layout newer than this program and for physical effects it does not know
CraneModel model_from_json(const std::string& text, const std::string& file);

/// @throws InputError when the file cannot be written
void save_model(const CraneModel& model, const std::string& path);

/// @throws InputError as model_from_json, and when the file cannot be read
CraneModel load_model(const std::string& path);

}  // namespace sparflow
