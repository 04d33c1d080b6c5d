#include "tests/parsed_json.h"

namespace sparflow::test_support {

nlohmann::json parsed_json(const std::string& text) { return nlohmann::json::parse(text); }

}  // namespace sparflow::test_support
