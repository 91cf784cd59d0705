// The exact bytes of repaired files.
#include <gtest/gtest.h>

#include "common/recording/mcap/format/chunk_records.h"
#include "common/recording/mcap/format/records.h"
#include "common/recording/mcap/recover.h"
#include "tests/support/recording/mcap_files.h"

namespace fivepipe::mcap {
namespace {

class McapRepair : public testing::Test {
 protected:
  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "a.mcap";
};

// For every 7th length and every 3rd changed byte of the summary.
TEST_F(McapRepair, ARepairedFileEqualsTheFinishedOne) {
  test::Recording recording = test::made_up_recording(3, 2, 4);
  test::write(recording, path_, Compression::none);
  const Bytes whole = test::file_bytes(path_);
  test::remove_summary(path_);
  const std::size_t data_bytes = std::filesystem::file_size(path_);
  const auto repaired = [&](const Bytes& bytes) {
    test::write_file(path_, bytes);
    const Recovery recovery = recover(path_);
    if (recovery.was_finished) {
      EXPECT_EQ(recovery.damage.summary, "");
      return test::file_bytes(path_) == bytes;
    }
    EXPECT_NE(recovery.damage.summary, "");
    EXPECT_EQ(recovery.damage.damaged_records, 0u);
    EXPECT_EQ(recovery.damage.intact_bytes, data_bytes);
    EXPECT_EQ(recovery.damage.truncated_bytes, bytes.size() - data_bytes);
    EXPECT_EQ(recovery.statistics.messages, 8u);
    return test::file_bytes(path_) == whole;
  };
  EXPECT_TRUE(repaired(whole));
  for (std::size_t size = data_bytes; size < whole.size(); size += 7)
    ASSERT_TRUE(repaired({whole.begin(), whole.begin() + std::ptrdiff_t(size)})) << size;
  for (std::size_t at = data_bytes + kDataEndBytes; at < whole.size(); at += 3) {
    Bytes changed = whole;
    changed[at] ^= std::byte(1);
    ASSERT_TRUE(repaired(changed)) << at;
  }
}

// Otherwise readers would meet the indexes of a chunk that they skip.
TEST_F(McapRepair, ADamagedLastChunkIsCutOffWithItsIndexes) {
  test::Recording recording = test::made_up_recording(6, 2, 20);
  test::write(recording, path_, Compression::lz4, false);
  const std::uint64_t size_bytes = recording.chunk_end_bytes.back();
  std::filesystem::resize_file(path_, size_bytes);
  const ChunkIndex last = Reader(path_).chunks()[1];
  Bytes bytes = test::file_bytes(path_);
  bytes[last.offset + last.length_bytes / 2] ^= std::byte(4);
  test::write_file(path_, bytes);
  const Reader reader(path_);
  EXPECT_EQ(reader.damage().damaged_records, 1u);
  EXPECT_EQ(reader.damage().intact_bytes, last.offset);
  EXPECT_EQ(reader.damage().truncated_bytes, size_bytes - last.offset);
  const Recovery recovery = recover(path_);
  EXPECT_EQ(recovery.statistics.messages, 20u);
  const Bytes repaired = test::file_bytes(path_);
  EXPECT_TRUE(
      std::equal(repaired.begin(), repaired.begin() + std::ptrdiff_t(last.offset), bytes.begin()));
  EXPECT_EQ(Op(repaired[last.offset]), Op::data_end);
}

TEST_F(McapRepair, ARecordWithoutContentAtTheEndIsIntact) {
  Bytes bytes;
  append_magic(bytes);
  { const OpenRecord record(bytes, Op(0x99)); }
  test::write_file(path_, bytes);
  EXPECT_EQ(Reader(path_).damage().intact_bytes, bytes.size());
  bytes.pop_back();
  test::write_file(path_, bytes);
  EXPECT_EQ(Reader(path_).damage().intact_bytes, kMagic.size());
}

TEST_F(McapRepair, MessagesWithoutAChannelAreNotReturned) {
  Bytes bytes;
  append_magic(bytes);
  append_channel(bytes, 1, {0, "t", "cdr", {}});
  for (const Id channel : {5, 1, 5}) append_message(bytes, {channel, 0, 7, 7, {}});
  test::write_file(path_, bytes);
  const Reader reader(path_);
  EXPECT_EQ(reader.damage().orphaned_messages, 2u);
  EXPECT_EQ(test::all_messages(reader.messages()).size(), 1u);
  EXPECT_EQ(test::all_messages(reader.messages(0, 9, std::set<Id>{5})).size(), 0u);
}

TEST_F(McapRepair, ChunksWithoutMessagesAndStoppedOnesAreNotInTheFile) {
  ChunkBuilder builder;
  const Id channel = builder.add_channel({0, "t", "cdr", {}});
  FileWriter writer(path_, Compression::none, "");
  const std::uint64_t header_bytes = writer.bytes_written();
  EXPECT_TRUE(writer.write(builder.take()));
  EXPECT_EQ(writer.bytes_written(), header_bytes);
  builder.add({channel, 0, 1, 1, {}});
  EXPECT_FALSE(writer.write(builder.take(), [] { return true; }));
  EXPECT_EQ(writer.bytes_written(), header_bytes);
  EXPECT_FALSE(writer.finish([] { return true; }));
  EXPECT_FALSE(Reader(path_).is_finished());
  EXPECT_TRUE(writer.finish());
  const Reader reader(path_);
  EXPECT_TRUE(reader.is_finished()) << reader.damage().summary;
  EXPECT_EQ(reader.statistics(), Statistics{});
  EXPECT_TRUE(reader.chunks().empty());
  EXPECT_TRUE(reader.channels().empty());
}

TEST(McapChunkRecords, TheIndexCountsFromTheStartOfTheChunk) {
  ChunkBuilder builder;
  builder.add({builder.add_channel({0, "t", "cdr", {}}), 0, 5, 6, {}});
  const Chunk chunk = builder.take();
  const auto index_behind = [&](std::size_t other_bytes) {
    Bytes to(other_bytes);
    ChunkIndex index = append_chunk(to, chunk, Compression::lz4, 100);
    EXPECT_EQ(index.length_bytes, to.size() - other_bytes);
    append_message_indexes(to, chunk.index, 100 + index.length_bytes, index);
    EXPECT_EQ(index.length_bytes + index.message_index_bytes, to.size() - other_bytes);
    EXPECT_EQ(index.message_index_offsets,
              (std::map<Id, std::uint64_t>{{1, 100 + index.length_bytes}}));
    EXPECT_EQ(index.offset, 100u);
    return std::tuple(index.length_bytes, index.compressed_bytes, index.message_index_bytes);
  };
  EXPECT_EQ(index_behind(50), index_behind(0));
}

}  // namespace
}  // namespace fivepipe::mcap
