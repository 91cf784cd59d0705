// A cursor returns messages by log stamp, filtered by channel and time, and reads no other chunks.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/recording/mcap_files.h"

namespace fivepipe::mcap {
namespace {

// A file with overlapping chunks, repeated stamps and any order within a chunk.
test::Recording shuffled_recording(std::uint32_t seed) {
  std::mt19937 random(seed);
  const std::size_t chunks = 1 + random() % 8;
  test::Recording recording = test::made_up_recording(seed, chunks, 1 + random() % 40);
  const std::uint64_t span_ns = 1 + random() % 400;
  std::uint64_t base_ns = 0;
  for (std::size_t i = 0; i < recording.messages.size(); ++i) {
    if (random() % 20 == 0) base_ns += random() % 300;
    recording.messages[i].log_stamp_ns = base_ns + random() % span_ns;
  }
  return recording;
}

std::vector<test::OwnMessage> expected_of(const test::Recording& recording, std::uint64_t start_ns,
                                          std::uint64_t end_ns, const std::set<Id>& channels) {
  std::vector<test::OwnMessage> expected;
  for (const test::OwnMessage& message : recording.messages)
    if (message.log_stamp_ns >= start_ns && message.log_stamp_ns <= end_ns &&
        channels.contains(message.channel))
      expected.push_back(message);
  std::stable_sort(expected.begin(), expected.end(),
                   [](const test::OwnMessage& a, const test::OwnMessage& b) {
                     return a.log_stamp_ns < b.log_stamp_ns;
                   });
  return expected;
}

TEST(McapOrder, OrdersByStampAcrossOverlappingChunks) {
  const test::TestFolder folder;
  std::mt19937 random(11);
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    test::Recording recording = shuffled_recording(seed);
    test::write(recording, folder.path / "a.mcap", Compression(seed % 3), seed % 2 == 0);
    const Reader reader(folder.path / "a.mcap");
    EXPECT_EQ(test::all_messages(reader.messages()),
              expected_of(recording, 0, ~std::uint64_t(0), {1, 2, 3}))
        << seed;
    for (int i = 0; i < 5; ++i) {
      const std::uint64_t start_ns = random() % 1000, end_ns = start_ns + random() % 500;
      const std::set<Id> channels = {Id(1 + random() % 3), Id(1 + random() % 3)};
      EXPECT_EQ(test::all_messages(reader.messages(start_ns, end_ns, channels)),
                expected_of(recording, start_ns, end_ns, channels))
          << seed;
    }
  }
}

TEST(McapOrder, NoChannelsGiveNoMessages) {
  const test::TestFolder folder;
  test::Recording recording = test::made_up_recording(1, 2, 10);
  test::write(recording, folder.path / "a.mcap", Compression::lz4);
  const Reader reader(folder.path / "a.mcap");
  EXPECT_FALSE(reader.messages(0, ~std::uint64_t(0), std::set<Id>{}).next());
  EXPECT_FALSE(reader.messages(0, ~std::uint64_t(0), std::set<Id>{77}).next());
  const std::uint64_t last_ns = recording.messages.back().log_stamp_ns;
  EXPECT_FALSE(reader.messages(last_ns + 1).next());
  EXPECT_TRUE(reader.messages(last_ns).next());
  EXPECT_FALSE(reader.messages(2, 1).next());
}

TEST(McapOrder, ACursorOutlivesItsReader) {
  const test::TestFolder folder;
  test::Recording recording = test::made_up_recording(1, 2, 10);
  test::write(recording, folder.path / "a.mcap", Compression::zstd);
  Cursor cursor = Reader(folder.path / "a.mcap").messages();
  EXPECT_EQ(test::all_messages(std::move(cursor)), recording.messages);
}

// The cursor would return a message outside the times that its chunk states out of order.
TEST(McapOrder, AMessageOutsideTheTimesOfItsChunkIsDamage) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "a.mcap";
  for (const auto& [start_ns, end_ns, fits] :
       {std::tuple(100u, 200u, true), std::tuple(101u, 200u, false),
        std::tuple(100u, 199u, false)}) {
    ChunkBuilder builder;
    const Id channel = builder.add_channel({0, "t", "cdr", {}});
    for (const std::uint64_t stamp_ns : {200u, 100u}) builder.add({channel, 0, stamp_ns, 0, {}});
    Chunk chunk = builder.take();
    EXPECT_EQ(chunk.start_ns, 100u);
    EXPECT_EQ(chunk.end_ns, 200u);
    chunk.start_ns = start_ns;
    chunk.end_ns = end_ns;
    std::filesystem::remove(path);
    {
      FileWriter writer(path, Compression::none, "");
      writer.write(chunk);
      writer.finish();
    }
    const auto all = [&] { return test::all_messages(Reader(path).messages()).size(); };
    if (fits)
      EXPECT_EQ(all(), 2u);
    else
      EXPECT_THROW(all(), McapError);
    test::remove_summary(path);
    EXPECT_EQ(Reader(path).damage().damaged_records, fits ? 0u : 1u);
    EXPECT_EQ(all(), fits ? 2u : 0u);
  }
}

// The other chunks are damaged: reading one would throw.
TEST(McapOrder, ChunksOfOtherTimesAndOtherChannelsAreNotRead) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "a.mcap";
  test::Recording recording = test::made_up_recording(2, 4, 20);
  for (std::size_t i = 0; i < recording.messages.size(); ++i)
    recording.messages[i].channel = Id(1 + i / 40);  // 1 in the first two chunks, 2 in the last two
  test::write(recording, path, Compression::lz4);
  const std::vector<ChunkIndex> chunks = Reader(path).chunks();
  Bytes bytes = test::file_bytes(path);
  for (const std::size_t damaged : {0, 1, 3})
    std::fill_n(bytes.begin() + std::ptrdiff_t(chunks[damaged].offset),
                chunks[damaged].length_bytes, std::byte(0));
  test::write_file(path, bytes);
  const Reader reader(path);
  ASSERT_TRUE(reader.is_finished());
  EXPECT_EQ(test::all_messages(reader.messages(chunks[2].start_ns, chunks[2].end_ns)).size(), 20u);
  EXPECT_EQ(test::all_messages(reader.messages(0, chunks[2].end_ns, std::set<Id>{2})).size(), 20u);
  EXPECT_THROW(test::all_messages(reader.messages(0, chunks[2].end_ns)), McapError);
}

}  // namespace
}  // namespace fivepipe::mcap
