#include "common/recording/mcap/format/records.h"

namespace fivepipe::mcap {
namespace {

// Appends the content of a map or an array, preceded by its length.
void append_part(Bytes& to, ByteView entries) {
  append(to, std::string_view(reinterpret_cast<const char*>(entries.data()), entries.size()));
}

template <typename Value>
void append_by_id(Bytes& to, const std::map<Id, Value>& map) {
  Bytes entries;
  for (const auto& [id, value] : map) {
    append(entries, id);
    append(entries, value);
  }
  append_part(to, entries);
}

}  // namespace

void append_magic(Bytes& to) { append(to, std::as_bytes(std::span(kMagic))); }

void append_header(Bytes& to, std::string_view profile, std::string_view library) {
  const OpenRecord record(to, Op::header);
  append(to, profile);
  append(to, library);
}

void append_schema(Bytes& to, Id id, const Schema& schema) {
  const OpenRecord record(to, Op::schema);
  append(to, id);
  append(to, std::string_view(schema.name));
  append(to, std::string_view(schema.encoding));
  append(to, std::string_view(schema.text));
}

void append_channel(Bytes& to, Id id, const Channel& channel) {
  const OpenRecord record(to, Op::channel);
  append(to, id);
  append(to, channel.schema);
  append(to, std::string_view(channel.topic));
  append(to, std::string_view(channel.message_encoding));
  append(to, channel.metadata);
}

void append_message(Bytes& to, const Message& message) {
  const OpenRecord record(to, Op::message);
  append(to, message.channel);
  append(to, message.sequence);
  append(to, message.log_stamp_ns);
  append(to, message.publish_stamp_ns);
  append(to, message.payload);
}

void append_message_index(Bytes& to, Id channel, std::span<const MessageIndexEntry> entries) {
  const OpenRecord record(to, Op::message_index);
  append(to, channel);
  // std::as_bytes(entries) requires that the memory layout equals the file layout.
  static_assert(sizeof(MessageIndexEntry) == 2 * sizeof(std::uint64_t));
  append_part(to, std::as_bytes(entries));
}

void append_attachment(Bytes& to, const Attachment& attachment) {
  const OpenRecord record(to, Op::attachment);
  const std::size_t content = to.size();
  append(to, attachment.log_stamp_ns);
  append(to, attachment.create_stamp_ns);
  append(to, std::string_view(attachment.name));
  append(to, std::string_view(attachment.media_type));
  append(to, std::uint64_t(attachment.content.size()));
  append(to, std::as_bytes(std::span(attachment.content)));
  append(to, crc32_of(ByteView(to).subspan(content)));
}

void append_metadata(Bytes& to, const Metadata& metadata) {
  const OpenRecord record(to, Op::metadata);
  append(to, std::string_view(metadata.name));
  append(to, metadata.values);
}

void append_chunk_index(Bytes& to, const ChunkIndex& chunk) {
  const OpenRecord record(to, Op::chunk_index);
  append(to, chunk.start_ns);
  append(to, chunk.end_ns);
  append(to, chunk.offset);
  append(to, chunk.length_bytes);
  append_by_id(to, chunk.message_index_offsets);
  append(to, chunk.message_index_bytes);
  append(to, std::string_view(chunk.compression));
  append(to, chunk.compressed_bytes);
  append(to, chunk.uncompressed_bytes);
}

void append_attachment_index(Bytes& to, const AttachmentIndex& attachment) {
  const OpenRecord record(to, Op::attachment_index);
  append(to, attachment.offset);
  append(to, attachment.length_bytes);
  append(to, attachment.log_stamp_ns);
  append(to, attachment.create_stamp_ns);
  append(to, attachment.content_bytes);
  append(to, std::string_view(attachment.name));
  append(to, std::string_view(attachment.media_type));
}

void append_metadata_index(Bytes& to, const MetadataIndex& metadata) {
  const OpenRecord record(to, Op::metadata_index);
  append(to, metadata.offset);
  append(to, metadata.length_bytes);
  append(to, std::string_view(metadata.name));
}

void append_statistics(Bytes& to, const Statistics& statistics) {
  const OpenRecord record(to, Op::statistics);
  append(to, statistics.messages);
  append(to, std::uint16_t(statistics.schemas));
  append(to, statistics.channels);
  append(to, statistics.attachments);
  append(to, statistics.metadata);
  append(to, statistics.chunks);
  append(to, statistics.start_ns);
  append(to, statistics.end_ns);
  append_by_id(to, statistics.channel_messages);
}

}  // namespace fivepipe::mcap
