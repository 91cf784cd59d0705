// The program that writes the frames of a clip.
#include <opencv2/imgcodecs.hpp>

#include "tests/support/process.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::test {
namespace {

class SceneClip : public testing::Test {
 protected:
  // Runs scene_clip; returns its exit code.
  int run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), FIVEPIPE_BINARY_DIR "/scene_clip");
    arguments.insert(arguments.end(), {"--out", frames_});
    Program program(arguments, folder_.path / "log");
    const int code = program.wait_for_end(std::chrono::seconds(60 * kSlowdown)).value_or(-1);
    said_ = program.said();
    return code;
  }
  const TestFolder folder_;
  const std::filesystem::path frames_ = folder_.path / "frames";
  std::string said_;
};

TEST_F(SceneClip, WritesFramesOfTheSceneAndOfTheWidth) {
  ASSERT_EQ(run({"demo", "--start", "1", "--duration", "0.16", "--width", "240"}), 0) << said_;
  const cv::Mat first = cv::imread(frames_ / "0000.png"), second = cv::imread(frames_ / "0001.png");
  ASSERT_EQ(first.size(), cv::Size(240, 180));
  ASSERT_EQ(second.size(), first.size());
  EXPECT_GT(cv::norm(first, second), 0) << "the hand moves";
  EXPECT_FALSE(std::filesystem::exists(frames_ / "0002.png"));
}

TEST_F(SceneClip, NamesTheFileOfAnUnknownScene) {
  EXPECT_EQ(run({"nothing"}), 2);
  EXPECT_TRUE(contains(said_, "launch/deployments/nothing.yaml")) << said_;
}

TEST_F(SceneClip, RefusesValuesOutOfRange) {
  for (const std::vector<std::string>& bad : {std::vector<std::string>{"--rate", "0"},
                                              {"--rate", "25"},
                                              {"--rate", "nan"},
                                              {"--duration", "-1"},
                                              {"--start", "inf"},
                                              {"--width", "8"}}) {
    std::vector<std::string> arguments = {"demo"};
    arguments.insert(arguments.end(), bad.begin(), bad.end());
    EXPECT_NE(run(arguments), 0) << bad[0] << ' ' << bad[1];
    EXPECT_TRUE(contains(said_, bad[0])) << said_;
    EXPECT_FALSE(std::filesystem::exists(frames_ / "0000.png"));
  }
}

}  // namespace
}  // namespace fivepipe::test
