#include "common/recording/mcap/format/records.h"

namespace fivepipe::mcap {
namespace {

std::map<Id, std::uint64_t> take_by_id(ByteReader& fields) {
  std::map<Id, std::uint64_t> map;
  for (ByteReader entries = fields.part(); !entries.empty();) {
    const Id id = entries.take<Id>();
    map[id] = entries.take<std::uint64_t>();
  }
  return map;
}

std::string as_text(ByteView bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::pair<Id, Schema> read_schema(ByteReader fields) {
  const Id id = fields.take<Id>();
  Schema schema;
  schema.name = fields.text();
  schema.encoding = fields.text();
  schema.text = fields.text();
  return {id, std::move(schema)};
}

std::pair<Id, Channel> read_channel(ByteReader fields) {
  const Id id = fields.take<Id>();
  Channel channel;
  channel.schema = fields.take<Id>();
  channel.topic = fields.text();
  channel.message_encoding = fields.text();
  channel.metadata = fields.text_map();
  return {id, std::move(channel)};
}

Message read_message(ByteReader fields) {
  Message message;
  message.channel = fields.take<Id>();
  message.sequence = fields.take<std::uint32_t>();
  message.log_stamp_ns = fields.take<std::uint64_t>();
  message.publish_stamp_ns = fields.take<std::uint64_t>();
  message.payload = fields.rest();
  return message;
}

ChunkHeader read_chunk_header(ByteReader fields) {
  ChunkHeader head;
  head.start_ns = fields.take<std::uint64_t>();
  head.end_ns = fields.take<std::uint64_t>();
  head.uncompressed_bytes = fields.take<std::uint64_t>();
  head.uncompressed_crc = fields.take<std::uint32_t>();
  head.compression = fields.text();
  head.records_bytes = fields.take<std::uint64_t>();
  return head;
}

Attachment read_attachment(ByteReader fields) {
  const ByteView content = fields.rest();
  Attachment attachment;
  attachment.log_stamp_ns = fields.take<std::uint64_t>();
  attachment.create_stamp_ns = fields.take<std::uint64_t>();
  attachment.name = fields.text();
  attachment.media_type = fields.text();
  attachment.content = as_text(fields.raw(fields.take<std::uint64_t>()));
  const ByteView covered = content.first(content.size() - fields.rest().size());
  const std::uint32_t crc = fields.take<std::uint32_t>();
  if (crc != 0 && crc != crc32_of(covered)) fields.location().fail("the attachment's CRC is wrong");
  return attachment;
}

Metadata read_metadata(ByteReader fields) {
  Metadata metadata;
  metadata.name = fields.text();
  metadata.values = fields.text_map();
  return metadata;
}

ChunkIndex read_chunk_index(ByteReader fields) {
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

AttachmentIndex read_attachment_index(ByteReader fields) {
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

MetadataIndex read_metadata_index(ByteReader fields) {
  MetadataIndex metadata;
  metadata.offset = fields.take<std::uint64_t>();
  metadata.length_bytes = fields.take<std::uint64_t>();
  metadata.name = fields.text();
  return metadata;
}

Statistics read_statistics(ByteReader fields) {
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

Footer read_footer(ByteReader fields) {
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
