// What stands in a file, found without its summary: from the start on, record by record, every
// chunk decompressed and checked.
#pragma once
#include "common/recording/mcap/format/file.h"
#include "common/recording/mcap/format/records.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

struct Damage {
  std::string summary;            // why there is no summary to rely on; empty if there is one
  std::uint64_t whole_bytes = 0;  // up to here stand whole records of the data section
  std::uint64_t cut_bytes =
      0;  // what follows: the piece of a record or of a summary; the whole summary, if it is good
  std::uint64_t damaged_records = 0;  // chunks, attachments, metadata, loose records
  std::vector<std::string>
      damaged_names;  // of the first kMostNamed of them: file, byte, what is wrong
  std::uint64_t messages_of_no_channel =
      0;  // whose channel's record stands nowhere (any more); they are not counted otherwise
  static constexpr std::size_t kMostNamed = 1000;
};

struct Scan {
  Summary summary;  // chunks without a whole and right index of their messages have none here
  Damage damage;
  bool has_header = false;
  std::vector<std::uint64_t> damaged_bytes;  // where the damaged records stand
};

// McapError if the file does not begin with MCAP's magic bytes.
Scan scan(const File& file);

// What the records of one chunk, or loose ones, say.
struct ChunkContent {
  std::map<Id, Schema> schemas;
  std::map<Id, Channel> channels;
  MessagePlaces messages;
  std::uint64_t start_ns = 0, end_ns = 0;  // 0 without messages
};
// McapError where the records are damaged, or have more than kMostDefinitionBytes of schemas and
// channels.
inline constexpr std::uint64_t kMostDefinitionBytes = 64 << 20;
ChunkContent content_of(ByteView records, const Place& place);

}  // namespace fivepipe::mcap
