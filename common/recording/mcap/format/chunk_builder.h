// The first half of writing: serialised messages, gathered to chunks in memory. The second half,
// file_writer.h, may run in another thread.
#pragma once
#include "common/recording/mcap/format/records.h"

namespace fivepipe::mcap {

struct Chunk {
  Bytes records;       // schemas, channels, messages; not compressed
  MessageIndex index;  // by channel, in the order of writing
  std::uint64_t start_ns = 0,
                end_ns = 0;  // log stamps of the earliest and latest message; 0 without messages
  std::map<Id, Schema> schemas;  // whose records stand in it
  std::map<Id, Channel> channels;
};

// Every chunk holds the schemas and channels of its messages, each in front of its first use: a
// damaged chunk costs its own messages alone. Log stamps may come in any order; in rising order the
// file's chunks do not overlap, and are read fastest.
class ChunkBuilder {
 public:
  // Ids count from 1. Throw std::length_error when there are 65535.
  Id add_schema(const Schema& schema);
  Id add_channel(
      const Channel& channel);  // std::invalid_argument if its schema is neither 0 (none) nor known

  // The payload is copied once. std::out_of_range: a channel that was not added.
  void add(const Message& message);
  std::size_t size_bytes() const { return open_.records.size(); }  // uncompressed
  bool empty() const { return open_.records.empty(); }
  // What was added since the last call. Ids go on.
  Chunk take();

 private:
  void add_definitions(Id channel);

  std::vector<Schema> schemas_;  // id - 1
  std::vector<Channel> channels_;
  Chunk open_;
};

}  // namespace fivepipe::mcap
