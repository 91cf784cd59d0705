// Writes and reads a chunk record and the message index records after it
// (https://mcap.dev/spec#chunk-op0x06).
#pragma once
#include "common/recording/mcap/format/chunk_builder.h"
#include "common/recording/mcap/format/file.h"
#include "common/recording/mcap/format/summary.h"

namespace fivepipe::mcap {

// Both append records to `to` whose file offset will be `at_byte`. append_message_indexes()
// completes the index that append_chunk() returned.
ChunkIndex append_chunk(Bytes& to, const Chunk& chunk, Compression compression,
                        std::uint64_t at_byte);
void append_message_indexes(Bytes& to, const MessageIndex& entries, std::uint64_t at_byte,
                            ChunkIndex& index);

// Returns the index of the chunk record at `byte`, as far as the record's header determines it.
// Throws McapError if the header's fields are inconsistent.
ChunkIndex read_chunk_index_at(const File& file, std::uint64_t byte, std::uint64_t length_bytes);

// Returns a chunk's decompressed records and checks their CRC. For unchunked records, returns the
// bytes of the file. Throws McapError if the chunk is damaged or differs from its index.
Buffer read_chunk(const File& file, const ChunkIndex& chunk);

}  // namespace fivepipe::mcap
