/// Tests of the one way to write a file.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "models/math/error.h"

namespace sparflow {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

class WriteFile : public testing::Test {
 protected:
  WriteFile() {
    folder_ = fs::temp_directory_path() / ("sparflow_write_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  ~WriteFile() override { fs::remove_all(folder_); }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  static std::string content(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  static unsigned mode(const std::string& path) {
    struct stat about {};
    EXPECT_EQ(::stat(path.c_str(), &about), 0);
    return about.st_mode & 07777U;
  }
  std::size_t entries() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  fs::path folder_;
};

TEST_F(WriteFile, ANewFileHasTheUsualModeAndNothingElseIsLeft) {
  const mode_t mask = ::umask(022);
  write_file_atomically(at("a"), "one");
  ::umask(mask);
  EXPECT_EQ(content(at("a")), "one");
  EXPECT_EQ(mode(at("a")), 0644U);
  EXPECT_EQ(entries(), 1U);
}

TEST_F(WriteFile, TheModeOfAReplacedFileIsKept) {
  std::ofstream(at("a")) << "before";
  ::chmod(at("a").c_str(), 0600);
  write_file_atomically(at("a"), "after");
  EXPECT_EQ(content(at("a")), "after");
  EXPECT_EQ(mode(at("a")), 0600U);
}

TEST_F(WriteFile, ALinkStaysAndItsTargetIsWritten) {
  fs::create_directories(folder_ / "deep");
  std::ofstream(at("deep/target")) << "before";
  fs::create_symlink("deep/target", at("link"));
  fs::create_symlink("link", at("second"));
  write_file_atomically(at("second"), "after");
  EXPECT_TRUE(fs::is_symlink(at("second")));
  EXPECT_TRUE(fs::is_symlink(at("link")));
  EXPECT_EQ(content(at("deep/target")), "after");
}

TEST_F(WriteFile, ALinkToNothingMakesItsTarget) {
  fs::create_symlink("missing", at("link"));
  write_file_atomically(at("link"), "text");
  EXPECT_TRUE(fs::is_symlink(at("link")));
  EXPECT_EQ(content(at("missing")), "text");
}

TEST_F(WriteFile, LinksInACircleAreAnError) {
  fs::create_symlink("b", at("a"));
  fs::create_symlink("a", at("b"));
  EXPECT_THROW(write_file_atomically(at("a"), "text"), InputError);
}

TEST_F(WriteFile, AFifoIsWrittenThrough) {
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  std::string read;
  {
    std::jthread reader([&] { read = content(at("pipe")); });
    write_file_atomically(at("pipe"), "through");
  }
  EXPECT_EQ(read, "through");
  EXPECT_TRUE(fs::is_fifo(at("pipe")));
}

TEST_F(WriteFile, AFullDeviceIsAnErrorAndStaysADevice) {
  try {
    write_file_atomically("/dev/full", "text");
    FAIL() << "nothing thrown";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("No space left"));
  }
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  write_file_atomically("/dev/null", "text");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(WriteFile, WhatWasThereStaysWhereWritingFails) {
  std::ofstream(at("a")) << "before";
  // a limit on the size of files stands for a full disk; the signal that comes with it is ignored by the program
  const std::string big(1 << 20, 'x');
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const struct rlimit small = {1000, 1000};
    ::setrlimit(RLIMIT_FSIZE, &small);
    try {
      write_file_atomically(at("a"), big);
    } catch (const InputError&) {
      ::_exit(3);
    }
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 3);
  EXPECT_EQ(content(at("a")), "before");
  EXPECT_EQ(entries(), 1U);
}

TEST_F(WriteFile, AProcessThatIsKilledWhileItWritesLeavesNothingBehind) {
  const int unnamed = ::open(folder_.c_str(), O_TMPFILE | O_WRONLY, 0600);
  if (unnamed < 0) GTEST_SKIP() << "this file system knows no file without a name";
  ::close(unnamed);
  std::ofstream(at("a")) << "before";
  const std::string big(1 << 20, 'x');
  for (const char* name : {"a", "new"}) {
    const pid_t child = ::fork();
    if (child == 0) {
      // The signal of a file that grows beyond the limit kills in the middle of the first call that writes it.
      const struct rlimit none = {0, 0}, small = {1000, 1000};
      ::setrlimit(RLIMIT_CORE, &none);
      ::setrlimit(RLIMIT_FSIZE, &small);
      ::signal(SIGXFSZ, SIG_DFL);
      write_file_atomically(at(name), big);
      ::_exit(0);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(WTERMSIG(status), SIGXFSZ);
    EXPECT_EQ(content(at("a")), "before");
    EXPECT_EQ(entries(), 1U) << name;
  }
}

TEST_F(WriteFile, ATemporaryNameThatSomebodyPreparedIsNotFollowed) {
  // names that could be predicted, from the process' number; each leads elsewhere
  std::ofstream(at("elsewhere")) << "mine";
  for (const std::string& name : {"a." + std::to_string(::getpid()) + ".tmp", std::string("a.tmp")})
    fs::create_symlink("elsewhere", at(name));
  write_file_atomically(at("a"), "text");
  EXPECT_EQ(content(at("elsewhere")), "mine");
  EXPECT_EQ(content(at("a")), "text");
}

}  // namespace
}  // namespace sparflow
