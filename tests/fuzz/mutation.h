#pragma once
/// Files of a corpus and seeded changes of them.
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/targets.h"

namespace sparflow::fuzz {

using Random = std::mt19937_64;

/// One file of a corpus.
struct Sample {
  std::string name;  ///< without folders
  std::string bytes;
};

/// Findings of the past and bundled files that a reader takes, in the order of their names.
std::vector<Sample> corpus_of(const Target& target);

/// @return a number from 0 to n - 1; 0 where n is 0
std::size_t below(Random& random, std::size_t n);

/// One to eight changes of bytes, stretches, words and binary numbers of a file drawn from the corpus, which is not empty.
std::string changed(const std::vector<Sample>& corpus, Random& random);

/// One to three changes of bytes, bits and binary numbers that leave everything where it stands, so that links and lengths of
/// binary files still lead somewhere.
std::string changed_in_place(const std::vector<Sample>& corpus, Random& random);

}  // namespace sparflow::fuzz
