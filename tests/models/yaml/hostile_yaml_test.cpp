/// Tests of YAML texts that would never end, overflow the stack or fill the memory.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "models/math/door.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string message(const std::string& text) {
  try {
    parse_yaml(text, "f.yaml");
  } catch (const InputError& e) {
    return e.what();
  }
  return "read";
}

TEST(HostileYaml, ASignBehindTheFirstDocumentEnds) {
  for (const char* sign :
       {",", "[a],", "\"a\",\"b\"", "{a: 1},", "a: 1\n,", ", ,", "[],[],", "? ,", "- a\n,",
        "t_s,q\n0,1\n", "\"t_s\",\"q\"\n0,1\n", "---\n,", "--- [a]\n, b", "&a b, c", "!!t ,"}) {
    const std::string said = message(sign);
    EXPECT_TRUE(said.starts_with("f.yaml:") || said == "read") << sign << " -> " << said;
  }
  EXPECT_THAT(message("[a],"), HasSubstr("f.yaml:1:4: this fits no mapping"));
  EXPECT_THAT(message(","), HasSubstr("fits no mapping"));
}

TEST(HostileYaml, AnyShortTextEnds) {
  // all texts of up to five of the signs that mean something to YAML
  const std::string signs = ",[]{}:-?&*!|>'\"#%@a \n";
  std::size_t ended = 0;
  std::vector<std::string> texts = {""};
  for (int length = 1; length <= 3; ++length) {
    std::vector<std::string> longer;
    for (const std::string& text : texts) {
      for (const char c : signs) longer.push_back(text + c);
    }
    for (const std::string& text : longer) {
      message(text);
      ++ended;
    }
    texts = std::move(longer);
  }
  EXPECT_EQ(ended, 21U + 21U * 21U + 21U * 21U * 21U);
}

TEST(HostileYaml, DeepNestingIsRefusedWithItsPlace) {
  const auto deepest = static_cast<std::size_t>(DoorLimits{}.nesting);
  for (const auto& [open, close] : {std::pair<std::string, std::string>{"[", "]"}, {"{a: ", "}"}}) {
    std::string text, end;
    for (std::size_t i = 0; i < deepest; ++i) text += open, end = close + end;
    EXPECT_EQ(message(text + "1" + end), "read");
    EXPECT_THAT(message(open + text + "1" + end + close), HasSubstr("nested more than"));
    for (int i = 0; i < 12; ++i) text += text;  // a hundred thousand
    EXPECT_THAT(message(text), AllOf(HasSubstr("f.yaml:1:"), HasSubstr("nested more than")));
  }
  std::string dashes;
  for (std::size_t i = 0; i < 50'000; ++i) dashes += "- ";
  EXPECT_THAT(message(dashes + "a"), HasSubstr("nested more than"));
}

TEST(HostileYaml, AliasesThatMultiplyOrContainThemselvesAreRefused) {
  std::string bomb = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string last = fmt::format("*a{}", i - 1);
    bomb += fmt::format("a{}: &a{} [", i, i);
    for (int k = 0; k < 10; ++k) bomb += (k == 0 ? "" : ", ") + last;
    bomb += "]\n";
  }
  EXPECT_THAT(message(bomb), HasSubstr("values up to here"));
  EXPECT_THAT(message("a: &a [1, *a]\n"), HasSubstr("inside itself"));
  EXPECT_EQ(message("a: &a [1, 2]\nb: *a\n"), "read");
}

TEST(HostileYaml, ManyKeysAreCheckedForRepetitionInTheirTime) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += fmt::format("k{}: 1\n", i);
  const YamlValue root = parse_yaml(text, "f.yaml");
  EXPECT_EQ(root.map("keys", {}).entries().size(), 100'000U);
}

TEST(HostileYaml, LongValuesAreClippedInMessages) {
  const YamlValue root = parse_yaml("a: \"" + std::string(100'000, 'x') + "\\e[2J\"\n", "f.yaml");
  try {
    root.map("map", {"a"}).need("a", "").number({});
    FAIL() << "nothing thrown";
  } catch (const InputError& e) {
    EXPECT_LT(std::string(e.what()).size(), 500U);
    EXPECT_THAT(e.what(), HasSubstr("expected a number"));
  }
}

}  // namespace
}  // namespace sparflow
