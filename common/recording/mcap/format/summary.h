// The summary section of an MCAP file as data: definitions, statistics and indexes.
#pragma once
#include "common/recording/mcap/format/mcap.h"

namespace fivepipe::mcap {

// Offsets count from the start of the file. Lengths include the record's opcode and length field.
struct ChunkIndex {
  // Log stamps of the earliest and the latest message; 0 without messages.
  std::uint64_t start_ns = 0, end_ns = 0;
  std::uint64_t offset = 0, length_bytes = 0;
  std::map<Id, std::uint64_t> message_index_offsets;  // by channel; empty if the file has none
  // Of all message index records together; they follow the chunk.
  std::uint64_t message_index_bytes = 0;
  std::string compression;  // "", "lz4", "zstd"
  std::uint64_t compressed_bytes = 0, uncompressed_bytes = 0;
  // The entry describes records of the data section outside of chunks, not a chunk. This occurs
  // only in files of other writers without a summary.
  bool unchunked = false;
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
  // Log stamps of the earliest and the latest message; 0 without messages.
  std::uint64_t start_ns = 0, end_ns = 0;
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

// Adds a chunk's messages of one channel to the counts and the time range.
void add_messages(Statistics& statistics, Id channel, std::uint64_t count, std::uint64_t start_ns,
                  std::uint64_t end_ns);
// Sets the counts of schemas, channels, attachments, metadata and chunks from the lists.
void count_records(Summary& summary);

}  // namespace fivepipe::mcap
