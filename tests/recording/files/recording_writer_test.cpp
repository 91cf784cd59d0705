#include "common/recording/files/recording_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <random>

#include "common/recording/files/format.h"
#include "common/recording/mcap/recover.h"
#include "tests/support/recording/synthetic_recordings.h"

namespace fivepipe::recording {
namespace {

using Bytes = std::vector<std::byte>;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

struct Kept {
  std::string topic, writer;
  std::uint32_t sequence;
  std::int64_t log_stamp_ns, source_stamp_ns;
  std::optional<KeyChange> key_change;
  Bytes cdr;
  bool operator==(const Kept&) const = default;
};

std::vector<Kept> all_of(const Recording& recording) {
  std::vector<Kept> all;
  auto cursor = recording.messages();
  while (const auto m = cursor.next())
    all.push_back({m->channel->topic,
                   m->channel->writer,
                   m->sequence,
                   m->log_stamp_ns,
                   m->source_stamp_ns,
                   m->key_change,
                   {m->cdr.begin(), m->cdr.end()}});
  return all;
}

class RecordingWriterTest : public testing::Test {
 protected:
  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "made.mcap";

  // Adds `count` messages of `bytes` bytes, 1 ms apart.
  static void add(RecordingWriter& writer, mcap::Id channel, std::uint32_t count,
                  std::size_t bytes) {
    const Bytes payload(bytes);
    for (std::uint32_t i = 0; i < count; ++i)
      writer.add(channel, kStart_ns + i * 1'000'000, kStart_ns, payload);
  }
};

TEST_F(RecordingWriterTest, RoundTripsAllSampleKindsByWriter) {
  for (const auto compression :
       {mcap::Compression::none, mcap::Compression::lz4, mcap::Compression::zstd}) {
    std::filesystem::remove(path_);
    std::mt19937 random(1);
    std::vector<Kept> expected;
    {
      RecordingWriter writer(path_, "tests", {.compression = compression, .chunk_bytes = 5000});
      writer.attach({1, 2, "deployment/a/b.yaml", "application/yaml", "b"});
      writer.add({kRecordingMetadata, {{"version", "0"}, {kDeploymentFileKey, "a/b.yaml"}}});
      std::vector<mcap::Id> channels;
      for (const char* of : {"one", "other"})
        channels.push_back(
            writer.add_channel("t", test::kFramedType, test::kFramedIdl,
                               {{"writer", of}, {"node", std::string("node ") + of}}));
      std::uint32_t sequences[2] = {}, key_sequences[2] = {};
      for (std::uint32_t i = 0; i < 500; ++i) {
        const std::size_t of = random() % 2;
        const std::int64_t stamp_ns = kStart_ns + i * 1000;
        Bytes payload(random() % 100);
        for (std::byte& byte : payload) byte = std::byte(random());
        std::optional<KeyChange> change;
        if (random() % 5 == 0)
          change = random() % 2 ? KeyChange::disposed : KeyChange::unregistered;
        if (change)
          writer.add(channels[of], stamp_ns, stamp_ns - 7, *change, payload);
        else
          writer.add(channels[of], stamp_ns, stamp_ns - 7, payload);
        expected.push_back({"t", of ? "other" : "one",
                            change ? key_sequences[of]++ : sequences[of]++, stamp_ns, stamp_ns - 7,
                            change, payload});
      }
    }
    const Recording recording(path_);
    EXPECT_TRUE(recording.mcap().is_finished());
    EXPECT_EQ(all_of(recording), expected);
    EXPECT_EQ(recording.start_ns(), kStart_ns);
    EXPECT_EQ(recording.end_ns(), kStart_ns + 499'000);
    EXPECT_EQ(recording.channels().size(), 4u);
    for (const RecordedChannel& channel : recording.channels())
      EXPECT_EQ(channel.node, "node " + channel.writer);
    EXPECT_EQ(recording.metadata(kRecordingMetadata).at("version"), "0");
    const auto counts = recording.metadata(kCountsMetadata);
    const std::uint64_t keys =
        std::uint64_t(std::count_if(expected.begin(), expected.end(),
                                    [](const Kept& kept) { return kept.key_change.has_value(); }));
    EXPECT_EQ(counts.at("t received"), std::to_string(500 - keys));
    EXPECT_EQ(counts.at("t/key_state written"), std::to_string(keys));
    const auto deployment = recording.extract_deployment(folder_.path / "out");
    ASSERT_TRUE(deployment);
    EXPECT_EQ(test::file_bytes(*deployment), Bytes{std::byte('b')});
  }
}

// The open chunk fills the queue, as with a stalled disk, until tick() closes it and it is written.
TEST_F(RecordingWriterTest, OverflowIsDroppedCountedAndLeavesASequenceGap) {
  constexpr std::size_t room_bytes = 100'000;
  RecordingWriter writer(
      path_, "tests",
      {.chunk_bytes = 10 * room_bytes, .chunk_s = 0.1, .max_queued_bytes = room_bytes});
  const mcap::Id channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
  for (std::uint32_t round = 0; round < 3; ++round) {
    for (std::uint32_t i = 0; i < 200; ++i)
      writer.add(channel, kStart_ns + (200 * round + i) * 1'000'000, kStart_ns, Bytes(1000));
    const TopicCounts before = writer.counts().at("t");
    EXPECT_GT(before.lost, 100u * (round + 1));
    writer.tick(kStart_ns + 200 * (round + 1) * 1'000'000);
    for (int waits = 0; writer.counts().at("t").written == before.written && waits < 1000; ++waits)
      usleep(10'000);
  }
  writer.finish();
  const TopicCounts counts = writer.counts().at("t");
  EXPECT_EQ(counts.received, 600u);
  EXPECT_EQ(counts.bytes, 600'000u);
  EXPECT_EQ(counts.written + counts.lost, counts.received);
  EXPECT_GT(counts.written, 3 * 90u);
  const Recording recording(path_);
  EXPECT_EQ(recording.metadata(kCountsMetadata).at("t lost"), std::to_string(counts.lost));
  const auto kept = all_of(recording);
  EXPECT_EQ(kept.size(), counts.written);
  for (const Kept& message : kept)
    EXPECT_EQ(kStart_ns + message.sequence * 1'000'000, message.log_stamp_ns);
}

TEST_F(RecordingWriterTest, FullDiskStopsWritingAndKeepsEarlierChunks) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit limit = before;
  limit.rlim_cur = 300'000;
  RecordingWriter writer(path_, "tests",
                         {.compression = mcap::Compression::none, .chunk_bytes = 20'000});
  const mcap::Id channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
  setrlimit(RLIMIT_FSIZE, &limit);
  add(writer, channel, 1000, 1000);
  writer.finish();
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_FALSE(writer.failure().empty());
  EXPECT_EQ(writer.loss_reason(), writer.failure());
  const TopicCounts counts = writer.counts().at("t");
  EXPECT_EQ(counts.received, 1000u);
  EXPECT_EQ(counts.written + counts.lost, counts.received);
  EXPECT_GT(counts.written, 200u);
  EXPECT_EQ(all_of(Recording(path_)).size(), counts.written);
  // The writer still holds its file.
  const std::filesystem::path copy = path_.string() + ".copy";
  std::filesystem::copy_file(path_, copy);
  EXPECT_FALSE(mcap::recover(copy).was_finished);
  const Recording repaired(copy);
  EXPECT_TRUE(repaired.mcap().is_finished());
  EXPECT_EQ(all_of(repaired).size(), counts.written);
}

TEST_F(RecordingWriterTest, OldChunkIsFlushed) {
  RecordingWriter writer(path_, "tests", {.chunk_s = 0.5});
  const mcap::Id channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
  add(writer, channel, 1, 100);
  writer.tick(kStart_ns + 499'000'000);  // too early
  add(writer, channel, 1, 100);
  writer.tick(kStart_ns + 500'000'000);
  for (int waits = 0; writer.counts().at("t").written < 2 && waits < 1000; ++waits) usleep(10'000);
  EXPECT_EQ(writer.counts().at("t").written, 2u);
  // The file is not finished, as after a crash.
  const Recording recording(path_);
  EXPECT_EQ(all_of(recording).size(), 2u);
  EXPECT_EQ(recording.mcap().chunks().size(), 1u);
}

// The queue holds far more than a disk writes between two calls of why_drop.
TEST_F(RecordingWriterTest, AbortedChunksAreCountedWithReason) {
  RecordingWriter writer(path_, "tests",
                         {.compression = mcap::Compression::zstd, .chunk_bytes = 100'000});
  const mcap::Id channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
  add(writer, channel, 100'000, 1000);
  writer.finish({.why_drop = [] { return std::string("interrupted"); }, .is_over = {}});
  const TopicCounts counts = writer.counts().at("t");
  EXPECT_GT(counts.lost, 0u);
  EXPECT_EQ(counts.written + counts.lost, counts.received);
  EXPECT_EQ(writer.failure(), "");
  const Recording recording(path_);
  EXPECT_TRUE(recording.mcap().is_finished());
  EXPECT_EQ(all_of(recording).size(), counts.written);
  EXPECT_EQ(recording.metadata(kCountsMetadata).at(kLossReasonKey), "interrupted");
}

TEST_F(RecordingWriterTest, MissingCountsAreRecorded) {
  {
    RecordingWriter writer(path_, "tests", {});
    add(writer, writer.add_channel("t", test::kFramedType, test::kFramedIdl, {}), 3, 100);
    writer.add_sent("t", 4, 1);
    writer.add_sent("t", 6, 0);
    EXPECT_EQ(writer.loss_reason(), "");
  }
  const auto counts = Recording(path_).metadata(kCountsMetadata);
  EXPECT_EQ(counts.at("t sent"), "10");
  EXPECT_EQ(counts.at("t missing"), "1");
  EXPECT_FALSE(counts.contains(kLossReasonKey));
}

TEST_F(RecordingWriterTest, RejectsAttachmentPathOutsideFolder) {
  for (const char* name : {"../x", "/tmp/fivepipe_hostile", "a/../../x", ""}) {
    std::filesystem::remove(path_);
    {
      RecordingWriter writer(path_, "tests", {});
      writer.attach({1, 2, std::string(kDeploymentFolder) + name, "", "hostile"});
      writer.add({kRecordingMetadata, {{kDeploymentFileKey, "x"}}});
    }
    const std::filesystem::path out = folder_.path / "deep" / "out";
    EXPECT_THROW(Recording(path_).extract_deployment(out), RecordingError) << name;
    EXPECT_FALSE(std::filesystem::exists(folder_.path / "deep" / "x")) << name;
    EXPECT_FALSE(std::filesystem::exists(folder_.path / "x")) << name;
    EXPECT_FALSE(std::filesystem::exists("/tmp/fivepipe_hostile")) << name;
  }
}

TEST_F(RecordingWriterTest, ReportsTypeDifferences) {
  const std::string own = "fivepipe::v1::TileCosts";
  std::string other = schema::fivepipe_schema(own);
  other.replace(other.find("cost_ms"), 7, "cost_us");
  {
    RecordingWriter writer(path_, "tests", {});
    add(writer,
        writer.add_channel("same", "fivepipe::v1::Command",
                           schema::fivepipe_schema("fivepipe::v1::Command"), {}),
        1, 8);
    add(writer, writer.add_channel("unknown", test::kFramedType, test::kFramedIdl, {}), 1, 8);
    add(writer, writer.add_channel("changed", own, other, {}), 1, 8);
  }
  const Recording recording(path_);
  std::set<mcap::Id> all;
  for (const RecordedChannel& channel : recording.channels()) all.insert(channel.id);
  const auto problems = recording.type_differences(all);
  ASSERT_EQ(problems.size(), 2u);
  EXPECT_NE(problems[0].find("changed: the recorded type " + own), std::string::npos)
      << problems[0];
  EXPECT_NE(problems[0].find("cost_us"), std::string::npos) << problems[0];
  EXPECT_NE(problems[1].find(std::string("unknown: this build does not know its type ") +
                             test::kFramedType),
            std::string::npos)
      << problems[1];
}

// A peer can create any number of writers, each of which takes a channel, and a second one for
// the states of its keys.
TEST_F(RecordingWriterTest, MessagesWithoutAChannelAreCountedAsLost) {
  {
    RecordingWriter writer(path_, "test", {});
    const mcap::Id first = writer.add_channel("topic", "Type", "schema", {});
    add(writer, first, 2, 10);
    while (!writer.is_full()) writer.add_channel("other", "Type", "schema", {});
    EXPECT_THROW(writer.add_channel("other", "Type", "schema", {}), std::length_error);
    writer.add(first, kStart_ns, kStart_ns, KeyChange::disposed, Bytes(10));
    EXPECT_NE(writer.loss_reason().find("65535"), std::string::npos) << writer.loss_reason();
    writer.add_lost("other", 10, "mallory has too many writers");
    add(writer, first, 3, 10);
    writer.finish();
    const auto counts = writer.counts();
    EXPECT_EQ(counts.at("topic").written, 5u);
    EXPECT_EQ(counts.at("topic").lost, 0u);
    EXPECT_EQ(counts.at(std::string("topic") + kKeyStateSuffix).lost, 1u);
    EXPECT_EQ(counts.at("other").received, 1u);
    EXPECT_EQ(counts.at("other").lost, 1u);
    EXPECT_EQ(writer.loss_reason(), "mallory has too many writers");
    EXPECT_TRUE(writer.is_finished());
  }
  EXPECT_EQ(all_of(Recording(path_)).size(), 5u);
}

}  // namespace
}  // namespace fivepipe::recording
