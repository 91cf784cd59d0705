#include "launch/study/recorded_frames.h"

#include <gtest/gtest.h>

#include "common/recording/files/recording_writer.h"
#include "common/recording/replay/recorded_deployment.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/test_folder.h"

namespace fivepipe::study {
namespace {

TEST(RecordedFrames, OfTheKeptRecordingAreComplete) {
  const recording::Recording recording(test::kKeptRecording);
  const replay::RecordedDeployment recorded(recording, {});
  RecordedFrames frames(recording, recorded.deployment());
  std::vector<RecordedFrame> all;
  while (auto frame = frames.next()) all.push_back(std::move(*frame));
  ASSERT_EQ(all.size(), 33u);
  EXPECT_TRUE(frames.drops().empty());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].set.silhouettes.size(), 3u);
    if (i == 0) continue;
    EXPECT_GT(all[i].set.frame, all[i - 1].set.frame);
    EXPECT_GE(all[i].done, all[i - 1].done);
    EXPECT_NEAR(all[i - 1].duration_s,
                std::min(kLongestFrame_s, 1e-9 * double(all[i].set.capture_stamp_ns -
                                                        all[i - 1].set.capture_stamp_ns)),
                1e-12);
  }
  EXPECT_EQ(all.back().duration_s, all[all.size() - 2].duration_s);
  EXPECT_EQ(all.back().done, 1);
}

TEST(RecordedFrames, NamesARecordingWithoutMaps) {
  const test::TestFolder folder;
  const std::filesystem::path file = folder.path / "empty.mcap";
  { recording::RecordingWriter writer(file, "test", {}); }
  const recording::Recording kept(test::kKeptRecording), empty(file);
  const replay::RecordedDeployment recorded(kept, {});
  try {
    RecordedFrames(empty, recorded.deployment());
    FAIL() << "no RecordingError";
  } catch (const recording::RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("contains no object-pixel maps"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace fivepipe::study
