// A study from its folder to the report, with real processes.
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "launch/study/folder/study_folder.h"
#include "tests/study/report/chromium.h"
#include "tests/support/optional_package.h"
#include "tests/support/recording/replayed_nodes.h"
#include "tests/support/text.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

// The arm of the demo reaches through the near face of the part, which is at a spacing of 5 cm.
const std::string kStudyScene = R"(name: layout
objects:
  # The part that moves.
  - name: part
    box: {size_m: [0.8, 0.4, 0.5], cell_m: 0.1}
    position_m: [0, 0.05, 0.25]
    spacing: {axis: [0, 1, 0], at_m: 0.05, range_m: [0, 1.5]}
  - {name: shelf, box: {size_m: [0.3, 0.3, 0.05]}, position_m: [0, 0.5, 0.8]}
)";

class StudyTrial : public ReplayedNodesTest {
 protected:
  std::string deployment_file() {
    const std::string file = changed_deployment(
        folder_ / "layout", "scene: " FIVEPIPE_SOURCE_DIR "/scenes/demo/scene.yaml",
        "scene: scene.yaml");
    std::ofstream(folder_ / "layout" / "scene.yaml") << kStudyScene;
    return file;
  }
  // Runs `fivepipe study WORDS`. Returns its exit code and sets said_.
  std::optional<int> study(std::vector<std::string> words) {
    const bool joins = words[0] == "run" || words[0] == "space";  // fivepipe() adds the domain
    words.insert(words.begin(), "study");
    std::unique_ptr<Program> program;
    if (joins) {
      program = fivepipe("study", words);
    } else {
      words.insert(words.begin(), std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe");
      program = std::make_unique<Program>(words, folder_ / "study.log");
    }
    const std::optional<int> exit_code = program->wait_for_end(kStart);
    said_ = program->said();
    return exit_code;
  }
  std::string csv(const std::string& name) const {
    return test::text_of(std::filesystem::path(path_) / "report" / name);
  }
  std::string path_ = (folder_ / "spacing").string();
  std::string said_;
};

TEST_F(StudyTrial, ThreeCommandsLeadToTheReportAndForgetRemovesAParticipant) {
  ASSERT_EQ(
      study({"new", path_, "--deployment", deployment_file(), "--spacing-of", "part and arm"}), 0)
      << said_;
  EXPECT_NE(said_.find("80.0 x 40.0 x 50.0 cm, moves along 0,1,0: 5.0 cm (0.0 cm to 150.0 cm)"),
            std::string::npos)
      << said_;
  ASSERT_EQ(
      study({"run", path_, "--participant", "Actor <1>", "--duration", "3", "--necessary-before",
             "15cm", "--allocated-before", "14-16cm", "--tool", "=tongs"}),
      0)
      << said_;
  EXPECT_NE(said_.find("trial 1: kept"), std::string::npos) << said_;
  ASSERT_EQ(study({"edit", path_, "--found", "22.5cm", "--note", "more space"}), 0) << said_;
  ASSERT_EQ(study({"report", path_, "--layouts", "4"}), 0) << said_;
  EXPECT_NE(said_.find("trial 1: part: minimum spacing above which all are free: "),
            std::string::npos)
      << said_;

  const study::StoredTrial stored = study::StudyFolder(path_).trial(1);
  EXPECT_EQ(stored.kind, study::report::ParticipantKind::scripted);
  EXPECT_EQ(stored.recordings, std::vector<std::string>{"recording_1.mcap"});
  const std::string trials = csv("trials.csv"), events = csv("events.csv");
  EXPECT_NE(trials.find("Actor <1>"), std::string::npos) << trials;
  EXPECT_EQ(trials.find(",=tongs"), std::string::npos) << "a formula of a spreadsheet";
  EXPECT_NE(events.find(",part,"), std::string::npos) << events;
  EXPECT_EQ(events.find(",shelf,"), std::string::npos) << events;
  EXPECT_EQ(events.find(",,"), std::string::npos) << "an event without its depth: " << events;
  EXPECT_GT(std::ranges::count(csv("clearance.csv"), '\n'), 20);
  EXPECT_GE(std::ranges::count(csv("what-if.csv"), '\n'), 5);
  const std::string page = csv("report.html");
  EXPECT_NE(page.find("Actor &lt;1&gt;"), std::string::npos);
  EXPECT_EQ(page.find("Actor <1>"), std::string::npos);
  EXPECT_NE(page.find("data:image/png"), std::string::npos) << "the picture of a collision";

  // The report shows the recorded scene, not that of a later trial.
  EXPECT_EQ(page.find("scene was changed"), std::string::npos);
  const std::filesystem::path scene = study::StudyFolder(path_).deployment().files.at(2);
  const std::string changed = test::replaced(test::text_of(scene), "position_m: [0, 0.05, 0.25]",
                                             "position_m: [0, 2.05, 0.25]");
  std::ofstream(scene) << changed;
  ASSERT_EQ(study({"report", path_, "--layouts", "1", "--no-swept", "--no-pictures"}), 0) << said_;
  EXPECT_EQ(csv("events.csv"), events);
  EXPECT_NE(csv("report.html").find("scene was changed after the trial was recorded"),
            std::string::npos);

  ASSERT_EQ(study({"list", path_}), 0) << said_;
  EXPECT_NE(said_.find("14.0 cm to 16.0 cm"), std::string::npos) << said_;
  ASSERT_EQ(study({"forget", path_, "--participant", "Actor <1>"}), 0) << said_;
  EXPECT_TRUE(study::StudyFolder(path_).trials().empty());
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path_))
    EXPECT_NE(entry.path().extension(), ".mcap") << entry.path();
  EXPECT_EQ(study({"report", path_}), 2) << said_;
}

// The largest number of successive lines that contain the part.
int longest_run(const std::string& lines, const std::string& part) {
  int longest = 0, run = 0;
  std::istringstream in(lines);
  for (std::string line; std::getline(in, line);) {
    run = line.find(part) == std::string::npos ? 0 : run + 1;
    longest = std::max(longest, run);
  }
  return longest;
}

// Ctrl-C ends a trial and keeps it; it is resumed as a second recording.
TEST_F(StudyTrial, AnInterruptedTrialIsKeptAndResumed) {
  ASSERT_EQ(study({"new", path_, "--deployment", deployment_file()}), 0) << said_;
  {
    const auto run = fivepipe("run", {"study", "run", path_, "--participant", "P1"});
    bus::Reader<bus::topics::FrameComposited> composited =
        bus_.reader<bus::topics::FrameComposited>();
    std::size_t frames = 0;
    ASSERT_TRUE(eventually(bus_, kStart, [&] { return (frames += composited.take().size()) > 20; }))
        << run->said();
    ASSERT_EQ(study({"edit", path_, "--tool", "tongs"}), 0) << said_;
    for (const std::vector<std::string>& refused :
         {std::vector<std::string>{"forget", path_, "--participant", "P1"},
          {"run", path_, "--participant", "P2", "--duration", "1"}}) {
      EXPECT_EQ(study(refused), 2) << said_;
      EXPECT_NE(said_.find("is in use by `fivepipe study run` (process "), std::string::npos)
          << said_;
    }
    // Far from the arm.
    ASSERT_EQ(study({"space", "140cm", "--deployment",
                     study::StudyFolder(path_).deployment_file().string()}),
              0)
        << said_;
    frames = 0;
    ASSERT_TRUE(eventually(bus_, kStart, [&] { return (frames += composited.take().size()) > 20; }))
        << run->said();
    run->signal(SIGINT);
    EXPECT_EQ(run->wait_for_end(kStart), 0) << run->said();
  }
  ASSERT_EQ(study({"run", path_, "--resume", "1", "--duration", "1"}), 0) << said_;
  const study::StoredTrial trial = study::StudyFolder(path_).trial(1);
  EXPECT_EQ(trial.state, study::TrialState::kept);
  EXPECT_EQ(trial.tool, "tongs");
  EXPECT_EQ(trial.recordings.size(), 2u);
  ASSERT_EQ(trial.notes.size(), 1u);
  EXPECT_EQ(trial.notes[0].text, "tool: tongs");
  ASSERT_EQ(study({"report", path_, "--no-swept", "--no-pictures", "--layouts", "2"}), 0) << said_;
  EXPECT_NE(csv("trials.csv").find("tongs"), std::string::npos);
  // The part collides until it is moved, and is far away then.
  const std::string clearance = csv("clearance.csv");
  EXPECT_NE(clearance.find(",0,0,10,"), std::string::npos);
  EXPECT_GE(longest_run(clearance, ",10,,10,"), 20) << clearance;
  EXPECT_NE(csv("report.html").find(" at 140.0 cm"), std::string::npos);

  // One curve for both recordings, and the tool's note while the first one ran.
  EXPECT_EQ(std::ranges::count(csv("what-if.csv"), '\n'), 1 + 2);
  // A recording that cannot be used does not stop the report.
  std::filesystem::resize_file(std::filesystem::path(path_) / "trials/0001/recording_2.mcap", 100);
  ASSERT_EQ(study({"report", path_, "--no-swept", "--no-pictures", "--layouts", "2"}), 0) << said_;
  EXPECT_NE(csv("report.html").find("Trial 1: not used: "), std::string::npos);
  EXPECT_GE(longest_run(csv("clearance.csv"), ",10,,10,"), 15) << "of the first recording";

  if (chromium().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE("chromium is not installed");
  const json seen = visits({std::filesystem::path(path_) / "report" / "report.html"})[0];
  expect_no_request_or_error(seen);
  EXPECT_GE(seen["value"]["charts"].size(), 3u);
  EXPECT_GT(seen["value"]["views"][0]["colours"], 10);
  EXPECT_EQ(seen["value"]["table"][0].size(), 2u);
}

TEST_F(StudyTrial, ATrialThatRecordsNothingIsRemoved) {
  ASSERT_EQ(study({"new", path_, "--deployment", deployment_file()}), 0) << said_;
  // The disk is full, or the folder is not writable: `up` refuses to begin.
  std::filesystem::create_directories(std::filesystem::path(path_) / "trials/0001");
  std::ofstream(std::filesystem::path(path_) / "trials/0001/run_1") << "a file, not a folder";
  EXPECT_NE(study({"run", path_, "--participant", "P1"}), 0);
  EXPECT_NE(said_.find("trial 1: nothing was recorded"), std::string::npos) << said_;
  EXPECT_EQ(study({"run", path_}), 2) << said_;
  EXPECT_EQ(study({"run", path_, "--resume", "3"}), 2) << said_;
  EXPECT_EQ(study({"run", path_, "--participant", "P1", "--found", "wide"}), 2) << said_;
  EXPECT_NE(said_.find("--found: 'wide' is no answer"), std::string::npos) << said_;
  EXPECT_TRUE(study::StudyFolder(path_).trials().empty());
}

}  // namespace
}  // namespace fivepipe::test
