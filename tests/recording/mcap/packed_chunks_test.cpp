// A writer keeps the chunk indexes of its file in little memory, without loss.
#include <gtest/gtest.h>

#include <malloc.h>

#include <random>

#include "common/recording/mcap/file_writer.h"
#include "common/recording/mcap/format/packed_chunks.h"
#include "common/recording/mcap/reader.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_folder.h"

namespace fivepipe::mcap {
namespace {

bool are_equal(const ChunkIndex& a, const ChunkIndex& b) {
  return a.start_ns == b.start_ns && a.end_ns == b.end_ns && a.offset == b.offset &&
         a.length_bytes == b.length_bytes && a.message_index_offsets == b.message_index_offsets &&
         a.message_index_bytes == b.message_index_bytes && a.compression == b.compression &&
         a.compressed_bytes == b.compressed_bytes && a.uncompressed_bytes == b.uncompressed_bytes &&
         a.unchunked == b.unchunked;
}

TEST(PackedChunks, UnpacksWhatWasAdded) {
  std::mt19937_64 random(3);
  // Numbers of every length, the shortest and the longest too.
  const auto number = [&] { return random() >> (random() % 64); };
  std::vector<ChunkIndex> chunks(500);
  PackedChunks packed("zstd");
  EXPECT_TRUE(packed.unpacked().empty());
  std::uint64_t end = 0;
  for (ChunkIndex& chunk : chunks) {
    chunk.start_ns = number();
    chunk.end_ns = number();  // also before the start, as damaged stamps may be
    chunk.offset = end + number() % 1'000'000;
    chunk.length_bytes = number() % 1'000'000;
    end = chunk.offset + chunk.length_bytes;
    chunk.message_index_bytes = number();
    chunk.compressed_bytes = number();
    chunk.uncompressed_bytes = number();
    chunk.compression = "zstd";
    for (std::uint64_t n = random() % 4, at = end; n > 0; --n)
      chunk.message_index_offsets[Id(random())] = at += random() % 1000;
    packed.add(chunk);
  }
  const std::vector<ChunkIndex> unpacked = packed.unpacked();
  ASSERT_EQ(unpacked.size(), chunks.size());
  for (std::size_t i = 0; i < chunks.size(); ++i)
    EXPECT_TRUE(are_equal(unpacked[i], chunks[i])) << i;
}

TEST(PackedChunks, AWriterKeepsAHundredBytesPerChunk) {
  if (test::kHasSanitizer) GTEST_SKIP() << "the sanitizer replaces the allocator";
  constexpr int kChannels = 20, kChunks = 3000;
  const test::TestFolder folder;
  ChunkBuilder builder;
  FileWriter writer(folder.path / "long.mcap", Compression::none, "test");
  std::vector<Id> channels;
  for (int i = 0; i < kChannels; ++i) {
    Channel channel;
    channel.topic = "topic " + std::to_string(i);
    channels.push_back(builder.add_channel(channel));
  }
  const std::vector<std::byte> payload(40);
  std::uint64_t stamp_ns = 1'800'000'000'000'000'000;
  const auto write_chunks = [&](int count) {
    for (int n = 0; n < count; ++n) {
      for (int i = 0; i < 15 * kChannels; ++i) {
        Message message;
        message.channel = channels[std::size_t(i % kChannels)];
        message.log_stamp_ns = message.publish_stamp_ns = stamp_ns += 1'666'667;
        message.payload = payload;
        builder.add(message);
      }
      ASSERT_TRUE(writer.write(builder.take()));
    }
  };
  write_chunks(100);
  const std::size_t before = mallinfo2().uordblks;
  write_chunks(kChunks);
  const double per_chunk = double(mallinfo2().uordblks - before) / kChunks;
  EXPECT_GT(per_chunk, 20);
  EXPECT_LT(per_chunk, 130);
  ASSERT_TRUE(writer.finish());
  const Reader reader(folder.path / "long.mcap");
  EXPECT_TRUE(reader.is_finished());
  ASSERT_EQ(reader.chunks().size(), 100u + kChunks);
  EXPECT_EQ(reader.chunks().back().message_index_offsets.size(), std::size_t(kChannels));
}

}  // namespace
}  // namespace fivepipe::mcap
