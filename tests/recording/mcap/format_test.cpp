// Compares our files with bytes assembled by hand from the specification, https://mcap.dev/spec.
#include <gtest/gtest.h>

#include "common/recording/mcap/reader.h"
#include "tests/support/recording/mcap_files.h"

namespace fivepipe::mcap {
namespace {

template <typename T>
std::string number(T value) {
  std::string bytes;
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes += char(value >> (8 * i) & 0xFF);
  return bytes;
}
std::string u16(std::uint16_t value) { return number(value); }
std::string u32(std::uint32_t value) { return number(value); }
std::string u64(std::uint64_t value) { return number(value); }
std::string text(const std::string& value) { return u32(std::uint32_t(value.size())) + value; }
std::string record(std::uint8_t op, const std::string& content) {
  return char(op) + u64(content.size()) + content;
}
std::uint32_t crc(const std::string& bytes) { return crc32_of(std::as_bytes(std::span(bytes))); }

const std::string kMagicText("\x89MCAP0\r\n", 8);
const std::string kHeader = record(0x01, text("") + text("by hand"));
const std::string kSchema =
    record(0x03, u16(1) + text("S") + text("omgidl") + text("struct S {};"));
const std::string kChannel =
    record(0x04, u16(1) + u16(1) + text("t") + text("cdr") + text(text("k") + text("v")));
std::string message(std::uint32_t sequence, std::uint64_t log_ns, std::uint64_t publish_ns,
                    const std::string& payload) {
  return record(0x05, u16(1) + u32(sequence) + u64(log_ns) + u64(publish_ns) + payload);
}

ByteView view(const std::string& bytes) { return std::as_bytes(std::span(bytes)); }
std::string as_text(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// One chunk of two messages, an attachment, a metadata record, and everything that the
// specification requires after them.
std::string whole_file_by_hand() {
  const std::string messages =
      kSchema + kChannel + message(7, 100, 90, "abc") + message(8, 110, 95, "");
  const std::uint64_t first = kSchema.size() + kChannel.size(),
                      second = first + message(7, 100, 90, "abc").size();
  const std::string chunk =
      record(0x06, u64(100) + u64(110) + u64(messages.size()) + u32(crc(messages)) + text("") +
                       u64(messages.size()) + messages);
  const std::string index =
      record(0x07, u16(1) + text(u64(100) + u64(first) + u64(110) + u64(second)));
  const std::string attached = u64(5) + u64(6) + text("n") + text("text/plain") + u64(3) + "xyz";
  const std::string attachment = record(0x09, attached + u32(crc(attached)));
  const std::string metadata = record(0x0C, text("m") + text(text("a") + text("b")));

  const std::uint64_t chunk_at = kMagicText.size() + kHeader.size(),
                      index_at = chunk_at + chunk.size(), attachment_at = index_at + index.size();
  const std::uint64_t metadata_at = attachment_at + attachment.size();
  const std::string data = kMagicText + kHeader + chunk + index + attachment + metadata;
  const std::string data_end = record(0x0F, u32(crc(data)));
  const std::string statistics = record(0x0B, u64(2) + u16(1) + u32(1) + u32(1) + u32(1) + u32(1) +
                                                  u64(100) + u64(110) + text(u16(1) + u64(2)));
  const std::string chunk_index = record(
      0x08, u64(100) + u64(110) + u64(chunk_at) + u64(chunk.size()) + text(u16(1) + u64(index_at)) +
                u64(index.size()) + text("") + u64(messages.size()) + u64(messages.size()));
  const std::string attachment_index =
      record(0x0A, u64(attachment_at) + u64(attachment.size()) + u64(5) + u64(6) + u64(3) +
                       text("n") + text("text/plain"));
  const std::string metadata_index =
      record(0x0D, u64(metadata_at) + u64(metadata.size()) + text("m"));

  const std::uint64_t summary_at = data.size() + data_end.size();
  std::string summary, offsets;
  const std::vector<std::pair<int, std::string>> groups = {
      {0x03, kSchema},     {0x04, kChannel},         {0x0B, statistics},
      {0x08, chunk_index}, {0x0A, attachment_index}, {0x0D, metadata_index}};
  for (const auto& [op, group] : groups) {
    offsets += record(0x0E, char(op) + u64(summary_at + summary.size()) + u64(group.size()));
    summary += group;
  }
  const std::string covered =
      summary + offsets + char(0x02) + u64(20) + u64(summary_at) + u64(summary_at + summary.size());
  return data + data_end + covered + u32(crc(covered)) + kMagicText;
}

TEST(McapFormat, CrcMatchesSpecification) { EXPECT_EQ(crc("123456789"), 0xCBF43926u); }

TEST(McapFormat, WritesBytesOfSpecification) {
  const test::TestFolder folder;
  ChunkBuilder builder;
  const Id schema = builder.add_schema({"S", "omgidl", "struct S {};"});
  const Id channel = builder.add_channel({schema, "t", "cdr", {{"k", "v"}}});
  const std::string payload = "abc";
  builder.add({channel, 7, 100, 90, view(payload)});
  builder.add({channel, 8, 110, 95, {}});
  {
    FileWriter writer(folder.path / "a.mcap", Compression::none, "by hand");
    writer.write(builder.take());
    writer.attach({5, 6, "n", "text/plain", "xyz"});
    writer.add(Metadata{"m", {{"a", "b"}}});
    writer.finish();
    EXPECT_EQ(writer.bytes_written(), whole_file_by_hand().size());
  }
  EXPECT_EQ(as_text(test::file_bytes(folder.path / "a.mcap")), whole_file_by_hand());
}

TEST(McapFormat, ReadsUnchunkedUnknownAndExtendedRecords) {
  const test::TestFolder folder;
  const std::string longer_channel = record(
      0x04, u16(1) + u16(1) + text("t") + text("cdr") + text("") + "a later version's field");
  const std::string ignored_schema = record(0x03, u16(0) + text("none") + text("") + text(""));
  const std::string bytes =
      kMagicText + kHeader + record(0x42, "future") + kSchema + ignored_schema + longer_channel +
      message(2, 30, 30, "late") + record(0x99, "private") + message(1, 20, 20, "early") +
      record(0x0F, u32(0)) + record(0x02, u64(0) + u64(0) + u32(0)) + kMagicText;
  test::write_file(folder.path / "a.mcap", view(bytes));
  const Reader reader(folder.path / "a.mcap");
  EXPECT_FALSE(reader.is_finished());
  EXPECT_EQ(reader.damage().damaged_records, 0u);
  EXPECT_EQ(reader.schemas().size(), 1u);
  const auto messages = test::all_messages(reader.messages());
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(as_text(messages[0].payload), "early");
  EXPECT_EQ(as_text(messages[1].payload), "late");
  EXPECT_EQ(reader.statistics().messages, 2u);
  EXPECT_EQ(reader.statistics().start_ns, 20u);
}

TEST(McapFormat, ReadsAnIndexedFileWithoutCrcsAndSummaryOffsets) {
  const test::TestFolder folder;
  const std::string messages = kSchema + kChannel + message(7, 100, 90, "abc");
  const std::string chunk = record(0x06, u64(100) + u64(100) + u64(messages.size()) + u32(0) +
                                             text("") + u64(messages.size()) + messages);
  const std::string data = kMagicText + kHeader + chunk + record(0x0F, u32(0));
  const std::string index = record(
      0x08, u64(100) + u64(100) + u64(kMagicText.size() + kHeader.size()) + u64(chunk.size()) +
                text("") + u64(0) + text("") + u64(messages.size()) + u64(messages.size()));
  const std::string summary = kChannel + index +
                              record(0x0B, u64(1) + u16(1) + u32(1) + u32(0) + u32(0) + u32(1) +
                                               u64(100) + u64(100) + text(""));
  test::write_file(
      folder.path / "a.mcap",
      view(data + summary + record(0x02, u64(data.size()) + u64(0) + u32(0)) + kMagicText));
  const Reader reader(folder.path / "a.mcap");
  EXPECT_TRUE(reader.is_finished()) << reader.damage().summary;
  EXPECT_EQ(test::all_messages(reader.messages()).size(), 1u);
}

TEST(McapFormat, RejectsNonMcapFile) {
  const test::TestFolder folder;
  EXPECT_THROW(Reader(folder.path / "missing"), std::system_error);
  EXPECT_THROW(Reader{folder.path}, std::system_error);
  test::write_file(folder.path / "empty", {});
  EXPECT_THROW(Reader(folder.path / "empty"), McapError);
  test::write_file(folder.path / "other", view(std::string(1000, 'x')));
  EXPECT_THROW(Reader(folder.path / "other"), McapError);
}

TEST(McapFormat, BuilderRejectsUnknownIds) {
  ChunkBuilder builder;
  EXPECT_THROW(builder.add_channel({1, "t", "cdr", {}}), std::invalid_argument);
  const Id channel = builder.add_channel({0, "t", "cdr", {}});
  EXPECT_THROW(builder.add({Id(channel + 1), 0, 0, 0, {}}), std::out_of_range);
  EXPECT_THROW(builder.add({0, 0, 0, 0, {}}), std::out_of_range);
  EXPECT_TRUE(builder.empty());
}

// Otherwise a damaged chunk would also cost the messages of later chunks.
TEST(McapFormat, EveryChunkHoldsItsChannelsAndSchemas) {
  ChunkBuilder builder;
  const Id schema = builder.add_schema({"S", "omgidl", "struct S {};"});
  const Id channel = builder.add_channel({schema, "t", "cdr", {{"k", "v"}}});
  for (int i = 0; i < 2; ++i) {
    builder.add({channel, 7, 100, 90, {}});
    EXPECT_EQ(as_text(builder.take().records), kSchema + kChannel + message(7, 100, 90, ""));
  }
}

}  // namespace
}  // namespace fivepipe::mcap
