#pragma once
/// nlohmann's parser is a template of a second and more of compile time: the tests' one instance of it.
#include <nlohmann/json.hpp>
#include <string>

namespace sparflow::test_support {

/// @throws nlohmann::json::parse_error
nlohmann::json parsed_json(const std::string& text);

}  // namespace sparflow::test_support
