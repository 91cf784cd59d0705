#include "common/recording/mcap/format/packed_chunks.h"

namespace fivepipe::mcap {

// Most numbers are differences, which are small. A difference that would be negative wraps around,
// and wraps back in unpacked().
void PackedChunks::add(const ChunkIndex& chunk) {
  put(chunk.start_ns);
  put(chunk.end_ns - chunk.start_ns);
  put(chunk.offset - end_);
  put(chunk.length_bytes);
  put(chunk.message_index_bytes);
  put(chunk.compressed_bytes);
  put(chunk.uncompressed_bytes);
  put(chunk.message_index_offsets.size());
  end_ = chunk.offset + chunk.length_bytes;
  std::uint64_t last = end_;
  for (const auto& [channel, offset] : chunk.message_index_offsets) {
    put(channel);
    put(offset - last);
    last = offset;
  }
}

std::vector<ChunkIndex> PackedChunks::unpacked() const {
  auto at = bytes_.begin();
  const auto take = [&] {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      const std::uint8_t byte = *at++;
      value |= std::uint64_t(byte & 0x7f) << shift;
      if (!(byte & 0x80)) return value;
    }
  };
  std::vector<ChunkIndex> chunks;
  std::uint64_t end = 0;
  while (at != bytes_.end()) {
    ChunkIndex& chunk = chunks.emplace_back();
    chunk.start_ns = take();
    chunk.end_ns = chunk.start_ns + take();
    chunk.offset = end + take();
    chunk.length_bytes = take();
    chunk.message_index_bytes = take();
    chunk.compressed_bytes = take();
    chunk.uncompressed_bytes = take();
    chunk.compression = compression_;
    end = chunk.offset + chunk.length_bytes;
    std::uint64_t last = end;
    for (std::uint64_t left = take(); left > 0; --left) {
      const Id channel = Id(take());
      chunk.message_index_offsets[channel] = last += take();
    }
  }
  return chunks;
}

void PackedChunks::put(std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes_.push_back(std::uint8_t(value | 0x80));
  bytes_.push_back(std::uint8_t(value));
}

}  // namespace fivepipe::mcap
