// https://mcap.dev/spec/registry#compression-formats: LZ4 frames and zstd frames.
#pragma once
#include "common/recording/mcap/format/bytes.h"

namespace fivepipe::mcap {

// A chunk that claims to be larger is a damaged or a hostile one.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t(1) << 30;

std::string_view name_of(Compression compression);  // "", "lz4", "zstd"

// LZ4's fast level, zstd's level 3. Throws std::runtime_error where the library can't (no memory).
void append_compressed(Bytes& to, ByteView raw, Compression compression);

// McapError: an unknown compression, damaged frames, another size than `uncompressed_bytes`, or one
// that can't be: above kMaxChunkBytes, or more than the format can pack into that many bytes.
Buffer decompressed(std::string_view compression, Buffer compressed,
                    std::uint64_t uncompressed_bytes, const FileOffset& location);

}  // namespace fivepipe::mcap
