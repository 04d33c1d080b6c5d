#pragma once
/// Hash of a file's bytes, by which a fitted model records the logs that it was learned from.
#include <string>
#include <string_view>

namespace sparflow {

/// SHA-256 of `bytes` as 64 lower-case hexadecimal digits. Source: FIPS 180-4, section 6.2.
std::string sha256_hex(std::string_view bytes);

}  // namespace sparflow
