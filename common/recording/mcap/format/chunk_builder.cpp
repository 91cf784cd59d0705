#include "common/recording/mcap/format/chunk_builder.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace fivepipe::mcap {
namespace {

constexpr std::size_t kMaxIds = std::numeric_limits<Id>::max();

template <typename T>
Id added(std::vector<T>& list, const T& element) {
  if (list.size() == kMaxIds)
    throw std::length_error("an MCAP file has at most 65535 schemas and 65535 channels");
  list.push_back(element);
  return Id(list.size());
}

}  // namespace

Id ChunkBuilder::add_schema(const Schema& schema) { return added(schemas_, schema); }

Id ChunkBuilder::add_channel(const Channel& channel) {
  if (channel.schema > schemas_.size())
    throw std::invalid_argument("channel " + channel.topic + " has a schema that was not added");
  return added(channels_, channel);
}

bool ChunkBuilder::is_full() const { return channels_.size() == kMaxIds; }

void ChunkBuilder::add_definitions(Id id) {
  const Channel& channel = channels_.at(id - std::size_t(1));
  if (channel.schema != 0 &&
      open_.schemas.try_emplace(channel.schema, schemas_[channel.schema - 1]).second)
    append_schema(open_.records, channel.schema, schemas_[channel.schema - 1]);
  open_.channels.emplace(id, channel);
  append_channel(open_.records, id, channel);
}

void ChunkBuilder::add(const Message& message) {
  auto entries = open_.index.find(message.channel);
  if (entries == open_.index.end()) {
    add_definitions(message.channel);
    entries = open_.index.emplace(message.channel, std::vector<MessageIndexEntry>()).first;
  }
  const bool first = open_.index.size() == 1 && entries->second.empty();
  open_.start_ns = first ? message.log_stamp_ns : std::min(open_.start_ns, message.log_stamp_ns);
  open_.end_ns = first ? message.log_stamp_ns : std::max(open_.end_ns, message.log_stamp_ns);
  entries->second.push_back({message.log_stamp_ns, open_.records.size()});
  append_message(open_.records, message);
}

Chunk ChunkBuilder::take() {
  Chunk next;
  next.records.reserve(open_.records.capacity());  // avoids reallocation as the next chunk grows
  return std::exchange(open_, std::move(next));
}

}  // namespace fivepipe::mcap
