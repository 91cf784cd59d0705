// Compares our files with bytes assembled by hand from the specification, https://mcap.dev/spec.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <system_error>

#include "common/recording/mcap/format/chunk_records.h"
#include "common/recording/mcap/format/records.h"
#include "common/recording/mcap/format/summary_section.h"
#include "common/recording/mcap/reader.h"
#include "common/recording/mcap/recover.h"
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
  EXPECT_EQ(reader.statistics().end_ns, 30u);
  ASSERT_EQ(reader.chunks().size(), 2u) << "records between unknown ones are one entry";
  const ChunkIndex &first = reader.chunks()[0], &second = reader.chunks()[1];
  EXPECT_EQ(first.offset, bytes.find(kSchema));
  EXPECT_EQ(first.length_bytes, kSchema.size() + ignored_schema.size() + longer_channel.size() +
                                    message(2, 30, 30, "late").size());
  EXPECT_EQ(std::pair(first.start_ns, first.end_ns),
            std::pair(std::uint64_t(30), std::uint64_t(30)));
  EXPECT_EQ(second.offset, bytes.find(message(1, 20, 20, "early")));
  EXPECT_EQ(second.length_bytes, message(1, 20, 20, "early").size());
  try {
    recover(folder.path / "a.mcap");
    FAIL();
  } catch (const McapError& error) {
    EXPECT_NE(std::string(error.what()).find("byte 0: cannot be repaired"), std::string::npos);
  }
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

TEST(McapFormat, TimesOfUnchunkedRecordsIncludeAllMessages) {
  const test::TestFolder folder;
  for (const auto& stamps : {std::vector<std::uint64_t>{50, 90, 20}, {20, 50, 90}, {0, 5, 7}}) {
    std::string bytes = kMagicText + kHeader + kSchema + kChannel;
    for (const std::uint64_t stamp_ns : stamps) bytes += message(0, stamp_ns, 0, "x");
    test::write_file(folder.path / "a.mcap", view(bytes));
    const Reader reader(folder.path / "a.mcap");
    ASSERT_EQ(reader.chunks().size(), 1u);
    const auto [first, last] = std::minmax_element(stamps.begin(), stamps.end());
    EXPECT_EQ(reader.chunks()[0].start_ns, *first);
    EXPECT_EQ(reader.chunks()[0].end_ns, *last);
    EXPECT_EQ(reader.statistics().start_ns, *first);
    EXPECT_EQ(reader.statistics().end_ns, *last);
    EXPECT_EQ(test::all_messages(reader.messages()).size(), 3u);
  }
}

TEST(McapFormat, UnchunkedRecordsAreMergedUpTo16MiB) {
  const test::TestFolder folder;
  constexpr std::size_t kLimit_bytes = 16 << 20;
  const std::size_t overhead_bytes = message(1, 1, 1, "").size();
  const auto chunks_and_damage = [&](std::size_t first_bytes, std::size_t second_bytes) {
    const std::string bytes = kMagicText + kHeader + kSchema + kChannel + record(0x99, "private") +
                              message(1, 1, 1, std::string(first_bytes - overhead_bytes, ' ')) +
                              message(2, 2, 2, std::string(second_bytes - overhead_bytes, ' '));
    test::write_file(folder.path / "a.mcap", view(bytes));
    const Reader reader(folder.path / "a.mcap");
    for (const std::string& report : reader.damage().damage_reports)
      EXPECT_NE(report.find("exceeds 16 MiB"), std::string::npos);
    return std::pair(reader.chunks().size() - 1, reader.damage().damaged_records);
  };
  EXPECT_EQ(chunks_and_damage(kLimit_bytes - 100, 100),
            std::pair(std::size_t(1), std::uint64_t(0)));
  EXPECT_EQ(chunks_and_damage(kLimit_bytes - 100, 101),
            std::pair(std::size_t(2), std::uint64_t(0)));
  EXPECT_EQ(chunks_and_damage(kLimit_bytes, 100), std::pair(std::size_t(2), std::uint64_t(0)));
  EXPECT_EQ(chunks_and_damage(kLimit_bytes + 1, 100), std::pair(std::size_t(1), std::uint64_t(1)));
}

std::string chunk_by_hand(const std::string& records, std::uint64_t start_ns = 0,
                          std::uint64_t end_ns = 0, const std::string& compression = "") {
  return record(0x06, u64(start_ns) + u64(end_ns) + u64(records.size()) + u32(0) +
                          text(compression) + u64(records.size()) + records);
}

TEST(McapFormat, ScanReportsDefinitionsThatContradictEarlierOnes) {
  const test::TestFolder folder;
  const std::string other_schema =
                        record(0x03, u16(1) + text("S") + text("omgidl") + text("other")),
                    other_channel =
                        record(0x04, u16(1) + u16(1) + text("other") + text("cdr") + text(""));
  const auto reports = [&](const std::string& data) {
    test::write_file(folder.path / "a.mcap", view(kMagicText + kHeader + data));
    const Reader reader(folder.path / "a.mcap");
    std::string all;
    for (const std::string& report : reader.damage().damage_reports)
      all += report.substr(report.find(": byte")) + "\n";
    return all;
  };
  const std::string good = kSchema + kChannel;
  const auto at = [&](std::uint64_t byte, const char* what) {
    return ": byte " + std::to_string(kMagicText.size() + kHeader.size() + byte) + ": a " + what +
           " differs from an earlier one of the same id\n";
  };
  EXPECT_EQ(reports(chunk_by_hand(good) + chunk_by_hand(good)), "");
  const std::uint64_t second = chunk_by_hand(good).size();
  EXPECT_EQ(reports(chunk_by_hand(good) + chunk_by_hand(other_schema)), at(second, "schema"));
  EXPECT_EQ(reports(chunk_by_hand(good) + chunk_by_hand(other_channel)), at(second, "channel"));
  EXPECT_EQ(reports(chunk_by_hand(kSchema + kSchema + other_schema)), at(0, "schema"));
  EXPECT_EQ(reports(chunk_by_hand(good + kChannel + other_channel)), at(0, "channel"));
  EXPECT_EQ(reports(good + kSchema + other_schema), at((good + kSchema).size(), "schema"));
}

TEST(McapFormat, ScanCountsMessagesWithoutAChannelAndAtMost1000Reports) {
  const test::TestFolder folder;
  std::string bytes = kMagicText;
  for (int i = 0; i < 1001; ++i) bytes += record(0x0C, "x");
  bytes += chunk_by_hand(message(1, 5, 5, "") + message(2, 9, 9, ""), 5, 9) +
           chunk_by_hand(kSchema + kChannel + message(3, 7, 7, ""), 7, 7);
  test::write_file(folder.path / "a.mcap", view(bytes + "incomplete"));
  const Reader reader(folder.path / "a.mcap");
  EXPECT_EQ(reader.header().library, "");
  EXPECT_EQ(reader.damage().damaged_records, 1001u);
  EXPECT_EQ(reader.damage().damage_reports.size(), 1000u);
  EXPECT_EQ(reader.damage().intact_bytes, bytes.size());
  EXPECT_EQ(reader.damage().truncated_bytes, 10u);
  EXPECT_EQ(reader.damage().orphaned_messages, 2u) << "before the channel";
  EXPECT_EQ(reader.statistics().messages, 1u);
}

TEST(McapFormat, ARepairAddsAMissingHeaderAndTheCrcOfTheData) {
  const test::TestFolder folder;
  const std::string chunk = chunk_by_hand(kSchema + kChannel + message(3, 7, 7, "abc"), 7, 7);
  test::write_file(folder.path / "a.mcap", view(kMagicText + chunk));
  EXPECT_FALSE(recover(folder.path / "a.mcap").was_finished);
  const std::string repaired = as_text(test::file_bytes(folder.path / "a.mcap"));
  EXPECT_EQ(repaired.find(record(0x01, text("") + text(""))), kMagicText.size() + chunk.size());
  const std::size_t end = repaired.find(record(0x0F, u32(0)).substr(0, 9));
  ASSERT_NE(end, std::string::npos);
  EXPECT_EQ(repaired.substr(end + 9, 4), u32(crc(repaired.substr(0, end))));
  EXPECT_EQ(test::all_messages(Reader(folder.path / "a.mcap").messages()).size(), 1u);
}

TEST(McapFormat, HeadersOfAnyFormAreOptional) {
  const test::TestFolder folder;
  const auto library = [&](const std::string& header) {
    test::write_file(folder.path / "a.mcap", view(kMagicText + header));
    return Reader(folder.path / "a.mcap").header().library;
  };
  EXPECT_EQ(library(kHeader), "by hand");
  EXPECT_EQ(library(""), "");
  EXPECT_EQ(library(kHeader.substr(0, 8)), "");
  EXPECT_EQ(library(kHeader.substr(0, 9)), "");
  EXPECT_EQ(library(kHeader.substr(0, kHeader.size() - 1)), "");
  EXPECT_EQ(library(record(0x01, text(""))), "");
  EXPECT_EQ(library(record(0x02, text("") + text("by hand"))), "");
  const std::size_t padding_bytes = (1 << 20) - (text("") + text("by hand")).size();
  EXPECT_EQ(library(record(0x01, text("") + text("by hand") + std::string(padding_bytes, ' '))),
            "by hand");
  EXPECT_EQ(library(record(0x01, text("") + text("by hand") + std::string(padding_bytes + 1, ' '))),
            "");
}

TEST(McapFormat, ReasonsWhyASummaryIsNotUsedAreStated) {
  const test::TestFolder folder;
  const std::string whole = whole_file_by_hand();
  const std::size_t footer = whole.size() - kMagicText.size() - 29;
  const auto reason = [&](const std::string& bytes) {
    test::write_file(folder.path / "a.mcap", view(bytes));
    const std::string all = Reader(folder.path / "a.mcap").damage().summary;
    return all.empty() ? all : all.substr(all.rfind(": ") + 2);
  };
  const auto patched = [&](std::size_t at, const std::string& by) {
    std::string bytes = whole;
    return reason(bytes.replace(at, by.size(), by));
  };
  EXPECT_EQ(reason(whole), "");
  EXPECT_EQ(reason(kMagicText + std::string(8 + 29 - 1, '\0')), "no footer");
  EXPECT_EQ(reason(kMagicText + std::string(8 + 29, '\0')), "no magic bytes at the end");
  EXPECT_EQ(patched(whole.size() - 1, "x"), "no magic bytes at the end");
  EXPECT_EQ(patched(footer, "\x03"), "no footer");
  EXPECT_EQ(patched(footer + 1, u64(19)), "no footer");
  const std::string invalid = "the footer's summary offset is invalid";
  const auto number_at = [&](std::size_t at) {
    std::uint64_t value;
    std::memcpy(&value, whole.data() + at, sizeof value);
    return value;
  };
  const std::uint64_t summary_at = number_at(footer + 9), offsets_at = number_at(footer + 17);
  EXPECT_EQ(patched(footer + 9, u64(0)), "no summary");
  EXPECT_EQ(patched(footer + 9, u64(8 + 13 - 1)), invalid);
  EXPECT_EQ(patched(footer + 9, u64(summary_at + 1)), invalid) << "no DataEnd before it";
  EXPECT_EQ(patched(footer + 9, u64(offsets_at + 1)), invalid);
  EXPECT_EQ(patched(footer + 17, u64(footer + 1)), invalid);
  EXPECT_EQ(patched(footer + 17, u64(footer)), "the summary's CRC is wrong");
  EXPECT_EQ(patched(footer + 25, u32(1)), "the summary's CRC is wrong");
  EXPECT_EQ(patched(footer + 25, u32(0)), "") << "no CRC";
}

TEST(McapFormat, ASummaryMustAgreeWithItself) {
  const test::TestFolder folder;
  test::Recording recording = test::made_up_recording(1, 2, 5);
  test::write(recording, folder.path / "a.mcap", Compression::none, false);
  const Bytes data = test::file_bytes(folder.path / "a.mcap");
  const Summary good = scan(File(folder.path / "a.mcap")).summary;
  const auto reason = [&](const auto& change) {
    Summary summary = good;
    change(summary);
    Bytes bytes = data;
    append(bytes, ByteView(end_of_file(summary, data.size(), 0)));
    test::write_file(folder.path / "b.mcap", bytes);
    try {
      read_summary(File(folder.path / "b.mcap"));
    } catch (const McapError& error) {
      const std::string all = error.what();
      return all.substr(all.rfind(": ") + 2);
    }
    return std::string();
  };
  const std::string offset = "the summary has an invalid record offset",
                    contradiction = "the summary's statistics contradict its indexes";
  EXPECT_EQ(reason([](Summary&) {}), "");
  EXPECT_EQ(reason([](Summary& s) { s.attachments[0].offset = 7; }), offset);
  EXPECT_EQ(reason([](Summary& s) { s.attachments[0].offset = 8; }), "");
  EXPECT_EQ(reason([](Summary& s) { s.metadata[0].length_bytes = 8; }), offset);
  EXPECT_EQ(reason([](Summary& s) { s.metadata[0].length_bytes = 9; }), "");
  EXPECT_EQ(
      reason([&](Summary& s) { s.metadata[0].length_bytes = data.size() - s.metadata[0].offset; }),
      "");
  EXPECT_EQ(reason([&](Summary& s) {
              s.metadata[0].length_bytes = data.size() - s.metadata[0].offset + 1;
            }),
            offset);
  EXPECT_EQ(reason([&](Summary& s) { s.metadata[0].offset = data.size() + 1; }), offset);
  EXPECT_EQ(reason([](Summary& s) {
              s.chunks[1].offset = s.chunks[0].offset + s.chunks[0].length_bytes;
            }),
            "");
  EXPECT_EQ(reason([](Summary& s) {
              s.chunks[1].offset = s.chunks[0].offset + s.chunks[0].length_bytes - 1;
            }),
            offset);
  EXPECT_EQ(reason([](Summary& s) { ++s.statistics.chunks; }), contradiction);
  EXPECT_EQ(reason([](Summary& s) { ++s.statistics.attachments; }), contradiction);
  EXPECT_EQ(reason([](Summary& s) { ++s.statistics.metadata; }), contradiction);
  EXPECT_EQ(reason([](Summary& s) { s.chunks.clear(), s.statistics.chunks = 0; }), contradiction);
  EXPECT_EQ(reason([](Summary& s) {
              s.chunks.clear();
              s.statistics.chunks = 0;
              s.statistics.messages = 0;
            }),
            "");
}

TEST(McapFormat, AChunkMustAgreeWithItsIndex) {
  const test::TestFolder folder;
  test::Recording recording = test::made_up_recording(1, 1, 5);
  test::write(recording, folder.path / "a.mcap", Compression::lz4);
  const File file(folder.path / "a.mcap");
  const Reader reader(folder.path / "a.mcap");
  const auto error_of = [&](const auto& change) {
    ChunkIndex index = reader.chunks()[0];
    change(index);
    try {
      read_chunk(file, index);
    } catch (const McapError& error) {
      const std::string all = error.what();
      return all.substr(all.rfind(": ") + 2);
    }
    return std::string();
  };
  const std::string differs = "the chunk differs from its entry in the summary",
                    other = "not a chunk record of the indexed length";
  EXPECT_EQ(error_of([](ChunkIndex&) {}), "");
  EXPECT_EQ(error_of([](ChunkIndex& i) { ++i.start_ns; }), differs);
  EXPECT_EQ(error_of([](ChunkIndex& i) { ++i.end_ns; }), differs);
  EXPECT_EQ(error_of([](ChunkIndex& i) { ++i.uncompressed_bytes; }), differs);
  EXPECT_EQ(error_of([](ChunkIndex& i) { i.compression = "zstd"; }), differs);
  EXPECT_EQ(error_of([](ChunkIndex& i) { ++i.length_bytes; }), other);
  EXPECT_EQ(error_of([&](ChunkIndex& i) {
              i.offset = reader.attachments()[0].offset;
              i.length_bytes = reader.attachments()[0].length_bytes;
            }),
            other);
  const auto attachment_error = [&](std::uint64_t offset, std::uint64_t length_bytes) {
    AttachmentIndex index = reader.attachments()[0];
    index.offset = offset;
    index.length_bytes = length_bytes;
    try {
      reader.read(index);
    } catch (const McapError& error) {
      const std::string all = error.what();
      return all.substr(all.rfind(": ") + 2);
    }
    return std::string();
  };
  const AttachmentIndex& attachment = reader.attachments()[0];
  const std::string no_record = "not a record of the indexed type and length";
  EXPECT_EQ(attachment_error(attachment.offset, attachment.length_bytes), "");
  EXPECT_EQ(attachment_error(attachment.offset, attachment.length_bytes + 1), no_record);
  EXPECT_EQ(attachment_error(reader.metadata()[0].offset, reader.metadata()[0].length_bytes),
            no_record);
}

// The name of a compression has at most 64 bytes, far more than any known one.
TEST(McapFormat, AnUnknownCompressionIsNamed) {
  const test::TestFolder folder;
  const auto report = [&](const std::string& compression) {
    test::write_file(
        folder.path / "a.mcap",
        view(kMagicText + kHeader + chunk_by_hand(std::string(200, ' '), 0, 0, compression)));
    const std::string all = Reader(folder.path / "a.mcap").damage().damage_reports.at(0);
    return all.substr(all.rfind(": ") + 2);
  };
  const std::string longest(64, 'c');
  EXPECT_EQ(report("lz5"), "\"lz5\"");
  EXPECT_EQ(report(longest), "\"" + longest + "\"");
  EXPECT_EQ(report(longest + "c"), "a field exceeds the end of its record");
}

TEST(McapFormat, AnAttachmentWithoutACrcIsNotChecked) {
  const std::string fields = u64(5) + u64(6) + text("n") + text("t") + u64(3) + "xyz";
  const auto content = [](const std::string& bytes) {
    return read_attachment({view(bytes), {"file", 0}}).content;
  };
  EXPECT_EQ(content(fields + u32(0)), "xyz");
  EXPECT_EQ(content(fields + u32(crc(fields))), "xyz");
  EXPECT_THROW(content(fields + u32(crc(fields) + 1)), McapError);
}

TEST(McapFormat, FilesReadUpToTheirEnd) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "a";
  test::write_file(path, view("0123456789"));
  const auto next_free_descriptor = [] {
    const int descriptor = open("/dev/null", O_RDONLY);
    close(descriptor);
    return descriptor;
  };
  const int before = next_free_descriptor();
  {
    const File file(path);
    EXPECT_EQ(file.size_bytes(), 10u);
    EXPECT_EQ(file.read(10, 0).view().size(), 0u);
    const Buffer all = file.read(0, 10), some = file.read(7, 3);
    EXPECT_EQ(as_text({all.view().begin(), all.view().end()}), "0123456789");
    EXPECT_EQ(as_text({some.view().begin(), some.view().end()}), "789");
    EXPECT_THROW(file.read(11, 0), McapError);
    EXPECT_THROW(file.read(7, 4), McapError);
    EXPECT_THROW(file.read(7, ~std::uint64_t(0)), McapError);
    std::filesystem::resize_file(path, 8);
    EXPECT_THROW(file.read(7, 3), McapError);
  }
  EXPECT_EQ(next_free_descriptor(), before);
  try {
    const File folder_file(folder.path);
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), EINVAL);
  }
  EXPECT_EQ(next_free_descriptor(), before);
}

TEST(McapFormat, ATextOf4GiBIsRefused) {
  const std::string_view too_long("x", std::size_t(1) << 32);  // append() tests the length first
  Bytes bytes;
  EXPECT_THROW(append(bytes, too_long), std::length_error);
}

TEST(McapFormat, StatisticsCoverAllMessages) {
  Statistics statistics;
  add_messages(statistics, 1, 0, 1, 99);
  EXPECT_EQ(statistics, Statistics{});
  add_messages(statistics, 1, 2, 10, 20);
  add_messages(statistics, 2, 3, 5, 15);
  add_messages(statistics, 1, 1, 12, 30);
  EXPECT_EQ(statistics, (Statistics{6, 0, 0, 0, 0, 0, 5, 30, {{1, 3}, {2, 3}}}));
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
