#include "common/mcap/records.h"

#include <limits>

namespace fivepipe::mcap {
namespace {

// A map's or an array's content, with its length in front.
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

std::map<Id, std::uint64_t> take_by_id(Fields& fields) {
  std::map<Id, std::uint64_t> map;
  for (Fields entries = fields.part(); !entries.empty();) {
    const Id id = entries.take<Id>();
    map[id] = entries.take<std::uint64_t>();
  }
  return map;
}

std::string as_text(ByteView bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

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

void append_message_index(Bytes& to, Id channel, std::span<const MessagePlace> places) {
  const OpenRecord record(to, Op::message_index);
  append(to, channel);
  static_assert(sizeof(MessagePlace) == 2 * sizeof(std::uint64_t));  // lies in memory as in the file
  append_part(to, std::as_bytes(places));
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

std::pair<Id, Schema> read_schema(Fields fields) {
  const Id id = fields.take<Id>();
  Schema schema;
  schema.name = fields.text();
  schema.encoding = fields.text();
  schema.text = fields.text();
  return {id, std::move(schema)};
}

std::pair<Id, Channel> read_channel(Fields fields) {
  const Id id = fields.take<Id>();
  Channel channel;
  channel.schema = fields.take<Id>();
  channel.topic = fields.text();
  channel.message_encoding = fields.text();
  channel.metadata = fields.text_map();
  return {id, std::move(channel)};
}

Message read_message(Fields fields) {
  Message message;
  message.channel = fields.take<Id>();
  message.sequence = fields.take<std::uint32_t>();
  message.log_stamp_ns = fields.take<std::uint64_t>();
  message.publish_stamp_ns = fields.take<std::uint64_t>();
  message.payload = fields.rest();
  return message;
}

ChunkHead read_chunk_head(Fields fields) {
  ChunkHead head;
  head.start_ns = fields.take<std::uint64_t>();
  head.end_ns = fields.take<std::uint64_t>();
  head.uncompressed_bytes = fields.take<std::uint64_t>();
  head.uncompressed_crc = fields.take<std::uint32_t>();
  head.compression = fields.text();
  head.records_bytes = fields.take<std::uint64_t>();
  return head;
}

Attachment read_attachment(Fields fields) {
  const ByteView content = fields.rest();
  Attachment attachment;
  attachment.log_stamp_ns = fields.take<std::uint64_t>();
  attachment.create_stamp_ns = fields.take<std::uint64_t>();
  attachment.name = fields.text();
  attachment.media_type = fields.text();
  attachment.content = as_text(fields.raw(fields.take<std::uint64_t>()));
  const ByteView covered = content.first(content.size() - fields.rest().size());
  const std::uint32_t crc = fields.take<std::uint32_t>();
  if (crc != 0 && crc != crc32_of(covered)) fields.place().fail("an attachment's CRC is wrong");
  return attachment;
}

Metadata read_metadata(Fields fields) {
  Metadata metadata;
  metadata.name = fields.text();
  metadata.values = fields.text_map();
  return metadata;
}

ChunkIndex read_chunk_index(Fields fields) {
  ChunkIndex chunk;
  chunk.start_ns = fields.take<std::uint64_t>();
  chunk.end_ns = fields.take<std::uint64_t>();
  chunk.offset = fields.take<std::uint64_t>();
  chunk.length_bytes = fields.take<std::uint64_t>();
  chunk.message_index_offsets = take_by_id(fields);
  chunk.message_index_bytes = fields.take<std::uint64_t>();
  chunk.compression = fields.text();
  chunk.compressed_bytes = fields.take<std::uint64_t>();
  chunk.uncompressed_bytes = fields.take<std::uint64_t>();
  return chunk;
}

AttachmentIndex read_attachment_index(Fields fields) {
  AttachmentIndex attachment;
  attachment.offset = fields.take<std::uint64_t>();
  attachment.length_bytes = fields.take<std::uint64_t>();
  attachment.log_stamp_ns = fields.take<std::uint64_t>();
  attachment.create_stamp_ns = fields.take<std::uint64_t>();
  attachment.content_bytes = fields.take<std::uint64_t>();
  attachment.name = fields.text();
  attachment.media_type = fields.text();
  return attachment;
}

MetadataIndex read_metadata_index(Fields fields) {
  MetadataIndex metadata;
  metadata.offset = fields.take<std::uint64_t>();
  metadata.length_bytes = fields.take<std::uint64_t>();
  metadata.name = fields.text();
  return metadata;
}

Statistics read_statistics(Fields fields) {
  Statistics statistics;
  statistics.messages = fields.take<std::uint64_t>();
  statistics.schemas = fields.take<std::uint16_t>();
  statistics.channels = fields.take<std::uint32_t>();
  statistics.attachments = fields.take<std::uint32_t>();
  statistics.metadata = fields.take<std::uint32_t>();
  statistics.chunks = fields.take<std::uint32_t>();
  statistics.start_ns = fields.take<std::uint64_t>();
  statistics.end_ns = fields.take<std::uint64_t>();
  statistics.channel_messages = take_by_id(fields);
  return statistics;
}

Footer read_footer(Fields fields) {
  Footer footer;
  footer.summary_start = fields.take<std::uint64_t>();
  footer.summary_offset_start = fields.take<std::uint64_t>();
  footer.summary_crc = fields.take<std::uint32_t>();
  return footer;
}

std::optional<Record> RecordSequence::next() {
  if (fields_.empty()) return std::nullopt;
  Record record;
  record.offset = size_bytes_ - fields_.rest().size();
  record.op = Op(fields_.take<std::uint8_t>());
  record.content = fields_.raw(fields_.take<std::uint64_t>());
  return record;
}

}  // namespace fivepipe::mcap
