// Reads MCAP files that this library wrote.
#include <gtest/gtest.h>

#include <functional>
#include <system_error>

#include "common/recording/mcap/format/compression.h"
#include "common/recording/mcap/recover.h"
#include "tests/support/recording/mcap_files.h"

namespace fivepipe::mcap {
namespace {

class McapRoundTrip : public testing::TestWithParam<Compression> {
 protected:
  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "a.mcap";
};

TEST_P(McapRoundTrip, RoundTripsAllRecords) {
  test::Recording recording = test::made_up_recording(1, 5, 100);
  test::write(recording, path_, GetParam());
  const Reader reader(path_);
  EXPECT_TRUE(reader.is_finished()) << reader.damage().summary;
  EXPECT_EQ(reader.header().library, "fivepipe tests");
  EXPECT_EQ(reader.header().profile, "made up");
  EXPECT_EQ(test::all_messages(reader.messages()), recording.messages);
  EXPECT_EQ(reader.schemas(), (std::map<Id, Schema>{{1, recording.schema}}));
  ASSERT_EQ(reader.channels().size(), 3u);
  EXPECT_EQ(reader.channels().at(1), (Channel{1, "things/a", "cdr", {{"qos", "reliable"}}}));
  EXPECT_EQ(reader.channels().at(3), (Channel{0, "notes", "json", {}}));
  ASSERT_EQ(reader.attachments().size(), 1u);
  const Attachment attachment = reader.read(reader.attachments()[0]);
  EXPECT_EQ(attachment.name, "rig.yaml");
  EXPECT_EQ(attachment.media_type, "text/yaml");
  EXPECT_EQ(attachment.content, recording.attachment.content);
  EXPECT_EQ(attachment.log_stamp_ns, 5u);
  EXPECT_EQ(attachment.create_stamp_ns, 6u);
  EXPECT_EQ(reader.attachments()[0].content_bytes, recording.attachment.content.size());
  ASSERT_EQ(reader.metadata().size(), 1u);
  EXPECT_EQ(reader.read(reader.metadata()[0]).values, recording.metadata.values);
}

TEST_P(McapRoundTrip, StatisticsMatchContent) {
  test::Recording recording = test::made_up_recording(2, 4, 50);
  test::write(recording, path_, GetParam());
  const Reader reader(path_);
  Statistics expected{200,
                      1,
                      3,
                      1,
                      1,
                      4,
                      recording.messages.front().log_stamp_ns,
                      recording.messages.back().log_stamp_ns,
                      {}};
  for (const test::OwnMessage& message : recording.messages)
    ++expected.channel_messages[message.channel];
  EXPECT_EQ(reader.statistics(), expected);
  test::remove_summary(path_);
  EXPECT_EQ(Reader(path_).statistics(), expected) << "found by a scan";
}

TEST_P(McapRoundTrip, UnfinishedFileIsReadAndRepaired) {
  test::Recording recording = test::made_up_recording(3, 4, 50);
  test::write(recording, path_, GetParam(), false);
  const Reader unfinished(path_);
  EXPECT_FALSE(unfinished.is_finished());
  EXPECT_EQ(test::all_messages(unfinished.messages()), recording.messages);
  EXPECT_FALSE(recover(path_).was_finished);
  const Reader repaired(path_);
  EXPECT_TRUE(repaired.is_finished()) << repaired.damage().summary;
  EXPECT_EQ(test::all_messages(repaired.messages()), recording.messages);
  EXPECT_EQ(repaired.statistics(), unfinished.statistics());
}

TEST_P(McapRoundTrip, AFileThatIsBeingWrittenIsNeitherReplacedNorRepaired) {
  ChunkBuilder builder;
  builder.add({builder.add_channel({0, "t", "cdr", {}}), 0, 1, 1, Bytes(1'000)});
  FileWriter writer(path_, GetParam(), "");
  writer.write(builder.take());
  const Bytes before = test::file_bytes(path_);
  for (const auto& interfere : {std::function<void()>([&] { FileWriter(path_, GetParam(), ""); }),
                                std::function<void()>([&] { recover(path_); })})
    try {
      interfere();
      ADD_FAILURE() << "not refused";
    } catch (const std::system_error& error) {
      EXPECT_NE(std::string(error.what()).find(path_.string() + ": another process writes to it"),
                std::string::npos)
          << error.what();
    }
  EXPECT_EQ(test::file_bytes(path_), before);
  writer.finish();
  EXPECT_EQ(Reader(path_).statistics().messages, 1u);
}

INSTANTIATE_TEST_SUITE_P(All, McapRoundTrip,
                         testing::Values(Compression::none, Compression::lz4, Compression::zstd),
                         [](const auto& test) {
                           return test.param == Compression::none
                                      ? "None"
                                      : "With_" + std::string(name_of(test.param));
                         });

}  // namespace
}  // namespace fivepipe::mcap
