// The study commands on the deployment `engine`, with real processes: can a large and a small
// person reach the oil filter, and how much space does the arm need?
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>

#include <cmath>

#include "launch/study/folder/study_folder.h"
#include "launch/units/length.h"
#include "tests/support/recording/recordings.h"
#include "tests/support/text.h"

namespace fivepipe::test {
namespace {

using testing::HasSubstr;
using testing::Not;

// The hand is at the filter in the frames 77 to 115 of the deployment's 24 Hz.
constexpr std::uint64_t kLastFrame = 100;

class StudyEngine : public RecordingTest {
 protected:
  // Runs `fivepipe study WORDS` until it ends and returns what it printed.
  std::string study(std::vector<std::string> words) {
    words.insert(words.begin(), {std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe", "study"});
    Program program(words, folder_ / "study.log");
    EXPECT_EQ(program.wait_for_end(kStart), 0) << program.said();
    return program.said();
  }
  // Records a trial until the hand has been at the filter.
  void run_trial(const std::string& path, const std::string& participant) {
    auto composited = bus_.reader<bus::topics::FrameComposited>();
    const auto run = fivepipe("run", {"study", "run", path, "--participant", participant});
    std::uint64_t frame = 0;
    ASSERT_TRUE(eventually(bus_, kStart, [&] {
      for (const auto& sample : composited.take())
        if (sample.valid()) frame = std::max(frame, sample->frame);
      return frame >= kLastFrame;
    })) << run->said();
    run->signal(SIGINT);
    EXPECT_EQ(run->wait_for_end(kStart), 0) << run->said();
    EXPECT_THAT(run->said(), HasSubstr("trial 1: kept"));
  }
};

// The length after this text, such as "15.3 cm" [m]; NaN, which equals nothing, without one.
double length_after(const std::string& said, const std::string& text) {
  const std::size_t at = said.find(text);
  if (at == std::string::npos) {
    ADD_FAILURE() << text << " is not in\n" << said;
    return NAN;
  }
  const std::size_t from = at + text.size();
  const auto found_m = study::length_m(said.substr(from, said.find('\n', from) - from));
  EXPECT_TRUE(found_m) << said;
  return found_m.value_or(NAN);
}

TEST_F(StudyEngine, ALargePersonReachesTheFilterAndNeedsMoreSpaceThanASmallOne) {
  std::map<std::string, double> spacing_m;
  for (const auto& [person, hand_length_m] : {std::pair{"large", "0.21"}, {"small", "0.165"}}) {
    SCOPED_TRACE(person);
    const std::string path = (folder_ / person).string();
    EXPECT_THAT(study({"new", path, "--deployment", "engine", "--set",
                       std::string("hand_length_m=") + hand_length_m, "--spacing-of",
                       "engine block and battery"}),
                HasSubstr("moves along 1,0,0: 22.0 cm (11.0 cm to 60.0 cm)"));
    // The real battery is 1 cm behind the place that the scene states.
    EXPECT_THAT(study({"register", path, "--part", "battery", "--pair", "0cm,0cm,0cm=22cm,3cm,11cm",
                       "--pair", "5cm,0cm,0cm=27cm,3cm,11cm", "--pair",
                       "0cm,10cm,0cm=22cm,13cm,11cm", "--pair", "0cm,0cm,11cm=22cm,3cm,22cm"}),
                HasSubstr("RMS 0.00 mm"));
    const config::Scene scene = study::StudyFolder(path).deployment().scene;
    EXPECT_NEAR(scene.objects.back().world_from_object.translation().y(), 0.03, 1e-6);
    run_trial(path, person);
    const std::string reported =
                          study({"report", path, "--layouts", "3", "--no-swept", "--no-pictures"}),
                      events = text_of(folder_ / person / "report" / "events.csv");
    if (person == std::string("large"))
      EXPECT_THAT(events, HasSubstr("\"oil_filter\""));
    else
      EXPECT_THAT(events, Not(HasSubstr("\"oil_filter\"")));
    EXPECT_THAT(events, Not(HasSubstr("\"battery\""))) << "22 cm are enough for both";
    EXPECT_THAT(text_of(folder_ / person / "report" / "report.html"),
                HasSubstr("engine block and battery"));
    spacing_m[person] =
        length_after(reported, "trial 1: battery: minimum spacing above which all are free: ");
    // The recording contains the registered scene, so what-if finds the same.
    const std::string what_if =
        study({"what-if", (folder_ / person / "trials/0001/recording_1.mcap").string(), "--part",
               "battery", "--layouts", "3", "--verdicts"});
    EXPECT_THAT(what_if, HasSubstr("Part battery, spacing 11.0 cm to 60.0 cm"));
    EXPECT_EQ(length_after(what_if, "Minimum spacing above which all are free: "),
              spacing_m[person]);
  }
  fmt::print("needed spacing: large person {:.2f} cm, small person {:.2f} cm\n",
             100 * spacing_m["large"], 100 * spacing_m["small"]);
  // tests/study/truth: the closed form differs by more.
  EXPECT_GT(spacing_m["large"], spacing_m["small"] + 0.005);
}

}  // namespace
}  // namespace fivepipe::test
