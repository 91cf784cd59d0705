// Determines the content of a file without its summary: reads it record by record from the start,
// and decompresses and checks every chunk.
#pragma once
#include "common/recording/mcap/format/file.h"
#include "common/recording/mcap/format/records.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

struct Damage {
  std::string summary;             // why the summary cannot be used; empty if it is valid
  std::uint64_t intact_bytes = 0;  // end of the last complete record of the data section
  // Bytes after that: an incomplete record or summary, or the whole summary if it is valid.
  std::uint64_t truncated_bytes = 0;
  std::uint64_t damaged_records = 0;  // chunks, attachments, metadata, unchunked records
  // File, byte and defect of the first kMaxReported damaged records.
  std::vector<std::string> damage_reports;
  // Messages whose channel record is missing. No other count includes them.
  std::uint64_t orphaned_messages = 0;
  static constexpr std::size_t kMaxReported = 1000;
};

struct Scan {
  Summary summary;  // a chunk whose message index is incomplete or wrong has no index here
  Damage damage;
  bool has_header = false;
  std::vector<std::uint64_t> damaged_bytes;  // offsets of the damaged records
};

// Throws McapError if the file does not begin with MCAP's magic bytes.
Scan scan(const File& file);

// Definitions and messages in the records of a chunk, or in unchunked records.
struct ChunkContent {
  std::map<Id, Schema> schemas;
  std::map<Id, Channel> channels;
  MessageIndex messages;
  std::uint64_t start_ns = 0, end_ns = 0;  // 0 without messages
};
inline constexpr std::uint64_t kMaxDefinitionBytes = 64 << 20;
// Throws McapError if the records are damaged, or hold more than kMaxDefinitionBytes of schemas and
// channels.
ChunkContent content_of(ByteView records, const FileOffset& location);

}  // namespace fivepipe::mcap
