// Serialisation of each record type (https://mcap.dev/spec#records). mcap.h and summary.h explain
// the fields.
#pragma once
#include <array>
#include <optional>

#include "common/recording/mcap/format/bytes.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

enum class Op : std::uint8_t {
  header = 0x01,
  footer,
  schema,
  channel,
  message,
  chunk,
  message_index,
  chunk_index,
  attachment,
  attachment_index,
  statistics,
  metadata,
  metadata_index,
  summary_offset,
  data_end,
  // Private opcode: recover() gives it to damaged records, so that every reader skips them.
  quarantined = 0xFF
};

inline constexpr std::array<std::uint8_t, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
inline constexpr std::uint64_t kRecordHeaderBytes = 1 + 8;  // opcode, length of the content
inline constexpr std::uint64_t kFooterBytes = kRecordHeaderBytes + 8 + 8 + 4;
inline constexpr std::uint64_t kDataEndBytes = kRecordHeaderBytes + 4;

// Appends a record's opcode on construction and fills in the content's length on destruction.
class OpenRecord {
 public:
  OpenRecord(Bytes& to, Op op) : to_(to), start_(to.size()) {
    append(to, std::uint8_t(op));
    append(to, std::uint64_t(0));
  }
  ~OpenRecord() {
    const std::uint64_t content_bytes = to_.size() - start_ - kRecordHeaderBytes;
    std::memcpy(to_.data() + start_ + 1, &content_bytes, sizeof content_bytes);
  }
  OpenRecord(const OpenRecord&) = delete;
  OpenRecord& operator=(const OpenRecord&) = delete;

 private:
  Bytes& to_;
  std::size_t start_;
};

struct ChunkHeader {
  std::uint64_t start_ns = 0, end_ns = 0, uncompressed_bytes = 0;
  std::uint32_t uncompressed_crc = 0;
  std::string compression;
  std::uint64_t records_bytes = 0;  // size in the file, compressed
};
// Size of a chunk record's fields before its records. Allows a compression name of 64 bytes, far
// longer than any that the specification defines.
inline constexpr std::uint64_t kMaxChunkHeaderBytes = 8 + 8 + 8 + 4 + 4 + 64 + 8;

struct Footer {
  std::uint64_t summary_start = 0, summary_offset_start = 0;
  std::uint32_t summary_crc = 0;
};

// `offset` counts from the start of the chunk's uncompressed records.
struct MessageIndexEntry {
  std::uint64_t log_stamp_ns = 0, offset = 0;
};
using MessageIndex = std::map<Id, std::vector<MessageIndexEntry>>;

// Each function appends a complete record, except append_magic(). They throw std::length_error for
// a text or an array above 4 GiB.
void append_magic(Bytes& to);
void append_header(Bytes& to, std::string_view profile, std::string_view library);
void append_schema(Bytes& to, Id id, const Schema& schema);
void append_channel(Bytes& to, Id id, const Channel& channel);
void append_message(Bytes& to, const Message& message);
void append_message_index(Bytes& to, Id channel, std::span<const MessageIndexEntry> entries);
void append_attachment(Bytes& to, const Attachment& attachment);  // with its CRC
void append_metadata(Bytes& to, const Metadata& metadata);
void append_chunk_index(Bytes& to, const ChunkIndex& chunk);
void append_attachment_index(Bytes& to, const AttachmentIndex& attachment);
void append_metadata_index(Bytes& to, const MetadataIndex& metadata);
void append_statistics(Bytes& to, const Statistics& statistics);

// Parse a record's content; throw McapError if a field exceeds the end. Additional fields at the
// end are ignored, as the specification requires.
std::pair<Id, Schema> read_schema(ByteReader fields);
std::pair<Id, Channel> read_channel(ByteReader fields);
Message read_message(ByteReader fields);  // the payload points into the memory of `fields`
ChunkHeader read_chunk_header(ByteReader fields);
Attachment read_attachment(ByteReader fields);  // checks its CRC
Metadata read_metadata(ByteReader fields);
ChunkIndex read_chunk_index(ByteReader fields);
AttachmentIndex read_attachment_index(ByteReader fields);
MetadataIndex read_metadata_index(ByteReader fields);
Statistics read_statistics(ByteReader fields);
Footer read_footer(ByteReader fields);

struct Record {
  Op op;
  std::uint64_t offset = 0;  // of the opcode, from the start of the sequence
  ByteView content;
};
// Iterates over consecutive records in memory. Throws McapError if a record exceeds the end.
class RecordSequence {
 public:
  RecordSequence(ByteView records, FileOffset location)
      : fields_(records, location), size_bytes_(records.size()) {}
  std::optional<Record> next();

 private:
  ByteReader fields_;
  std::size_t size_bytes_;
};

}  // namespace fivepipe::mcap
