/// Tests of the journal of finished parts.
#include "models/math/journal.h"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "models/math/error.h"

namespace sparflow {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

const std::string kBinary("a\0b\n\xff\"", 6);

class JournalFile : public testing::Test {
 protected:
  JournalFile()
      : path_((fs::temp_directory_path() / ("sparflow_journal_" + std::to_string(::getpid())))
                  .string()) {
    fs::remove(path_);
  }
  ~JournalFile() override { fs::remove(path_); }
  void two_parts() const {
    Journal journal(path_, "run", false);
    journal.add("one", "1");
    journal.add("two", kBinary);
  }
  std::string text() const {
    std::ifstream in(path_, std::ios::binary);
    std::ostringstream all;
    all << in.rdbuf();
    return all.str();
  }
  void write(const std::string& content) const {
    std::ofstream(path_, std::ios::binary) << content;
  }
  /// What a journal of another content says, or "".
  std::string error_of(const std::string& run, bool resume) const {
    try {
      Journal journal(path_, run, resume);
      journal.add("x", "y");
      return "";
    } catch (const InputError& e) {
      return e.what();
    }
  }
  std::string path_;
};

TEST_F(JournalFile, FinishedPartsAreReadAgainByteByByte) {
  two_parts();
  const Journal journal(path_, "run", true);
  EXPECT_TRUE(journal.warnings().empty());
  EXPECT_EQ(journal.finished(), 2U);
  ASSERT_NE(journal.find("two"), nullptr);
  EXPECT_EQ(*journal.find("two"), kBinary);
  EXPECT_EQ(journal.find("three"), nullptr);
}

TEST_F(JournalFile, WithoutResumeItStaysUntilAPartIsFinishedAndBeginsAnewThen) {
  two_parts();
  {
    Journal anew(path_, "other", false);
    EXPECT_EQ(anew.finished(), 0U);
    EXPECT_THAT(text(), HasSubstr("\"two\""));
    anew.add("three", "3");
  }
  EXPECT_EQ(text().find("\"two\""), std::string::npos);
  EXPECT_EQ(Journal(path_, "other", true).finished(), 1U);
}

TEST_F(JournalFile, OneOfOtherInputsIsRefusedAndStays) {
  two_parts();
  const std::string before = text();
  EXPECT_THAT(error_of("other", true), HasSubstr("other inputs or options"));
  EXPECT_EQ(text(), before);
}

TEST_F(JournalFile, ATornLastLineIsIgnoredWithASentenceAndDoesNotSpoilTheNext) {
  two_parts();
  const std::string whole = text();
  // Torn anywhere in the last line, also just before its end.
  for (const std::size_t cut : {std::size_t{1}, std::size_t{40}}) {
    write(whole.substr(0, whole.size() - cut));
    {
      Journal journal(path_, "run", true);
      ASSERT_EQ(journal.warnings().size(), 1U);
      EXPECT_THAT(journal.warnings()[0], HasSubstr(":3: the last line was not written"));
      EXPECT_EQ(journal.finished(), 1U);
      journal.add("two", kBinary);
    }
    EXPECT_EQ(text(), whole);
  }
}

TEST_F(JournalFile, ATornFirstLineIsAnEmptyJournal) {
  two_parts();
  write(text().substr(0, 15));
  EXPECT_EQ(error_of("run", true), "");
  EXPECT_EQ(Journal(path_, "run", true).finished(), 1U);
}

TEST_F(JournalFile, ADamagedLineCostsItsPartOnly) {
  two_parts();
  std::string damaged = text();
  // the content of part "one" is 31; another digit makes it another valid text
  damaged[damaged.find("\"hex\":\"31\"") + 8] = '2';
  write(damaged);
  const Journal journal(path_, "run", true);
  ASSERT_EQ(journal.warnings().size(), 1U);
  EXPECT_THAT(journal.warnings()[0], HasSubstr(":2: the line is damaged"));
  EXPECT_EQ(journal.find("one"), nullptr);
  EXPECT_NE(journal.find("two"), nullptr);
}

TEST_F(JournalFile, AFileThatIsNoJournalIsNeitherReadNorReplaced) {
  write("my notes\n");
  EXPECT_THAT(error_of("run", true), HasSubstr("no journal"));
  EXPECT_THAT(error_of("run", false), HasSubstr("not replaced"));
  EXPECT_EQ(text(), "my notes\n");
}

TEST_F(JournalFile, TwoRunsDoNotWriteTheSameJournal) {
  Journal first(path_, "run", false);
  first.add("one", "1");
  EXPECT_THAT(error_of("run", false), HasSubstr("another run"));
  EXPECT_THAT(error_of("run", true), HasSubstr("another run"));
}

TEST_F(JournalFile, AFullDiskLeavesWholeLines) {
  two_parts();
  const std::string before = text();
  // a limit on the size of files stands for a full disk; the signal that comes with it is ignored by the program
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const struct rlimit small = {before.size() + 100, before.size() + 100};
    ::setrlimit(RLIMIT_FSIZE, &small);
    bool refused = false;
    try {
      Journal journal(path_, "run", true);
      journal.add("three", std::string(1000, 'x'));
    } catch (const InputError&) {
      refused = true;
    }
    ::_exit(refused ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(text(), before);
}

TEST_F(JournalFile, KeptComputesWhatIsMissingAndKeepsWhatIsComplete) {
  {
    Journal journal(path_, "run", false);
    EXPECT_EQ(journal.kept("one", [] { return Journal::Part{"1", true}; }), "1");
    EXPECT_EQ(journal.kept("two", [] { return Journal::Part{"half", false}; }), "half");
  }
  Journal journal(path_, "run", true);
  EXPECT_EQ(journal.kept("one", [] { return Journal::Part{"other", true}; }), "1");
  EXPECT_EQ(journal.kept("two", [] { return Journal::Part{kBinary, true}; }), kBinary);
}

TEST_F(JournalFile, TroubleWithWritingIsToldAndEndsNoWork) {
  Journal journal("/nonexistent/journal", "run", false);
  std::string told;
  journal.on_trouble([&](const std::string& sentence) { told = sentence; });
  EXPECT_EQ(journal.kept("one", [] { return Journal::Part{"1", true}; }), "1");
  EXPECT_THAT(told, HasSubstr("the journal cannot be written"));
}

TEST_F(JournalFile, AFingerprintChangesWithNamesContentsAndOptions) {
  write("a");
  const std::string first = run_fingerprint({path_}, "x");
  EXPECT_EQ(run_fingerprint({path_}, "x"), first);
  EXPECT_NE(run_fingerprint({path_}, "y"), first);
  EXPECT_NE(run_fingerprint({}, "x"), first);
  write("b");
  EXPECT_NE(run_fingerprint({path_}, "x"), first);
  EXPECT_THROW(run_fingerprint({"/nonexistent"}, "x"), InputError);
}

TEST_F(JournalFile, ACompleteRunDeletesIt) {
  two_parts();
  Journal journal(path_, "run", true);
  journal.remove();
  EXPECT_FALSE(fs::exists(path_));
}

}  // namespace
}  // namespace sparflow
