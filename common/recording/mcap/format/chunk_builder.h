// First stage of writing: collects serialised messages into chunks in memory. The second stage,
// file_writer.h, may run in another thread.
#pragma once
#include "common/recording/mcap/format/records.h"

namespace fivepipe::mcap {

struct Chunk {
  Bytes records;       // schemas, channels and messages, uncompressed
  MessageIndex index;  // by channel, in the order of add()
  // Log stamps of the earliest and the latest message; 0 without messages.
  std::uint64_t start_ns = 0, end_ns = 0;
  std::map<Id, Schema> schemas;  // those whose records the chunk holds
  std::map<Id, Channel> channels;
};

// Every chunk holds the schemas and channels of its messages, each before its first use, so a
// damaged chunk costs only its own messages. Log stamps may arrive in any order; in ascending order
// the chunks of the file do not overlap in time and reading is fastest.
class ChunkBuilder {
 public:
  // Ids start at 1. Both throw std::length_error when 65535 exist.
  Id add_schema(const Schema& schema);
  // Throws std::invalid_argument if the channel's schema is neither 0 (none) nor known.
  Id add_channel(const Channel& channel);

  bool is_full() const;  // 65535 channels exist

  // Copies the payload. Throws std::out_of_range if the channel was not added.
  void add(const Message& message);
  std::size_t size_bytes() const { return open_.records.size(); }  // uncompressed
  bool empty() const { return open_.records.empty(); }
  // Returns what was added since the last call. Ids continue.
  Chunk take();

 private:
  void add_definitions(Id channel);

  std::vector<Schema> schemas_;  // by id - 1
  std::vector<Channel> channels_;
  Chunk open_;
};

}  // namespace fivepipe::mcap
