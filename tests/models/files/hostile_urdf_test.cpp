/// Tests of robot descriptions that would overflow the stack or never end.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "models/files/urdf_import.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
namespace fs = std::filesystem;

class HostileUrdf : public testing::Test {
 protected:
  HostileUrdf()
      : path_((fs::temp_directory_path() / ("sparflow_urdf_" + std::to_string(::getpid())))
                  .string()) {}
  ~HostileUrdf() override { fs::remove(path_); }
  /// The message without the file's name, "read" when there is none.
  std::string message(const std::string& text, const std::string& tip = "") const {
    std::ofstream(path_, std::ios::binary) << text;
    try {
      import_urdf(path_, tip, {}, {});
    } catch (const InputError& e) {
      const std::string what = e.what();
      return what.starts_with(path_) ? what.substr(path_.size()) : what;
    }
    return "read";
  }
  static std::string link(const std::string& name) { return "<link name=\"" + name + "\"/>\n"; }
  static std::string fixed(const std::string& name, const std::string& parent,
                           const std::string& child) {
    return "<joint name=\"" + name + "\" type=\"fixed\"><parent link=\"" + parent +
           "\"/><child link=\"" + child + "\"/></joint>\n";
  }
  std::string path_;
};

TEST_F(HostileUrdf, FiftyThousandNestedLinksAreRefusedWithTheirLine) {
  std::string text = "<robot name=\"r\">\n";
  for (int i = 0; i < 50'000; ++i) text += "<link>";
  EXPECT_THAT(message(text), StartsWith(":2: not readable as URDF: elements nested more than"));
}

TEST_F(HostileUrdf, ACircleBesideTheRootIsNamed) {
  const std::string text = "<robot name=\"r\">\n" + link("base") + link("a") + link("b") +
                           fixed("ab", "a", "b") + fixed("ba", "b", "a") + "</robot>\n";
  EXPECT_THAT(message(text, "a"),
              HasSubstr(":3: link[a]: not reached from the root link \"base\""));
  EXPECT_THAT(message(text, "base"), HasSubstr("circle"));
}

TEST_F(HostileUrdf, TwoJointsToOneLinkAreNamed) {
  const std::string text = "<robot name=\"r\">\n" + link("base") + link("a") +
                           fixed("one", "base", "a") + fixed("two", "base", "a") + "</robot>\n";
  EXPECT_THAT(message(text), HasSubstr("joint[two]: leads to link \"a\", as joint \"one\" does"));
}

TEST_F(HostileUrdf, TooManyLinksAreRefused) {
  std::string text = "<robot name=\"r\">\n" + link("l0");
  for (int i = 1; i < 5000; ++i) {
    text += link("l" + std::to_string(i)) +
            fixed("j" + std::to_string(i), "l" + std::to_string(i - 1), "l" + std::to_string(i));
  }
  EXPECT_THAT(message(text + "</robot>\n"), HasSubstr("more than 256 links"));
}

TEST_F(HostileUrdf, ErrorsOfXmlHaveALine) {
  EXPECT_THAT(message("<robot name=\"r\">\n<link name=\"a\">\n</robot>\n"),
              StartsWith(":3: not readable as URDF: </robot> where <link> of line 2"));
  EXPECT_THAT(message("<robot name=\"r\">\n<link name=\"a\"/>\n"), StartsWith(":1: not readable"));
  EXPECT_THAT(message("<robot name=\"r\">\n<link name=\"a/>\n</robot>"), StartsWith(":2: "));
  EXPECT_THAT(message("<robot name=\"r\">\n<!-- open\n</robot>"), StartsWith(":2: "));
  EXPECT_THAT(message("no xml\n"), HasSubstr("no XML element"));
  EXPECT_THAT(message("<robot>\n</robot>\n<robot/>"), StartsWith(":3: "));
  EXPECT_THAT(message("<!DOCTYPE a [<!ENTITY b \"c\">]>\n<robot/>"), HasSubstr("document type"));
}

TEST_F(HostileUrdf, EveryCutOfAFileGivesASentence) {
  const std::string text =
      "<robot name=\"r\">\n" + link("base") + link("a") + fixed("f", "base", "a") + "</robot>\n";
  for (std::size_t n = 0; n + 2 < text.size(); ++n)
    EXPECT_NE(message(text.substr(0, n)), "read") << n;
}

}  // namespace
}  // namespace sparflow
