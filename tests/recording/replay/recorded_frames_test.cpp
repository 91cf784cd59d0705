#include "common/recording/replay/recorded_frames.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/recording/files/recording_writer.h"
#include "common/recording/replay/recorded_deployment.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/test_folder.h"

namespace fivepipe::replay {
namespace {

TEST(RecordedFrames, OfTheKeptRecordingAreComplete) {
  const recording::Recording recording(test::kKeptRecording);
  const RecordedDeployment recorded(recording, {});
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
                std::min(kMaxFrame_s, 1e-9 * double(all[i].set.capture_stamp_ns -
                                                    all[i - 1].set.capture_stamp_ns)),
                1e-12);
  }
  EXPECT_EQ(all.back().duration_s, all[all.size() - 2].duration_s);
  EXPECT_EQ(all.back().done, 1);
}

TEST(RecordedFrames, HaveTheirColoursAndHeadPose) {
  const recording::Recording recording(test::kKeptRecording);
  const RecordedDeployment recorded(recording, {});
  RecordedFrames plain(recording, recorded.deployment()),
      full(recording, recorded.deployment(), {.colours = true, .head_poses = true});
  int frames = 0;
  while (const auto frame = full.next()) {
    ++frames;
    EXPECT_EQ(frame->set.frame, plain.next()->set.frame);
    ASSERT_TRUE(frame->eye_from_world);
    EXPECT_NEAR(frame->eye_from_world->inverse().translation().y(), -0.75, 1e-6);
    ASSERT_EQ(frame->colours.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      // A camera that gives shape sends the colours of its object pixels.
      EXPECT_EQ(frame->colours[i].pixels, frame->set.silhouettes[i].pixels);
      EXPECT_EQ(frame->colours[i].camera.pinhole, frame->set.silhouettes[i].camera.pinhole);
      EXPECT_FALSE(frame->colours[i].bgr.empty());
    }
  }
  EXPECT_EQ(frames, 33);
  EXPECT_TRUE(full.drops().empty());
}

// Of the kept recording with another rig: each map has another size.
TEST(RecordedFrames, BadMapsAreDroppedAndCounted) {
  const recording::Recording recording(test::kKeptRecording);
  const RecordedDeployment recorded(recording, {});
  config::Deployment other = recorded.deployment();
  for (config::RigCamera& camera : other.rig.cameras) ++camera.published.width_px;
  RecordedFrames frames(recording, other);
  EXPECT_FALSE(frames.next());
  EXPECT_EQ(frames.drops(), (std::map<std::string, std::uint64_t>{{"bad_map", 99}}));
  EXPECT_EQ(frames.first_fault().rfind("bad_map: ", 0), 0u) << frames.first_fault();
}

// A camera that is not in the rig; the frames are complete without it.
TEST(RecordedFrames, MapsOfAnUnknownCameraAreDropped) {
  const recording::Recording recording(test::kKeptRecording);
  const RecordedDeployment recorded(recording, {});
  config::Deployment other = recorded.deployment();
  other.rig.cameras.pop_back();
  RecordedFrames frames(recording, other);
  int count = 0;
  while (const auto frame = frames.next()) {
    EXPECT_EQ(frame->set.silhouettes.size(), 2u);
    ++count;
  }
  EXPECT_EQ(count, 33);
  ASSERT_EQ(frames.drops().size(), 1u);
  EXPECT_EQ(frames.drops().begin()->second, 33u);
}

// The file ends early: the frames before its end are read.
TEST(RecordedFrames, OfATruncatedFileAreThoseBeforeItsEnd) {
  const test::TestFolder folder;
  const std::filesystem::path file = folder.path / "cut.mcap";
  std::filesystem::copy_file(test::kKeptRecording, file);
  std::filesystem::resize_file(file, std::filesystem::file_size(file) * 6 / 10);
  const recording::Recording kept(test::kKeptRecording), cut(file);
  EXPECT_FALSE(cut.mcap().is_finished());
  const RecordedDeployment recorded(kept, {});
  RecordedFrames frames(cut, recorded.deployment());
  int count = 0;
  while (frames.next()) ++count;
  EXPECT_GT(count, 5);
  EXPECT_LT(count, 33);
}

TEST(RecordedFrames, ADamagedChunkIsSkippedAndCounted) {
  const test::TestFolder folder;
  const std::filesystem::path file = folder.path / "damaged.mcap";
  std::filesystem::copy_file(test::kKeptRecording, file);
  {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(std::streamoff(std::filesystem::file_size(file) / 2));
    bytes << "damage";
  }
  const recording::Recording kept(test::kKeptRecording), damaged(file);
  const RecordedDeployment recorded(kept, {});
  RecordedFrames frames(damaged, recorded.deployment());
  int count = 0;
  while (frames.next()) ++count;
  EXPECT_GT(count, 5);
  EXPECT_LT(count, 33);
  EXPECT_EQ(frames.drops().at("damaged_chunk"), 1u);
  EXPECT_FALSE(frames.first_fault().empty());
}

TEST(RecordedFrames, NamesARecordingWithoutMaps) {
  const test::TestFolder folder;
  const std::filesystem::path file = folder.path / "empty.mcap";
  { recording::RecordingWriter writer(file, "test", {}); }
  const recording::Recording kept(test::kKeptRecording), empty(file);
  const RecordedDeployment recorded(kept, {});
  try {
    RecordedFrames(empty, recorded.deployment());
    FAIL() << "no RecordingError";
  } catch (const recording::RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("contains no object-pixel maps"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace fivepipe::replay
