#pragma once
/// Reads a scenario (YAML); every key is described in docs/benchmark.md.
#include <functional>
#include <string>

#include "simulator/benchmark/scenario.h"

namespace sparflow::benchmark {

/// Path of a bundled file ("machines/loader_crane.yaml"); empty or an InputError: there is none.
using FindBundled = std::function<std::string(const std::string& relative_path)>;

/// @throws InputError with file, line, key, what was found, what was expected
Scenario load_scenario(const std::string& path, const FindBundled& bundled);
/// The same from text. @param name of the text in messages @param folder base of relative paths
Scenario parse_scenario(const std::string& text, const std::string& name, const std::string& folder,
                        const FindBundled& bundled);

}  // namespace sparflow::benchmark
