// The losses that `fivepipe info` states of damaged files. info_command_test.cpp tests the command.
#include "launch/inspect/recording_info.h"

#include <gtest/gtest.h>

#include "common/recording/files/format.h"
#include "tests/support/recording/mcap_files.h"
#include "tests/support/text.h"

namespace fivepipe::launch {
namespace {

constexpr std::uint64_t kStart_ns = 1'700'000'000'000'000'000;
const std::string kTopic = "fivepipe/v1/Thing";

// Ten chunks of ten messages each, and the counts of the recorder, which had received 130 messages
// and dropped 10 of them in the middle.
class LossesOfDamagedRecordings : public testing::Test {
 protected:
  void write(bool finishes) {
    mcap::FileWriter writer(file_, mcap::Compression::none, "");
    mcap::ChunkBuilder builder;
    const mcap::Id schema = builder.add_schema({"Thing", recording::kSchemaEncoding, kIdl});
    const mcap::Id channel =
        builder.add_channel({schema, kTopic, recording::kMessageEncoding, {{"node", "n"}}});
    const mcap::Bytes payload(8);
    for (std::uint32_t i = 0; i < 100; ++i) {
      builder.add({channel, i < 50 ? i : i + 10, kStart_ns + i, kStart_ns + i, payload});
      if (i % 10 < 9) continue;
      chunk_bytes_.push_back(writer.bytes_written());
      writer.write(builder.take());
    }
    std::map<std::string, std::string> counts{
        {kTopic + " received", "130"},
        {kTopic + " written", "100"},
        {kTopic + " lost", "10"},
        {recording::kCountsStampKey, std::to_string(kStart_ns)}};
    writer.add(mcap::Metadata{recording::kCountsSoFarMetadata, counts});
    if (!finishes) return;
    counts_byte_ = writer.bytes_written();
    writer.add(mcap::Metadata{recording::kCountsMetadata, counts});
    writer.finish();
  }
  void damage(std::uint64_t byte) {
    mcap::Bytes bytes = test::file_bytes(file_);
    bytes.at(byte) ^= std::byte(0x55);
    test::write_file(file_, bytes);
  }
  std::string info(bool reads_all = true) const {
    return text_of(inspect(recording::Recording(file_), reads_all));
  }

  static constexpr const char* kIdl = "struct Thing { unsigned long long n; };";
  const test::TestFolder folder_;
  const std::filesystem::path file_ = folder_.path / "damaged.mcap";
  std::vector<std::uint64_t> chunk_bytes_;
  std::uint64_t counts_byte_ = 0;
};

TEST_F(LossesOfDamagedRecordings, TheIndexAndTheMessagesAreDescribed) {
  write(true);
  for (const bool reads_all : {true, false}) {
    const RecordingInfo info = inspect(recording::Recording(file_), reads_all);
    EXPECT_EQ(info.file, file_.string());
    EXPECT_EQ(info.file_bytes, std::filesystem::file_size(file_));
    EXPECT_TRUE(info.finished() && info.intact());
    EXPECT_EQ(info.read_all, reads_all);
    EXPECT_EQ(info.start_ns, std::int64_t(kStart_ns));
    EXPECT_EQ(info.end_ns, std::int64_t(kStart_ns) + 99);
    EXPECT_EQ(info.messages, 100u);
    EXPECT_EQ(info.chunks, (std::map<std::string, std::uint64_t>{{"", 10}}));
    EXPECT_GT(info.uncompressed_bytes, 100u * 8);
    EXPECT_EQ(info.compressed_bytes, info.uncompressed_bytes);
    ASSERT_EQ(info.topics.size(), 1u);
    const TopicInfo& topic = info.topics[0];
    EXPECT_EQ(topic.topic + " " + topic.type, kTopic + " Thing");
    EXPECT_EQ(topic.messages, 100u);
    EXPECT_EQ(topic.key_changes, 0u);
    EXPECT_NEAR(topic.rate_hz, 100 / 99e-9, 1);
    EXPECT_EQ(topic.bytes, reads_all ? 800u : 0u);
    EXPECT_EQ(topic.missing, reads_all ? 10u : 0u);
    EXPECT_EQ(topic.writers, std::set<std::string>{"n"});
    ASSERT_TRUE(info.counts);
    const RecorderCounts& counts = info.counts->at(kTopic);
    EXPECT_EQ(
        (std::vector{counts.received, counts.written, counts.lost, counts.sent, counts.missing}),
        (std::vector<std::uint64_t>{130, 100, 10, 0, 0}));
    EXPECT_FALSE(info.counts_stamp_ns) << "the counts are final";
    EXPECT_FALSE(info.final_counts_damaged);
  }
}

TEST_F(LossesOfDamagedRecordings, MessagesOfADamagedChunkDidNotWaitForTheDisk) {
  write(false);
  EXPECT_TRUE(test::contains(info(),
                             "20 of 130 received messages are not in the file: they waited for the "
                             "disk\n"))
      << info();
  damage(chunk_bytes_[3] + 100);
  damage(chunk_bytes_[5] + 100);
  const std::string text = info();
  EXPECT_TRUE(test::contains(text, "DAMAGED")) << text;
  EXPECT_TRUE(
      test::contains(text, "30 messages missing, according to gaps in the sequence numbers"))
      << text;
  EXPECT_TRUE(test::contains(text,
                             "20 of 130 received messages are not in the file: they waited for the "
                             "disk or are in damaged chunks\n"))
      << text;
  EXPECT_TRUE(test::contains(text, "because the recorder did not end")) << text;
}

TEST_F(LossesOfDamagedRecordings, ADamagedRecordOfTheFinalCountsIsNamed) {
  write(true);
  EXPECT_FALSE(test::contains(info(), "later ones are unknown")) << info();
  constexpr std::uint64_t kRecordHeaderBytes = 9;
  damage(counts_byte_ + kRecordHeaderBytes + 1);  // length of the name
  const std::string text = info();
  EXPECT_TRUE(test::contains(text, "20 of 130 received messages are not in the file\n")) << text;
  EXPECT_TRUE(test::contains(text, "known until 2023-11-1")) << text;
  EXPECT_TRUE(test::contains(text, "later ones are unknown, because the final counts are damaged"))
      << text;
}

}  // namespace
}  // namespace fivepipe::launch
