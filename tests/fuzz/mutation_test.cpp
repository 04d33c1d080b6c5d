/// Calls every reader with its corpus, the bundled files and seeded changes of them. It looks less far than libFuzzer
/// (`./run fuzz`), needs no other compiler, and sees a crash, an endless loop, and an exception that is no refusal.
#include "tests/fuzz/mutation.h"

#include <gtest/gtest.h>

#include <chrono>

namespace sparflow::fuzz {
namespace {

class EveryReader : public testing::TestWithParam<Target> {};

TEST_P(EveryReader, AnswersWhateverItGets) {
  const std::vector<Sample> corpus = corpus_of(GetParam());
  ASSERT_FALSE(corpus.empty());
  for (const Sample& sample : corpus) GetParam().read(sample.bytes);
  Random random(1);
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(1500);
  std::size_t tried = 0;
  // a number of tries that every machine reaches, and more where there is time
  while (tried < 200 || std::chrono::steady_clock::now() < end) {
    const std::string text = changed(corpus, random);
    try {
      GetParam().read(text);
    } catch (const std::exception& e) {
      FAIL() << "try " << tried << ": " << e.what() << "\n" << text.substr(0, 2000);
    }
    ++tried;
  }
  RecordProperty("tries", static_cast<int>(tried));
}

std::string target_name(const testing::TestParamInfo<Target>& target) { return target.param.name; }
INSTANTIATE_TEST_SUITE_P(Readers, EveryReader, testing::ValuesIn(targets()), target_name);

}  // namespace
}  // namespace sparflow::fuzz
