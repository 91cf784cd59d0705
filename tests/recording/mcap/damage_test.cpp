// Truncated, damaged and hostile files.
#include <gtest/gtest.h>

#include "common/recording/mcap/format/summary_section.h"
#include "tests/support/recording/mcap_mutations.h"

namespace fivepipe::mcap {
namespace {

class McapDamage : public testing::Test {
 protected:
  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "a.mcap", other_ = folder_.path / "b.mcap";

  // Number of messages in the chunks whose records end at or before `cut_bytes`.
  static std::size_t messages_up_to(const test::Recording& recording,
                                    const std::vector<ChunkIndex>& chunks,
                                    std::uint64_t cut_bytes) {
    std::size_t messages = 0;
    for (std::size_t i = 0; i < chunks.size(); ++i)
      if (chunks[i].offset + chunks[i].length_bytes <= cut_bytes)
        messages = recording.chunk_ends[i];
    return messages;
  }
};

TEST_F(McapDamage, TruncatedFileKeepsCompleteChunksAndCanBeRepaired) {
  std::mt19937 random(21);
  for (std::uint32_t cut = 0; cut < 200; ++cut) {
    const std::size_t chunks_count = 1 + random() % 6;
    test::Recording recording = test::made_up_recording(cut, chunks_count, 1 + random() % 30);
    test::write(recording, path_, Compression(cut % 3));
    const std::vector<ChunkIndex> chunks = Reader(path_).chunks();
    const std::uint64_t size_bytes = std::filesystem::file_size(path_),
                        cut_bytes = random() % size_bytes;
    std::filesystem::resize_file(path_, cut_bytes);
    if (cut_bytes < kMagic.size()) {
      EXPECT_THROW(Reader{path_}, McapError);
      EXPECT_THROW(recover(path_), McapError);
      continue;
    }
    const auto whole = std::vector(
        recording.messages.begin(),
        recording.messages.begin() + std::ptrdiff_t(messages_up_to(recording, chunks, cut_bytes)));
    const Reader reader(path_);
    EXPECT_FALSE(reader.is_finished());
    EXPECT_EQ(reader.damage().damaged_records, 0u);
    EXPECT_EQ(reader.damage().intact_bytes + reader.damage().truncated_bytes, cut_bytes);
    EXPECT_EQ(test::all_messages(reader.messages()), whole)
        << "cut after " << cut_bytes << " of " << size_bytes;
    EXPECT_EQ(test::violated_invariant(path_, other_), "");
    recover(path_);
    const Reader repaired(path_);
    EXPECT_TRUE(repaired.is_finished()) << repaired.damage().summary;
    EXPECT_EQ(test::all_messages(repaired.messages()), whole);
    EXPECT_TRUE(recover(path_).was_finished);
  }
}

TEST_F(McapDamage, ReadsFileTruncatedAtEveryByte) {
  test::Recording recording = test::made_up_recording(5, 2, 3);
  test::write(recording, path_, Compression::lz4);
  const std::vector<ChunkIndex> chunks = Reader(path_).chunks();
  for (std::uint64_t cut_bytes = std::filesystem::file_size(path_) - 1; cut_bytes >= kMagic.size();
       --cut_bytes) {
    std::filesystem::resize_file(path_, cut_bytes);
    ASSERT_EQ(test::all_messages(Reader(path_).messages()).size(),
              messages_up_to(recording, chunks, cut_bytes))
        << cut_bytes;
    ASSERT_EQ(test::violated_invariant(path_, other_), "") << cut_bytes;
  }
}

TEST_F(McapDamage, RandomDamagePreservesInvariants) {
  std::mt19937 random(22);
  std::vector<Bytes> files;
  for (std::uint32_t seed = 0; seed < 6; ++seed) {
    test::Recording recording = test::made_up_recording(seed, 3, 8);
    test::write(recording, path_, Compression(seed % 3), seed < 3);
    files.push_back(test::file_bytes(path_));
  }
  for (int i = 0; i < 4000; ++i) {
    Bytes bytes = files[random() % files.size()];
    for (std::uint32_t mutations = 1 + random() % 4; mutations > 0; --mutations)
      test::mutate(bytes, random);
    if (random() % 2 == 0) test::make_crcs_fit(bytes);
    test::write_file(path_, bytes);
    ASSERT_EQ(test::violated_invariant(path_, other_), "") << "mutation " << i;
  }
}

TEST_F(McapDamage, DamagedChunkIsReportedAndSkipped) {
  for (const Compression compression : {Compression::none, Compression::lz4, Compression::zstd}) {
    test::Recording recording = test::made_up_recording(6, 3, 20);
    test::write(recording, path_, compression);
    const ChunkIndex chunk = Reader(path_).chunks()[1];
    Bytes bytes = test::file_bytes(path_);
    bytes[chunk.offset + chunk.length_bytes / 2] ^= std::byte(4);
    test::write_file(path_, bytes);
    Cursor cursor = Reader(path_).messages();
    for (int i = 0; i < 20; ++i) ASSERT_EQ(cursor.next()->sequence, std::uint32_t(i));
    try {
      cursor.next();
      FAIL() << "the damage was not found";
    } catch (const McapError& error) {
      EXPECT_NE(std::string(error.what())
                    .find(path_.string() + ": byte " + std::to_string(chunk.offset) + ":"),
                std::string::npos)
          << error.what();
    }
    for (int i = 40; i < 60; ++i) ASSERT_EQ(cursor.next()->sequence, std::uint32_t(i));
    EXPECT_FALSE(cursor.next());

    test::remove_summary(path_);
    const Reader scanned(path_);
    EXPECT_FALSE(scanned.is_finished());
    ASSERT_EQ(scanned.damage().damaged_records, 1u);
    EXPECT_NE(scanned.damage().damage_reports.at(0).find(std::to_string(chunk.offset)),
              std::string::npos);
    EXPECT_EQ(test::all_messages(scanned.messages()).size(), 40u);
  }
}

// The repaired file equals the repair of the untruncated file byte for byte.
TEST_F(McapDamage, TruncatedLastIndexIsRebuilt) {
  test::Recording recording = test::made_up_recording(12, 2, 20);
  test::write(recording, path_, Compression::lz4, false);
  const ChunkIndex last = Reader(path_).chunks()[1];
  const std::uint64_t index_end = last.offset + last.length_bytes + last.message_index_bytes;
  std::filesystem::resize_file(path_, index_end);
  recover(path_);
  const Bytes uncut = test::file_bytes(path_);
  for (std::uint64_t cut_bytes = last.offset + last.length_bytes; cut_bytes < index_end;
       ++cut_bytes) {
    test::write_file(path_, ByteView(uncut).first(cut_bytes));
    recover(path_);
    ASSERT_EQ(test::file_bytes(path_), uncut) << cut_bytes;
  }
}

// A power cut can leave a file with its full length but without its last blocks.
TEST_F(McapDamage, TrailingZerosAreTruncated) {
  test::Recording recording = test::made_up_recording(7, 3, 20);
  test::write(recording, path_, Compression::zstd, false);
  const ChunkIndex last = Reader(path_).chunks()[2];
  Bytes bytes = test::file_bytes(path_);
  std::fill(bytes.begin() + std::ptrdiff_t(last.offset + last.length_bytes / 2), bytes.end(),
            std::byte(0));
  test::write_file(path_, bytes);
  const Recovery recovery = recover(path_);
  EXPECT_EQ(recovery.statistics.messages, 40u);
  EXPECT_LE(recovery.damage.intact_bytes, last.offset);
  EXPECT_EQ(test::all_messages(Reader(path_).messages()).size(), 40u);
}

TEST_F(McapDamage, DetectsDamagedAttachment) {
  test::Recording recording = test::made_up_recording(8, 1, 5);
  test::write(recording, path_, Compression::none);
  const AttachmentIndex attachment = Reader(path_).attachments()[0];
  Bytes bytes = test::file_bytes(path_);
  bytes[attachment.offset + attachment.length_bytes - 6] ^= std::byte(1);
  test::write_file(path_, bytes);
  const Reader reader(path_);
  EXPECT_THROW(reader.read(reader.attachments()[0]), McapError);
}

TEST_F(McapDamage, DamagedSummaryFallsBackToScan) {
  test::Recording recording = test::made_up_recording(9, 2, 10);
  test::write(recording, path_, Compression::lz4);
  Bytes bytes = test::file_bytes(path_);
  bytes[bytes.size() - 200] ^= std::byte(1);
  test::write_file(path_, bytes);
  const Reader reader(path_);
  EXPECT_FALSE(reader.is_finished());
  EXPECT_NE(reader.damage().summary.find("CRC"), std::string::npos) << reader.damage().summary;
  EXPECT_EQ(test::all_messages(reader.messages()), recording.messages);
}

// Otherwise a small file that indexes one chunk a million times would take unlimited time to read.
TEST_F(McapDamage, SummaryWithInvalidOffsetsIsRejected) {
  test::Recording recording = test::made_up_recording(13, 2, 10);
  test::write(recording, path_, Compression::lz4, false);
  const Bytes data = test::file_bytes(path_);
  const Summary good = scan(File(path_)).summary;
  const auto is_relied_on = [&](const Summary& summary) {
    Bytes bytes = data;
    append(bytes, ByteView(end_of_file(summary, data.size(), 0)));
    test::write_file(path_, bytes);
    const Reader reader(path_);
    EXPECT_EQ(test::all_messages(reader.messages()), recording.messages);
    return reader.is_finished();
  };
  EXPECT_TRUE(is_relied_on(good));
  Summary twice = good;
  twice.chunks.push_back(good.chunks[0]);
  count_records(twice);
  EXPECT_FALSE(is_relied_on(twice));
  Summary beyond = good;
  beyond.chunks[1].length_bytes += 100'000;
  EXPECT_FALSE(is_relied_on(beyond));
  Summary fewer = good;
  fewer.chunks.pop_back();
  EXPECT_FALSE(is_relied_on(fewer));
}

TEST_F(McapDamage, ChunkWithTooManySchemasIsDamaged) {
  ChunkBuilder builder;
  const Id schema = builder.add_schema({"S", "omgidl", std::string(kMaxDefinitionBytes, ' ')});
  builder.add({builder.add_channel({schema, "t", "cdr", {}}), 0, 0, 0, {}});
  FileWriter(path_, Compression::lz4, "").write(builder.take());
  EXPECT_EQ(Reader(path_).damage().damaged_records, 1u);
}

TEST_F(McapDamage, ChunkWithImpossibleSizeIsRejected) {
  test::Recording recording = test::made_up_recording(10, 1, 10);
  for (const Compression compression : {Compression::none, Compression::lz4, Compression::zstd})
    for (const std::uint64_t claimed_bytes :
         {std::uint64_t(1) << 30, (std::uint64_t(1) << 30) + 1, std::uint64_t(1) << 62}) {
      test::write(recording, path_, compression, false);
      const ChunkIndex chunk = Reader(path_).chunks()[0];
      Bytes bytes = test::file_bytes(path_);
      test::put(bytes, chunk.offset + kRecordHeaderBytes + 16, claimed_bytes);
      test::write_file(path_, bytes);
      const Reader reader(path_);
      EXPECT_EQ(reader.statistics().messages, 0u);
      EXPECT_EQ(reader.damage().damaged_records, 1u);
    }
}

TEST_F(McapDamage, RepairsACopy) {
  test::Recording recording = test::made_up_recording(11, 2, 10);
  test::write(recording, path_, Compression::zstd, false);
  const Bytes before = test::file_bytes(path_);
  EXPECT_EQ(recover(path_, other_).statistics.messages, 20u);
  EXPECT_EQ(test::file_bytes(path_), before);
  EXPECT_TRUE(Reader(other_).is_finished());
}

}  // namespace
}  // namespace fivepipe::mcap
