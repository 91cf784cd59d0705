// What stands where in an MCAP file: its summary section, as data.
#pragma once
#include "common/recording/mcap/format/mcap.h"

namespace fivepipe::mcap {

// Offsets count from the start of the file; lengths are those of whole records, with opcode and
// length.
struct ChunkIndex {
  std::uint64_t start_ns = 0,
                end_ns = 0;  // log stamps of its earliest and latest message; 0 without messages
  std::uint64_t offset = 0, length_bytes = 0;
  std::map<Id, std::uint64_t> message_index_offsets;  // by channel; empty where the file has none
  std::uint64_t message_index_bytes =
      0;                    // of all message index records together, which follow the chunk
  std::string compression;  // "", "lz4", "zstd"
  std::uint64_t compressed_bytes = 0, uncompressed_bytes = 0;
  bool unchunked = false;  // no chunk, but records that stand in the data section on their own:
                           // only of files of others without a summary
};
struct AttachmentIndex {
  std::uint64_t offset = 0, length_bytes = 0, log_stamp_ns = 0, create_stamp_ns = 0,
                content_bytes = 0;
  std::string name, media_type;
};
struct MetadataIndex {
  std::uint64_t offset = 0, length_bytes = 0;
  std::string name;
};
struct Statistics {
  std::uint64_t messages = 0;
  std::uint32_t schemas = 0, channels = 0, attachments = 0, metadata = 0, chunks = 0;
  std::uint64_t start_ns = 0,
                end_ns = 0;  // log stamps of the earliest and latest message; 0 without messages
  std::map<Id, std::uint64_t> channel_messages;
  bool operator==(const Statistics&) const = default;
};
struct Summary {
  std::map<Id, Schema> schemas;
  std::map<Id, Channel> channels;
  Statistics statistics;
  std::vector<ChunkIndex> chunks;  // in file order
  std::vector<AttachmentIndex> attachments;
  std::vector<MetadataIndex> metadata;
};

// Counts a chunk's messages.
void add_messages(Statistics& statistics, Id channel, std::uint64_t count, std::uint64_t start_ns,
                  std::uint64_t end_ns);
// Sets what the lists' lengths say.
void count_records(Summary& summary);

}  // namespace fivepipe::mcap
