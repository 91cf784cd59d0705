#include "common/recording/mcap/format/chunk_records.h"

#include <algorithm>

#include "common/recording/mcap/format/compression.h"

namespace fivepipe::mcap {
namespace {

// Returns the header of the chunk record at `byte`, and the offset of its records in that record.
std::pair<ChunkHeader, std::uint64_t> head_at(const File& file, std::uint64_t byte,
                                              std::uint64_t length_bytes) {
  const FileOffset location{file.name(), byte};
  const Buffer bytes =
      file.read(byte, std::min(length_bytes, kRecordHeaderBytes + kMaxChunkHeaderBytes));
  ByteReader fields(bytes.view(), location);
  if (Op(fields.take<std::uint8_t>()) != Op::chunk ||
      fields.take<std::uint64_t>() != length_bytes - kRecordHeaderBytes)
    location.fail("not a chunk record of the indexed length");
  const ChunkHeader head = read_chunk_header(fields);
  const std::uint64_t head_bytes =
      kRecordHeaderBytes + 8 + 8 + 8 + 4 + 4 + head.compression.size() + 8;
  if (head.records_bytes > length_bytes - head_bytes)
    location.fail("the chunk's records exceed its end");
  return {head, head_bytes};
}

}  // namespace

ChunkIndex append_chunk(Bytes& to, const Chunk& chunk, Compression compression,
                        std::uint64_t at_byte) {
  if (chunk.records.size() > kMaxChunkBytes) throw std::length_error("a chunk exceeds 1 GiB");
  const std::size_t start = to.size();
  ChunkIndex index;
  {
    const OpenRecord record(to, Op::chunk);
    append(to, chunk.start_ns);
    append(to, chunk.end_ns);
    append(to, std::uint64_t(chunk.records.size()));
    append(to, crc32_of(chunk.records));
    append(to, name_of(compression));
    append(to, std::uint64_t(0));
    const std::size_t records = to.size();
    append_compressed(to, chunk.records, compression);
    index.compressed_bytes = to.size() - records;
    std::memcpy(to.data() + records - sizeof index.compressed_bytes, &index.compressed_bytes,
                sizeof index.compressed_bytes);
  }
  index.start_ns = chunk.start_ns;
  index.end_ns = chunk.end_ns;
  index.offset = at_byte;
  index.length_bytes = to.size() - start;
  index.compression = name_of(compression);
  index.uncompressed_bytes = chunk.records.size();
  return index;
}

void append_message_indexes(Bytes& to, const MessageIndex& entries, std::uint64_t at_byte,
                            ChunkIndex& index) {
  const std::size_t start = to.size();
  index.message_index_offsets.clear();
  for (const auto& [channel, messages] : entries) {
    index.message_index_offsets[channel] = at_byte + (to.size() - start);
    append_message_index(to, channel, messages);
  }
  index.message_index_bytes = to.size() - start;
}

ChunkIndex read_chunk_index_at(const File& file, std::uint64_t byte, std::uint64_t length_bytes) {
  auto [head, head_bytes] = head_at(file, byte, length_bytes);
  ChunkIndex index;
  index.start_ns = head.start_ns;
  index.end_ns = head.end_ns;
  index.offset = byte;
  index.length_bytes = length_bytes;
  index.compression = std::move(head.compression);
  index.compressed_bytes = head.records_bytes;
  index.uncompressed_bytes = head.uncompressed_bytes;
  return index;
}

Buffer read_chunk(const File& file, const ChunkIndex& chunk) {
  if (chunk.unchunked) return file.read(chunk.offset, chunk.length_bytes);
  const FileOffset location{file.name(), chunk.offset};
  const auto [head, head_bytes] = head_at(file, chunk.offset, chunk.length_bytes);
  if (head.start_ns != chunk.start_ns || head.end_ns != chunk.end_ns ||
      head.uncompressed_bytes != chunk.uncompressed_bytes || head.compression != chunk.compression)
    location.fail("the chunk differs from its entry in the summary");
  Buffer records =
      decompressed(head.compression, file.read(chunk.offset + head_bytes, head.records_bytes),
                   head.uncompressed_bytes, location);
  if (head.uncompressed_crc != 0 && head.uncompressed_crc != crc32_of(records.view()))
    location.fail("the chunk's CRC is wrong");
  return records;
}

}  // namespace fivepipe::mcap
