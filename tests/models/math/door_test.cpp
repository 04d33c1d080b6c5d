/// Tests of reading at the door: limits, folders, encodings; and of what messages quote.
#include "models/math/door.h"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
namespace fs = std::filesystem;

class Door : public testing::Test {
 protected:
  Door() {
    folder_ = fs::temp_directory_path() / ("sparflow_door_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    set_door_listener([this](const std::string& sentence) { heard_.push_back(sentence); });
  }
  ~Door() override {
    set_door_listener({});
    fs::remove_all(folder_);
  }
  std::string file(const std::string& content) const {
    std::ofstream(folder_ / "file", std::ios::binary) << content;
    return (folder_ / "file").string();
  }
  std::string message(const std::function<void()>& work) const {
    try {
      work();
    } catch (const InputError& e) {
      return e.what();
    }
    return "nothing thrown";
  }
  fs::path folder_;
  std::vector<std::string> heard_;
};

TEST_F(Door, AFileAboveTheLimitIsRefusedAndOneOfTheLimitIsRead) {
  const std::string path = file(std::string(1000, 'x'));
  EXPECT_EQ(read_bytes(path, 1000).size(), 1000U);
  EXPECT_THAT(message([&] { read_bytes(path, 999); }), HasSubstr("larger than"));
}

TEST_F(Door, AnEndlessDeviceIsRefusedAtTheLimit) {
  EXPECT_THAT(message([&] { read_bytes("/dev/zero", 10'000'000); }),
              HasSubstr("larger than 10 MB"));
}

TEST_F(Door, AFolderIsNamedAsOne) {
  EXPECT_THAT(message([&] { read_bytes(folder_.string(), 1000); }), HasSubstr("this is a folder"));
}

TEST_F(Door, ANameThatNoFileCanHaveIsNoFile) {
  EXPECT_TRUE(is_file(file("x")));
  EXPECT_FALSE(is_file(folder_.string()));
  EXPECT_FALSE(is_file(std::string(5000, 'x')));
  EXPECT_FALSE(is_file(file("x") + std::string("\0y", 2)));
}

TEST_F(Door, APipeIsRead) {
  const std::string pipe = (folder_ / "pipe").string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string content(3'000'000, 'y');
  std::jthread writer([&] { std::ofstream(pipe, std::ios::binary) << content; });
  EXPECT_EQ(read_bytes(pipe, 4'000'000), content);
}

TEST_F(Door, LinesThatAreNotUtf8AreReadAsWindows1252AndSaidSo) {
  const std::string text = read_text(file("a: \xC3\xBC\nb: \xFC\xB0 \x80\nc: 1\n"));
  EXPECT_EQ(text, "a: \xC3\xBC\nb: \xC3\xBC\xC2\xB0 \xE2\x82\xAC\nc: 1\n");
  EXPECT_THAT(heard_, ElementsAre(AllOf(HasSubstr("line 2 "), HasSubstr("Windows-1252"))));
}

TEST_F(Door, Utf8IsReadAsItIsWithoutAWord) {
  const std::string content =
      "a: \xC3\xBC \xE2\x82\xAC \xF0\x9F\x98\x80 and enough to fill eight bytes\n";
  EXPECT_EQ(read_text(file(content)), content);
  EXPECT_THAT(heard_, IsEmpty());
}

TEST_F(Door, EveryByteBecomesUtf8AndNoControlCharacterRemains) {
  for (int first = 0; first < 256; ++first) {
    for (int second = 0; second < 256; second += 5) {
      const std::string raw = {static_cast<char>(first), static_cast<char>(second), 'x'};
      for (const std::string& safe : {harmless(raw), printable(raw)}) {
        EXPECT_TRUE(is_utf8(safe)) << first << " " << second;
        for (const char c : safe) {
          EXPECT_TRUE(static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t');
          EXPECT_NE(c, '\x7f');
        }
      }
    }
  }
}

TEST_F(Door, MessagesAreShortAndShowTerminalEscapes) {
  const std::string text = InputError({"f", 1, 0}, "k", std::string(1'600'000, 'x')).what();
  EXPECT_LT(text.size(), QuoteOptions{}.sentence + 10);
  EXPECT_THAT(std::string(InputError({"f\x1b[2J", 1, 0}, "", "m").what()),
              AllOf(HasSubstr("\\x1b[2J"), Not(HasSubstr("\x1b"))));
  // the second byte of this control character alone would be one of Latin-1
  EXPECT_EQ(harmless("\xC2\x9B"), "\\x9b");
  EXPECT_EQ(harmless("a\xE2\x80\xAE"), "a\\u202e");
}

}  // namespace
}  // namespace sparflow
