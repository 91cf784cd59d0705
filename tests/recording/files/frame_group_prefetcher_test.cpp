#include "common/recording/files/frame_group_prefetcher.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/support/recording/synthetic_recordings.h"

namespace fivepipe::recording {
namespace {

using test::kFrame_ns, test::kStart_ns;

constexpr std::uint64_t kFrames = 300;

class FrameGroupPrefetcherTest : public testing::Test {
 protected:
  FrameGroupPrefetcherTest() {
    RecordingWriter writer(path_, "tests",
                           {.compression = mcap::Compression::none, .chunk_bytes = 2000});
    const mcap::Id channel = writer.add_channel("a", test::kFramedType, test::kFramedIdl, {});
    for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
      const std::int64_t stamp_ns = kStart_ns + std::int64_t(frame) * kFrame_ns;
      writer.add(channel, stamp_ns, stamp_ns, test::framed(frame, 0, stamp_ns));
    }
  }
  static FrameGroups groups_of(const Recording& recording) {
    return {recording, recording.messages(), [](const std::string&) { return 0; }};
  }
  static std::vector<std::uint64_t> all_frames(FrameGroupPrefetcher& prefetcher) {
    std::vector<std::uint64_t> frames;
    while (const auto group = prefetcher.next()) frames.push_back(group->frame.value());
    return frames;
  }

  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "made.mcap";
};

TEST_F(FrameGroupPrefetcherTest, ReturnsEveryGroupInOrderWithAnyQueueSize) {
  const Recording recording(path_);
  std::vector<std::uint64_t> expected(kFrames);
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) expected[frame] = frame;
  for (const std::size_t ready_bytes : {std::size_t(1), std::size_t(1000), std::size_t(1) << 30}) {
    FrameGroupPrefetcher prefetcher(groups_of(recording), ready_bytes);
    prefetcher.wait_until_ready();
    EXPECT_EQ(all_frames(prefetcher), expected) << ready_bytes;
    EXPECT_EQ(prefetcher.late(), 0u);
    EXPECT_EQ(prefetcher.damaged(), 0u);
    EXPECT_FALSE(prefetcher.next()) << "after the end";
  }
}

// Each frame is a chunk of its own. The thread reads as many frames as fit, and the 121 that it
// needs to know that a frame is complete.
TEST_F(FrameGroupPrefetcherTest, ReadsAheadAsFarAsItsBytesAllow) {
  const auto path = folder_.path / "chunks.mcap";
  constexpr std::size_t kMessageBytes = 4000;
  {
    RecordingWriter writer(path, "tests",
                           {.compression = mcap::Compression::none, .chunk_bytes = 1});
    const mcap::Id channel = writer.add_channel("a", test::kFramedType, test::kFramedIdl, {});
    for (std::uint64_t frame = 0; frame < 200; ++frame) {
      const std::int64_t stamp_ns = kStart_ns + std::int64_t(frame) * kFrame_ns;
      std::vector<std::byte> message = test::framed(frame, 0, stamp_ns);
      message.resize(kMessageBytes);
      writer.add(channel, stamp_ns, stamp_ns, message);
    }
  }
  const std::vector<mcap::ChunkIndex> chunks = mcap::Reader(path).chunks();
  ASSERT_EQ(chunks.size(), 200u);
  auto bytes = test::file_bytes(path);
  for (const std::size_t frame : {127, 140})
    bytes[chunks[frame].offset + chunks[frame].length_bytes - 1] ^= std::byte(1);
  test::write_file(path, bytes);
  const Recording recording(path);
  FrameGroupPrefetcher prefetcher(groups_of(recording), 10 * kMessageBytes);
  prefetcher.wait_until_ready();
  EXPECT_EQ(prefetcher.damaged(), 1u) << "9 or 10 frames fit";
  EXPECT_EQ(all_frames(prefetcher).size(), 198u);
  EXPECT_EQ(prefetcher.damaged(), 2u);
}

TEST_F(FrameGroupPrefetcherTest, DestructorStopsAThreadThatWaitsForRoom) {
  const Recording recording(path_);
  FrameGroupPrefetcher prefetcher(groups_of(recording), 1);
  prefetcher.wait_until_ready();
  EXPECT_EQ(prefetcher.next()->frame, 0u);
}

TEST_F(FrameGroupPrefetcherTest, RethrowsOtherErrorsAfterTheGroupsBeforeThem) {
  const auto path = folder_.path / "two.mcap";
  {
    RecordingWriter writer(path, "tests", {});
    const mcap::Id channel = writer.add_channel("a", test::kFramedType, test::kFramedIdl, {});
    for (const std::uint64_t frame : {0, 1, 1})
      writer.add(channel, kStart_ns, kStart_ns, test::framed(frame, 0, kStart_ns));
  }
  const Recording recording(path);
  FrameGroupPrefetcher prefetcher({recording, recording.messages(), [](const std::string&) -> int {
                                     throw std::logic_error("no rank");
                                   }});
  EXPECT_EQ(prefetcher.next()->frame, 0u);
  EXPECT_THROW(prefetcher.next(), std::logic_error);
}

TEST_F(FrameGroupPrefetcherTest, CountsLateMessages) {
  const auto path = folder_.path / "late.mcap";
  {
    RecordingWriter writer(path, "tests", {});
    const mcap::Id channel = writer.add_channel("a", test::kFramedType, test::kFramedIdl, {});
    for (std::uint64_t frame = 0; frame < 200; ++frame)
      writer.add(channel, kStart_ns, kStart_ns, test::framed(frame, 0, kStart_ns));
    writer.add(channel, kStart_ns, kStart_ns, test::framed(3, 0, kStart_ns));
  }
  const Recording recording(path);
  FrameGroupPrefetcher prefetcher(groups_of(recording));
  std::size_t groups = 0;
  while (prefetcher.next()) ++groups;
  EXPECT_EQ(groups, 201u);
  EXPECT_EQ(prefetcher.late(), 1u);
}

TEST_F(FrameGroupPrefetcherTest, SkipsAndCountsDamagedChunks) {
  const mcap::ChunkIndex damaged = mcap::Reader(path_).chunks().at(1);
  auto bytes = test::file_bytes(path_);
  bytes[damaged.offset + damaged.length_bytes / 2] ^= std::byte(1);
  test::write_file(path_, bytes);
  const Recording recording(path_);
  FrameGroupPrefetcher prefetcher(groups_of(recording));
  const auto frames = all_frames(prefetcher);
  EXPECT_EQ(prefetcher.damaged(), 1u);
  EXPECT_LT(frames.size(), kFrames);
  EXPECT_EQ(frames.front(), 0u);
  EXPECT_EQ(frames.back(), kFrames - 1);
}

}  // namespace
}  // namespace fivepipe::recording
