#pragma once
/// A hash of text that is the same with every compiler and library, unlike std::hash: cases drawn from it can be drawn
/// again anywhere. Source: A. Appleby, MurmurHash2 (64 bit, public domain); with this seed g++'s std::hash gives the same.
#include <cstdint>
#include <string_view>

namespace sparflow::bench {

/// @param text hashed byte by byte, in little-endian words of eight
constexpr std::uint64_t stable_hash(std::string_view text) {
  constexpr std::uint64_t kSeed = 0xc70f6907, kFactor = 0xc6a4a7935bd1e995;
  constexpr int kShift = 47;
  const auto word = [&](std::size_t from, std::size_t bytes) {
    std::uint64_t w = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      w |= static_cast<std::uint64_t>(static_cast<unsigned char>(text[from + i])) << (8 * i);
    }
    return w;
  };
  std::uint64_t hash = kSeed ^ (text.size() * kFactor);
  const std::size_t whole = text.size() / 8 * 8;
  for (std::size_t at = 0; at < whole; at += 8) {
    std::uint64_t w = word(at, 8) * kFactor;
    w = (w ^ (w >> kShift)) * kFactor;
    hash = (hash ^ w) * kFactor;
  }
  if (whole < text.size()) hash = (hash ^ word(whole, text.size() - whole)) * kFactor;
  hash = (hash ^ (hash >> kShift)) * kFactor;
  return hash ^ (hash >> kShift);
}

}  // namespace sparflow::bench
