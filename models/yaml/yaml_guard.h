#pragma once
/// Checks a YAML text by its events before any node is built from it.
#include <string>

#include "models/math/error.h"

namespace sparflow {

/// What a YAML text holds, as far as it was read.
struct YamlOutline {
  bool empty = true;  ///< no document, or one without a value
  bool second = false;
  FilePlace second_place;  ///< of the second document
};

/// Reads the events of at most two documents. yaml-cpp ends neither a stream in which `,`, `]`, `}` or the like follow the
/// first document, since it reports an empty document there without consuming the sign, nor an alias to a list that
/// contains it.
/// @throws InputError for a text that is nested too deeply, has too many values (aliases count as what they repeat), or
///   repeats a value inside itself (DoorLimits)
/// @throws YAML::Exception where the text is not valid YAML
YamlOutline yaml_outline(const std::string& text, const std::string& file);

}  // namespace sparflow
