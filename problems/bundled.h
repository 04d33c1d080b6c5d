#pragma once
/// The machines, problems and logs that come with the program.
#include <string>
#include <vector>

namespace sparflow {

/// Folder that holds `machines/`, `reaches/` and `logs/`: $SPARFLOW_DATA if set, else
/// `PREFIX/share/sparflow` of the running program, else the source tree it was built from, else the
/// prefix it was configured for.
/// @throws InputError when none of them exists
std::string data_folder();

/// Full path of a bundled file, e.g. "machines/loader_crane.yaml". @throws InputError when there is none
std::string bundled_file(const std::string& relative_path);

/// Full paths of all files with this extension (".yaml") in a bundled folder, sorted by name.
std::vector<std::string> bundled_files(const std::string& folder, const std::string& extension);

}  // namespace sparflow
