// What stands in a file, found without its summary: from the start on, record by record, every
// chunk decompressed and checked.
#pragma once
#include "common/recording/mcap/format/file.h"
#include "common/recording/mcap/format/records.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

struct Damage {
  std::string summary;             // why there is no summary to rely on; empty if there is one
  std::uint64_t intact_bytes = 0;  // up to here stand whole records of the data section
  std::uint64_t truncated_bytes =
      0;  // what follows: the piece of a record or of a summary; the whole summary, if it is good
  std::uint64_t damaged_records = 0;  // chunks, attachments, metadata, unchunked records
  std::vector<std::string>
      damage_reports;  // of the first kMaxReported of them: file, byte, what is wrong
  std::uint64_t orphaned_messages =
      0;  // whose channel's record stands nowhere (any more); they are not counted otherwise
  static constexpr std::size_t kMaxReported = 1000;
};

struct Scan {
  Summary summary;  // chunks without a whole and right index of their messages have none here
  Damage damage;
  bool has_header = false;
  std::vector<std::uint64_t> damaged_bytes;  // where the damaged records stand
};

// McapError if the file does not begin with MCAP's magic bytes.
Scan scan(const File& file);

// What the records of one chunk, or unchunked ones, say.
struct ChunkContent {
  std::map<Id, Schema> schemas;
  std::map<Id, Channel> channels;
  MessageIndex messages;
  std::uint64_t start_ns = 0, end_ns = 0;  // 0 without messages
};
// McapError where the records are damaged, or have more than kMaxDefinitionBytes of schemas and
// channels.
inline constexpr std::uint64_t kMaxDefinitionBytes = 64 << 20;
ChunkContent content_of(ByteView records, const FileOffset& location);

}  // namespace fivepipe::mcap
