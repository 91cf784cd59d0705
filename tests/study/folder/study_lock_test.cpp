// Commands of a study that run at once.
#include "launch/study/folder/study_lock.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <functional>
#include <thread>

#include "common/base/usage_error.h"
#include "launch/study/folder/study_folder.h"
#include "tests/support/deployments.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::study {
namespace {

namespace fs = std::filesystem;
using test::contains;

std::string refusal_of(const std::function<void()>& use) {
  try {
    use();
    return "";
  } catch (const base::UsageError& error) {
    return error.what();
  }
}

// A process that holds locks until it is killed.
class Holder {
 public:
  Holder(const fs::path& folder, const std::string& command, const std::vector<StudyPart>& parts) {
    std::array<int, 2> ready{};
    EXPECT_EQ(pipe(ready.data()), 0);
    child_ = fork();
    if (child_ == 0) {
      const StudyLock lock(folder, command, parts);
      if (write(ready[1], "x", 1) == 1) pause();
      _exit(0);
    }
    close(ready[1]);
    char byte = 0;
    EXPECT_EQ(read(ready[0], &byte, 1), 1) << "the child holds no lock";
    close(ready[0]);
  }
  ~Holder() { end(); }
  pid_t process() const { return child_; }
  void end() {
    if (child_ <= 0) return;
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
    child_ = 0;
  }

 private:
  pid_t child_ = 0;
};

StudyFolder locked_study(const test::TestFolder& folder) {
  return StudyFolder::create(
      folder.path / "study",
      {"Name", FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml", {}, "a"});
}

TEST(StudyLock, NamesTheCommandAndTheProcessThatHoldIt) {
  const test::TestFolder folder;
  Holder run(folder.path, "run", {StudyPart::run});
  const auto lock = [&] { StudyLock second(folder.path, "register", kWholeStudy); };
  EXPECT_EQ(refusal_of(lock),
            folder.path.string() + " is in use by `fivepipe study run` (process " +
                std::to_string(run.process()) +
                "); wait until it has ended, or end it, then repeat this command");
  // The parts that the refused command had locked are free again.
  EXPECT_EQ(refusal_of([&] { StudyLock report(folder.path, "report", {StudyPart::report}); }), "");
}

TEST(StudyLock, EndsWithAKilledProcess) {
  const test::TestFolder folder;
  Holder forget(folder.path, "forget", kWholeStudy);
  const auto lock = [&] { StudyLock second(folder.path, "run", kWholeStudy); };
  EXPECT_TRUE(contains(refusal_of(lock), "`fivepipe study forget`"));
  forget.end();
  EXPECT_EQ(refusal_of(lock), "");
  // Nothing is left of the name of a command that has ended.
  for (const StudyPart part : kWholeStudy)
    EXPECT_EQ(test::text_of(lock_file(folder.path, part)), "");
}

TEST(StudyLock, OfTrialsWaitsForAMoment) {
  const test::TestFolder folder;
  Holder edit(folder.path, "edit", {StudyPart::trials});
  std::thread ends([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    edit.end();
  });
  EXPECT_EQ(refusal_of([&] { StudyLock second(folder.path, "edit", {StudyPart::trials}); }), "");
  ends.join();
}

// `report` and `edit` work beside `run`; `forget` and a second `run` do not.
TEST(StudyLock, OfARunPermitsWhatDoesNotDestroyItsFiles) {
  const test::TestFolder folder;
  StudyFolder study = locked_study(folder);
  study.add_trial("Quentin", report::ParticipantKind::human);
  Holder run(study.path(), "run", {StudyPart::run});
  EXPECT_EQ(refusal_of([&] { StudyLock report(study.path(), "report", {StudyPart::report}); }), "");
  study.change(1, "edit", [](StoredTrial& trial) { trial.tool = "tongs"; });
  EXPECT_EQ(study.trial(1).tool, "tongs");
  EXPECT_TRUE(contains(refusal_of([&] { study.forget("Quentin"); }), "`fivepipe study run`"));
  EXPECT_EQ(study.trials().size(), 1u);
  EXPECT_NE(refusal_of([&] { StudyLock second(study.path(), "run", {StudyPart::run}); }), "");
  run.end();
  EXPECT_EQ(study.forget("Quentin").trials, 1);
}

TEST(StudyLock, OfForgetRefusesAllOthers) {
  const test::TestFolder folder;
  StudyFolder study = locked_study(folder);
  StoredTrial trial = study.add_trial("P1", report::ParticipantKind::human);
  const Holder forget(study.path(), "forget", kWholeStudy);
  trial.tool = "tongs";
  for (const auto& write : std::vector<std::function<void()>>{
           [&] { study.save(trial); }, [&] { study.change(1, "edit", [](StoredTrial&) {}); },
           [&] { study.forget("P1"); }})
    EXPECT_TRUE(contains(refusal_of(write), "is in use by `fivepipe study forget`"));
  EXPECT_EQ(study.trial(1).tool, "");
  EXPECT_EQ(study.trials().size(), 1u);
}

// Each reads the trial after the other one has written it.
TEST(StudyLock, KeepsTheChangesOfTwoCommands) {
  constexpr int kNotes = 50;
  const test::TestFolder folder;
  StudyFolder study = locked_study(folder);
  study.add_trial("P1", report::ParticipantKind::human);
  const auto add_notes = [&] {
    const auto add = [&] {
      try {
        study.change(1, "edit", [](StoredTrial& trial) { trial.notes.push_back({1, "note"}); });
      } catch (const fs::filesystem_error& error) {
        ADD_FAILURE() << error.what();
      }
    };
    for (int i = 0; i < kNotes; ++i)
      while (!refusal_of(add).empty()) continue;  // the other one was faster for a second
  };
  std::thread other(add_notes);
  add_notes();
  other.join();
  EXPECT_EQ(study.trial(1).notes.size(), std::size_t(2 * kNotes));
}

TEST(StudyLock, OfNewPermitsOneCommandPerFolder) {
  const test::TestFolder folder;
  fs::create_directories(folder.path / "study");
  {
    const Holder first(folder.path / "study", "new", kWholeStudy);
    EXPECT_TRUE(contains(refusal_of([&] { locked_study(folder); }), "`fivepipe study new`"));
  }
  // The first one was killed before it wrote anything.
  locked_study(folder);
  EXPECT_TRUE(contains(refusal_of([&] { locked_study(folder); }), "is not empty"));
}

// Numbers of trials stay unique if the study was opened before another command added one.
TEST(StudyLock, AddsATrialAfterThatOfAnotherCommand) {
  const test::TestFolder folder;
  StudyFolder study = locked_study(folder), other(study.path());
  EXPECT_EQ(study.add_trial("P1", report::ParticipantKind::human).number, 1);
  EXPECT_EQ(other.add_trial("P2", report::ParticipantKind::human).number, 2);
}

}  // namespace
}  // namespace fivepipe::study
