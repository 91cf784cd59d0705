// The answers of `fivepipe study what-if` and `fivepipe study report` to recordings that lack maps
// or are cut off, from the built commands.
#include <gtest/gtest.h>

#include "common/pipeline/bus/topics.h"
#include "common/recording/schema/cdr.h"
#include "launch/study/folder/study_folder.h"
#include "tests/study/results/recording_copy.h"
#include "tests/study/study_command.h"
#include "tests/support/deployments.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::study {
namespace {

namespace fs = std::filesystem;
using test::contains;

bool is_map(const recording::RecordedMessage& message) {
  return message.channel->topic == bus::topics::ObjectPixelMap::name;
}

class UnusableRecordings : public testing::Test {
 protected:
  UnusableRecordings() {
    trial_ = study_.add_trial("P1", report::ParticipantKind::human);
    trial_.state = TrialState::kept;
    trial_.recordings = {"recording_1.mcap"};
    study_.save(trial_);
    file_ = study_.folder_of(1) / "recording_1.mcap";
  }
  // A copy of the kept recording whose size is this part of it.
  void cut_to(double part) {
    fs::copy_file(test::kKeptRecording, file_, fs::copy_options::overwrite_existing);
    fs::resize_file(file_, std::uintmax_t(part * double(fs::file_size(file_))));
  }
  test::ShellAnswer what_if(Output output = Output::errors) const {
    return study_command("what-if " + file_.string() + " --part block --range 0m:1m", output);
  }
  test::ShellAnswer report() const {
    return study_command(
        "report " + study_.path().string() + " --no-swept --no-pictures --layouts 2",
        Output::errors);
  }
  std::string page() const { return test::text_of(study_.report_folder() / "report.html"); }
  // Both commands name the file and what to do. The report shows the trial without results.
  void expect_refused(const std::string& why) const {
    const test::ShellAnswer alone = what_if();
    EXPECT_EQ(alone.exit_code, 1);
    EXPECT_TRUE(alone.text.starts_with("fivepipe study: " + file_.string() + why)) << alone.text;
    const test::ShellAnswer of_study = report();
    EXPECT_EQ(of_study.exit_code, 0) << "the other trials are reported";
    const std::size_t name = std::string("fivepipe study: ").size();
    const std::string same = alone.text.substr(name, alone.text.find('\n') - name);
    EXPECT_EQ(of_study.text, "warning: Trial 1: not used: " + same + ".\n");
    EXPECT_TRUE(contains(page(), "Trial 1: not used: ")) << of_study.text;
    EXPECT_TRUE(contains(page(), "No collisions were computed for this trial."));
  }

  test::TestFolder folder_;
  StudyFolder study_ =
      StudyFolder::create(folder_.path / "study", {"Name", test::kKeptDeployment, {}, ""});
  StoredTrial trial_;
  fs::path file_;
};

TEST_F(UnusableRecordings, WithoutMapsAreRefused) {
  test::copy_recording(test::kKeptRecording, file_, nullptr,
                       [](const auto& message) { return !is_map(message); });
  expect_refused(
      " contains no object-pixel maps, so there are no real objects in it; record the topic "
      "fivepipe/v1/ObjectPixelMap\n");
}

// No frame has the maps of all cameras that the hull needs.
TEST_F(UnusableRecordings, WithoutTheMapsOfACameraAreRefused) {
  const recording::Recording kept(test::kKeptRecording);
  test::copy_recording(test::kKeptRecording, file_, nullptr, [&](const auto& message) {
    return !is_map(message) || schema::decode(kept.idl(*message.channel), message.channel->type,
                                              message.cdr)["camera"] != "left";
  });
  expect_refused(
      " contains no complete frame: one map of each camera of the recorded rig that gives shape; "
      "dropped: 33 incomplete_set; `fivepipe info " +
      file_.string() + "` lists what was recorded\n");
}

TEST_F(UnusableRecordings, CutOffInTheHeaderAreRefused) {
  for (const double part : {0.0, 1e-5}) {
    cut_to(part);
    expect_refused(": byte 0: not an MCAP file\n");
  }
}

// What is before the cut is used, and both commands report how to see what is missing.
TEST_F(UnusableRecordings, CutOffLaterAreUsedAsFarAsTheyGo) {
  cut_to(0.6);
  const std::string shown = ": no magic bytes at the end",
                    info = "; `fivepipe info " + file_.string() + "` states what is missing";
  const test::ShellAnswer alone = what_if(Output::all), of_study = report();
  EXPECT_EQ(alone.exit_code, 0);
  EXPECT_TRUE(contains(alone.text, shown + ": only what could be read was studied" + info + ".\n"))
      << alone.text;
  EXPECT_EQ(of_study.exit_code, 0);
  EXPECT_TRUE(
      of_study.text.starts_with("warning: Trial 1: the recording is incomplete: " + file_.string()))
      << of_study.text;
  EXPECT_TRUE(of_study.text.ends_with(shown + info + ".\n")) << of_study.text;
  EXPECT_TRUE(contains(page(), "the recording is incomplete"));
  EXPECT_FALSE(contains(page(), "No collisions were computed for this trial."));
}

}  // namespace
}  // namespace fivepipe::study
