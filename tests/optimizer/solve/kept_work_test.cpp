// Parts of a long run that stand in a journal, and parts that are ended early.
#include "optimizer/solve/kept_work.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <utility>

#include "optimizer/solve/child_progress.h"

namespace sparflow {
namespace {

namespace fs = std::filesystem;

class KeptWorkTest : public testing::Test {
 protected:
  KeptWorkTest() {
    path_ = fs::temp_directory_path() / ("sparflow_kept_work_" + std::to_string(::getpid()));
    fs::remove(path_);
    work_.count = 4;
    work_.name = [](int i) { return "part " + std::to_string(i); };
    work_.work = [this](int i) {
      computed_.push_back(i);
      return "result " + std::to_string(i);
    };
  }
  ~KeptWorkTest() override { fs::remove(path_); }

  fs::path path_;
  KeptWork work_;
  std::vector<int> computed_;  // in this process
};

TEST_F(KeptWorkTest, WhatTheJournalHasIsNotComputedAgain) {
  {
    Journal journal(path_, "run", false);
    journal.add("part 1", "result 1");
    journal.add("part 3", "result 3");
  }
  Journal journal(path_, "run", true);
  EXPECT_EQ(finished_before(work_, journal), 2);
  std::vector<std::pair<int, int>> told;
  const std::vector<ChildResult> results =
      run_kept(work_, journal, [&](int i, int finished, const ChildResult& r) {
        EXPECT_TRUE(r.ok);
        told.emplace_back(i, finished);
      });
  ASSERT_EQ(results.size(), 4U);
  for (int i = 0; i < 4; ++i)
    EXPECT_EQ(results[static_cast<std::size_t>(i)].bytes, "result " + std::to_string(i));
  EXPECT_THAT(computed_, testing::ElementsAre(0, 2));
  EXPECT_THAT(told, testing::ElementsAre(std::pair(1, 1), std::pair(3, 2), std::pair(0, 3),
                                         std::pair(2, 4)));
}

TEST_F(KeptWorkTest, EachPartIsInTheJournalForTheNextRunUnlessItIsNotComplete) {
  work_.complete = [](const std::string& bytes) { return bytes != "result 2"; };
  {
    Journal journal(path_, "run", false);
    run_kept(work_, journal);
  }
  const Journal again(path_, "run", true);
  EXPECT_EQ(again.finished(), 3U);
  EXPECT_EQ(again.find("part 2"), nullptr);
}

TEST_F(KeptWorkTest, PartsThatDoNotAnswerAreEndedAndTheOthersKept) {
  work_.work = [](int i) {
    if (i > 0) ::sleep(60);
    return std::string("soon");
  };
  const auto begin = std::chrono::steady_clock::now();
  const auto passed = [begin] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  bool first = false;
  work_.stop = [&] { return first; };
  work_.patience_s = 0.1;
  Journal journal(path_, "run", false);
  const std::vector<ChildResult> results =
      run_kept(work_, journal, [&](int i, int, const ChildResult&) { first = first || i == 0; });
  EXPECT_TRUE(results[0].ok);
  EXPECT_EQ(results[1].error, "interrupted before it began");
  EXPECT_EQ(journal.find("part 0"), nullptr) << "it was written, and is read by the next run";
  EXPECT_LT(passed(), 20.0) << "a third of what one part takes";
}

TEST_F(KeptWorkTest, APartThatHangsIsEndedWhenPatienceEnds) {
  work_.count = 1;
  work_.work = [](int) {
    ::sleep(60);
    return std::string();
  };
  const auto begin = std::chrono::steady_clock::now();
  work_.patience_s = 0.1;
  bool asked = false;
  work_.stop = [&] { return std::exchange(asked, true); };  // stops once the part has begun
  Journal journal;
  const std::vector<ChildResult> results = run_kept(work_, journal);
  EXPECT_FALSE(results[0].ok);
  EXPECT_EQ(results[0].error, "interrupted");
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 20.0);
}

TEST(ChildProgress, SharesOfChildrenAreSeenHereAndNeverFall) {
  ChildProgress progress(2);
  EXPECT_EQ(progress.share(), 0.0);
  run_in_children(2, 2, [&](int i) {
    ++progress.step();
    progress.set(i, i == 0 ? 1.0 : 0.5);
    return std::string();
  });
  EXPECT_DOUBLE_EQ(progress.share(), 0.75);
  EXPECT_EQ(progress.step().load(), 2);
  progress.set(1, 0.2);
  EXPECT_DOUBLE_EQ(progress.share(), 0.75);
  progress.set(1, 7.0);
  EXPECT_DOUBLE_EQ(progress.share(), 1.0) << "no part is more than whole";
}

}  // namespace
}  // namespace sparflow
