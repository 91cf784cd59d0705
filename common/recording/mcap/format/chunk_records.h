// A chunk record and the message index records behind it, written and read
// (https://mcap.dev/spec#chunk-op0x06).
#pragma once
#include "common/recording/mcap/format/chunk_builder.h"
#include "common/recording/mcap/format/file.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

// Both append to what will stand in the file from `at_byte` on. The second completes the index that
// the first gave.
ChunkIndex append_chunk(Bytes& to, const Chunk& chunk, Compression compression,
                        std::uint64_t at_byte);
void append_message_indexes(Bytes& to, const MessageIndex& entries, std::uint64_t at_byte,
                            ChunkIndex& index);

// The index of the chunk record that stands there, as far as its head tells it. McapError if its
// fields contradict one another.
ChunkIndex read_chunk_index_at(const File& file, std::uint64_t byte, std::uint64_t length_bytes);

// A chunk's records, decompressed, CRC checked; of unchunked records what stands in the file.
// McapError if the chunk is damaged or is not what its index says.
Buffer read_chunk(const File& file, const ChunkIndex& chunk);

}  // namespace fivepipe::mcap
