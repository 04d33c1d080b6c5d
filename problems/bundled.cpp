#include "problems/bundled.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "models/math/door.h"
#include "models/math/error.h"

// Set by the build: the `problems` folder of the source tree, and where `cmake --install` puts its copy.
#ifndef SPARFLOW_SOURCE_DATA
#define SPARFLOW_SOURCE_DATA ""
#define SPARFLOW_INSTALLED_DATA ""
#endif

namespace sparflow {
namespace fs = std::filesystem;

std::string data_folder() {
  if (const char* set = std::getenv("SPARFLOW_DATA"); set != nullptr && *set != '\0') {
    if (fs::is_directory(set)) return set;
    throw InputError({set, 0, 0}, "",
                     "SPARFLOW_DATA names no folder; expected the one that holds machines/ and "
                     "reaches/");
  }
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path installed = program.parent_path().parent_path() / "share" / "sparflow";
  if (!program.empty() && fs::is_directory(installed / "machines", ignored)) {
    return installed.string();
  }
  for (const char* built_in : {SPARFLOW_SOURCE_DATA, SPARFLOW_INSTALLED_DATA}) {
    const fs::path folder = built_in;
    if (!folder.empty() && fs::is_directory(folder / "machines", ignored)) return folder.string();
  }
  throw InputError(
      {installed.string(), 0, 0}, "",
      "the bundled machines and problems are not here; set SPARFLOW_DATA to the folder "
      "that holds machines/ and reaches/");
}

std::string bundled_file(const std::string& relative_path) {
  const fs::path path = fs::path(data_folder()) / relative_path;
  if (!is_file(path)) {
    throw InputError({path.string(), 0, 0}, "", "there is no such bundled file");
  }
  return path.string();
}

std::vector<std::string> bundled_files(const std::string& folder, const std::string& extension) {
  const fs::path path = fs::path(data_folder()) / folder;
  std::vector<std::string> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(path, ignored)) {
    if (entry.is_regular_file() && entry.path().extension() == extension) {
      files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace sparflow
