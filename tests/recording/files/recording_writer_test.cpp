#include "common/recording/files/recording_writer.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <random>

#include "common/recording/files/format.h"
#include "common/recording/mcap/recover.h"
#include "tests/support/process/file_size_limit.h"
#include "tests/support/recording/synthetic_recordings.h"

namespace fivepipe::recording {
namespace {

using Bytes = std::vector<std::byte>;

using test::kStart_ns;

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

TEST_F(RecordingWriterTest, ReportsTheFinishedFile) {
  RecordingWriter writer(path_, "tests", {});
  EXPECT_FALSE(writer.is_finished());
  EXPECT_FALSE(writer.is_synced());
  const mcap::Id channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
  EXPECT_EQ(writer.counts().at("t").received, 0u);
  writer.add_channel("unused", test::kFramedType, test::kFramedIdl, {});
  Bytes key(300, std::byte(1));
  writer.add(channel, kStart_ns, kStart_ns, KeyChange::unregistered, key);
  add(writer, channel, 2, 100);
  writer.finish();
  EXPECT_TRUE(writer.is_finished());
  EXPECT_TRUE(writer.is_synced());
  EXPECT_EQ(writer.bytes_written(), std::filesystem::file_size(path_));
  EXPECT_EQ(writer.loss_reason(), "");
  EXPECT_EQ(writer.failure(), "");
  const Recording recording(path_);
  EXPECT_EQ(all_of(recording).at(0).cdr, key);
  EXPECT_EQ(recording.metadata(kCountsMetadata),
            (std::map<std::string, std::string>{{"t received", "2"},
                                                {"t written", "2"},
                                                {"t lost", "0"},
                                                {"t/key_state received", "1"},
                                                {"t/key_state written", "1"},
                                                {"t/key_state lost", "0"},
                                                {"unused received", "0"},
                                                {"unused written", "0"},
                                                {"unused lost", "0"}}));
  EXPECT_EQ(writer.counts().at("t").bytes, 200u);
  EXPECT_EQ(writer.counts().at("t/key_state").bytes, 300u + 12);
  RecordingWriter fast(folder_.path / "fast.mcap", "tests", {.sync = false});
  fast.finish();
  EXPECT_TRUE(fast.is_finished());
  EXPECT_FALSE(fast.is_synced());
}

TEST_F(RecordingWriterTest, LimitsAreInclusive) {
  const Bytes payload(100);
  const auto counts_with = [&](const WriterOptions& options, int messages) {
    std::filesystem::remove(path_);
    RecordingWriter writer(path_, "tests", options);
    const mcap::Id channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
    for (int i = 0; i < messages; ++i) writer.add(channel, kStart_ns, kStart_ns, payload);
    const std::string early_reason = writer.loss_reason();
    EXPECT_EQ(early_reason, writer.counts().at("t").lost ? "the disk was too slow" : "");
    writer.finish();
    return writer.counts().at("t");
  };
  EXPECT_EQ(counts_with({.max_queued_bytes = 100}, 1).lost, 0u);
  EXPECT_EQ(counts_with({.max_queued_bytes = 99}, 1).lost, 1u);
  // The size of the open chunk with one message.
  mcap::ChunkBuilder builder;
  const mcap::Id schema =
      builder.add_schema({test::kFramedType, kSchemaEncoding, test::kFramedIdl});
  builder.add({builder.add_channel({schema, "t", kMessageEncoding, {}}), 0, 0, 0, payload});
  const std::size_t open_bytes = builder.size_bytes();
  EXPECT_EQ(counts_with({.max_queued_bytes = open_bytes + 100}, 2).lost, 0u);
  EXPECT_EQ(counts_with({.max_queued_bytes = open_bytes + 99}, 2).lost, 1u);
  const auto chunks = [&] { return Recording(path_).mcap().chunks().size(); };
  counts_with({.chunk_bytes = open_bytes}, 2);
  EXPECT_EQ(chunks(), 2u);
  counts_with({.chunk_bytes = open_bytes + 1}, 2);
  EXPECT_EQ(chunks(), 1u);
}

TEST(WriterOptions, BoundTheLossesOfACrash) {
  const WriterOptions options;
  EXPECT_EQ(options.compression, mcap::Compression::lz4);
  EXPECT_EQ(options.chunk_bytes, 2u << 20);
  EXPECT_EQ(options.chunk_s, 0.5);
  EXPECT_EQ(options.counts_s, 2);
  EXPECT_TRUE(options.sync);
  EXPECT_EQ(options.max_queued_bytes, 256u << 20);
}

class RecordingTest : public RecordingWriterTest {
 protected:
  // Writes one message on each channel, as another program may.
  void write(const std::vector<mcap::Schema>& schemas, const std::vector<mcap::Channel>& channels,
             const Bytes& payload) {
    std::filesystem::remove(path_);
    mcap::ChunkBuilder builder;
    for (const mcap::Schema& schema : schemas) builder.add_schema(schema);
    for (const mcap::Channel& channel : channels)
      builder.add({builder.add_channel(channel), 3, 1, 2, payload});
    mcap::FileWriter writer(path_, mcap::Compression::none, "");
    writer.write(builder.take());
    writer.finish();
  }
  template <class Callable>
  std::string error_of(Callable&& call) {
    try {
      call();
    } catch (const RecordingError& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(RecordingTest, ARangeIncludesItsEnds) {
  {
    RecordingWriter writer(path_, "tests", {});
    const mcap::Id channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
    const mcap::Id other = writer.add_channel("u", test::kFramedType, test::kFramedIdl, {});
    for (const std::int64_t stamp_ns : {0, 10, 20, 30}) writer.add(channel, stamp_ns, 0, Bytes(1));
    writer.add(other, 15, 0, Bytes(1));
  }
  const Recording recording(path_);
  const mcap::Id channel = recording.channels().at(0).id;
  const auto stamps_ns = [&](std::int64_t start_ns, std::int64_t end_ns) {
    std::vector<std::int64_t> found_ns;
    auto cursor = recording.messages(start_ns, end_ns, {channel});
    while (const auto message = cursor.next()) found_ns.push_back(message->log_stamp_ns);
    return found_ns;
  };
  using Stamps = std::vector<std::int64_t>;
  EXPECT_EQ(stamps_ns(10, 20), (Stamps{10, 20}));
  EXPECT_EQ(stamps_ns(11, 19), Stamps{});
  EXPECT_EQ(stamps_ns(-5, 10), (Stamps{0, 10}));
  EXPECT_EQ(stamps_ns(21, INT64_MAX), Stamps{30});
  EXPECT_EQ(stamps_ns(-5, -1), Stamps{0}) << "before 1970";
}

TEST_F(RecordingTest, DescribesChannelsOfOtherPrograms) {
  write({{"Type", "other", "?"}},
        {{0, "a", "json", {}}, {1, "b/key_state", "cdr", {{"node", "n"}}}}, Bytes(3));
  const Recording recording(path_);
  ASSERT_EQ(recording.channels().size(), 2u);
  const RecordedChannel &a = recording.channels()[0], &b = recording.channels()[1];
  EXPECT_EQ(a.topic + a.type + a.writer + a.node, "a");
  EXPECT_FALSE(a.key_states);
  EXPECT_EQ(a.messages, 1u);
  EXPECT_EQ(b.topic, "b");
  EXPECT_EQ(b.type, "Type");
  EXPECT_EQ(b.node, "n");
  EXPECT_TRUE(b.key_states);
  EXPECT_EQ(b.messages, 1u);
  EXPECT_EQ(recording.channel(a.id), &a);
  EXPECT_EQ(recording.channel(b.id), &b);
  EXPECT_EQ(recording.channel(99), nullptr);
  EXPECT_EQ(recording.start_ns(), 1);
  EXPECT_EQ(recording.end_ns(), 1);
  // The key state has a payload that fivepipe does not write.
  auto cursor = recording.messages();
  const auto message = cursor.next();
  ASSERT_TRUE(message);
  EXPECT_EQ(message->channel, &a);
  EXPECT_EQ(message->sequence, 3u);
  EXPECT_EQ(message->source_stamp_ns, 2);
  EXPECT_FALSE(cursor.next());
  const std::string where = path_.string() + ": topic ";
  EXPECT_EQ(error_of([&] { recording.idl(a); }), where + "a: the topic has no schema");
  EXPECT_EQ(error_of([&] { recording.idl(b); }),
            where + "b: the schema's encoding is 'other', not omgidl");
  write({{"Type", kSchemaEncoding, "?"}}, {{1, "c", "cdr", {}}}, Bytes(3));
  const Recording unreadable(path_);
  EXPECT_EQ(error_of([&] { unreadable.idl(unreadable.channels()[0]); }),
            where + "c: line 1, column 1: unexpected character '?'");
}

TEST_F(RecordingTest, TheNewestMetadataOfANameCounts) {
  {
    RecordingWriter writer(path_, "tests", {});
    for (const char* value : {"old", "new"}) writer.add({"name", {{"key", value}}});
    writer.add({"other", {{"key", "other"}}});
  }
  const Recording recording(path_);
  EXPECT_EQ(recording.metadata("name"), (std::map<std::string, std::string>{{"key", "new"}}));
  EXPECT_TRUE(recording.metadata("none").empty());
}

TEST_F(RecordingTest, ExtractsOnlyTheFilesOfTheDeployment) {
  const auto extracted = [&](const std::string& deployment) {
    std::filesystem::remove(path_);
    {
      RecordingWriter writer(path_, "tests", {});
      writer.attach({1, 2, std::string(kDeploymentFolder) + "x/..y", "", "content"});
      writer.attach({1, 2, "notes", "", "other"});
      writer.add({kRecordingMetadata, {{kDeploymentFileKey, deployment}}});
    }
    return Recording(path_).extract_deployment(folder_.path / "out");
  };
  EXPECT_EQ(extracted("x/..y"), folder_.path / "out" / "x/..y");
  EXPECT_EQ(test::file_bytes(folder_.path / "out" / "x/..y").size(), 7u);
  EXPECT_FALSE(std::filesystem::exists(folder_.path / "out" / "notes"));
  EXPECT_EQ(extracted(""), std::nullopt);
  for (const char* missing : {"z", "../made.mcap", "x/../../made.mcap"})
    EXPECT_EQ(error_of([&] { extracted(missing); }),
              path_.string() + ": the attachments lack its deployment file " + missing);
  std::filesystem::remove_all(folder_.path / "out");
  std::filesystem::create_directories(folder_.path / "out" / "x" / "..y");
  EXPECT_EQ(error_of([&] { extracted("x/..y"); }),
            (folder_.path / "out" / "x/..y").string() + " cannot be written");
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
  EXPECT_EQ(writer.loss_reason(), "the disk was too slow");
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
  RecordingWriter writer(path_, "tests",
                         {.compression = mcap::Compression::none, .chunk_bytes = 20'000});
  const mcap::Id channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
  {
    const test::FileSizeLimit limit(300'000);
    add(writer, channel, 1000, 1000);
    writer.finish();
  }
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
    EXPECT_EQ(counts.at("other").bytes, 10u);
    EXPECT_EQ(counts.at("topic").bytes, 50u);
    EXPECT_EQ(writer.loss_reason(), "mallory has too many writers");
    EXPECT_TRUE(writer.is_finished());
  }
  EXPECT_EQ(all_of(Recording(path_)).size(), 5u);
}

}  // namespace
}  // namespace fivepipe::recording
