// LZ4 and zstd frames, https://mcap.dev/spec/registry#compression-formats.
#pragma once
#include "common/recording/mcap/format/bytes.h"

namespace fivepipe::mcap {

// A larger size in a chunk's header means a damaged or a hostile file.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t(1) << 30;

std::string_view name_of(Compression compression);  // "", "lz4", "zstd"

// Uses LZ4's fast level and zstd's level 3. Throws std::runtime_error if the library fails, for
// example for lack of memory.
void append_compressed(Bytes& to, ByteView raw, Compression compression);

// Throws McapError for an unknown compression, a damaged frame, a size other than
// `uncompressed_bytes`, and an impossible size: above kMaxChunkBytes, or more than the format can
// compress into that many bytes.
Buffer decompressed(std::string_view compression, Buffer compressed,
                    std::uint64_t uncompressed_bytes, const FileOffset& location);

}  // namespace fivepipe::mcap
