#include "common/recording/mcap/format/compression.h"

#include <lz4frame.h>
#include <zstd.h>

namespace fivepipe::mcap {
namespace {

constexpr int kZstdLevel = 3;
// Maximum expansion per compressed byte. LZ4: one byte extends a match by 255. zstd: a block of
// 128 KiB of one value takes 4 bytes.
constexpr std::uint64_t kMaxLz4Factor = 255, kMaxZstdFactor = (std::uint64_t(128) << 10) / 4;

void append_lz4(Bytes& to, ByteView raw) {
  LZ4F_preferences_t preferences = LZ4F_INIT_PREFERENCES;
  preferences.frameInfo.contentSize = raw.size();
  preferences.frameInfo.blockSizeID = LZ4F_max4MB;
  const std::size_t start = to.size();
  to.resize(start + LZ4F_compressFrameBound(raw.size(), &preferences));
  const std::size_t size_bytes = LZ4F_compressFrame(to.data() + start, to.size() - start,
                                                    raw.data(), raw.size(), &preferences);
  if (LZ4F_isError(size_bytes))
    throw std::runtime_error(std::string("LZ4: ") + LZ4F_getErrorName(size_bytes));
  to.resize(start + size_bytes);
}

void append_zstd(Bytes& to, ByteView raw) {
  const std::size_t start = to.size();
  to.resize(start + ZSTD_compressBound(raw.size()));
  const std::size_t size_bytes =
      ZSTD_compress(to.data() + start, to.size() - start, raw.data(), raw.size(), kZstdLevel);
  if (ZSTD_isError(size_bytes))
    throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size_bytes));
  to.resize(start + size_bytes);
}

void decompress_lz4(std::span<std::byte> to, ByteView from, const FileOffset& location) {
  LZ4F_dctx* raw_context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw_context, LZ4F_VERSION)))
    throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw_context, LZ4F_freeDecompressionContext);
  // The content may consist of several frames.
  for (bool ended = false; !ended;) {
    std::size_t written = to.size(), read = from.size();
    const std::size_t hint =
        LZ4F_decompress(context.get(), to.data(), &written, from.data(), &read, nullptr);
    if (LZ4F_isError(hint))
      location.fail(std::string("the chunk's LZ4 frame is damaged: ") + LZ4F_getErrorName(hint));
    to = to.subspan(written);
    from = from.subspan(read);
    ended = hint == 0 && from.empty();
    if (!ended && written == 0 && read == 0)
      location.fail("the chunk's LZ4 frame is damaged: its size differs from the chunk's header");
  }
  if (!to.empty())
    location.fail("the chunk's LZ4 frame is damaged: it is smaller than the chunk's header states");
}

void decompress_zstd(std::span<std::byte> to, ByteView from, const FileOffset& location) {
  const std::size_t size_bytes = ZSTD_decompress(to.data(), to.size(), from.data(), from.size());
  if (ZSTD_isError(size_bytes))
    location.fail(std::string("the chunk's zstd frame is damaged: ") +
                  ZSTD_getErrorName(size_bytes));
  if (size_bytes != to.size())
    location.fail("the chunk's zstd frame is damaged: its size differs from the chunk's header");
}

}  // namespace

std::string_view name_of(Compression compression) {
  switch (compression) {
    case Compression::none: return "";
    case Compression::lz4: return "lz4";
    case Compression::zstd: return "zstd";
  }
  return "";
}

void append_compressed(Bytes& to, ByteView raw, Compression compression) {
  switch (compression) {
    case Compression::none: append(to, raw); break;
    case Compression::lz4: append_lz4(to, raw); break;
    case Compression::zstd: append_zstd(to, raw); break;
  }
}

Buffer decompressed(std::string_view compression, Buffer compressed,
                    std::uint64_t uncompressed_bytes, const FileOffset& location) {
  const ByteView from = compressed.view();
  const bool is_lz4 = compression == "lz4", is_zstd = compression == "zstd";
  if (!is_lz4 && !is_zstd && !compression.empty())
    location.fail("unknown compression of a chunk: \"" + std::string(compression) + "\"");
  const std::uint64_t factor = is_lz4 ? kMaxLz4Factor : is_zstd ? kMaxZstdFactor : 1;
  if (uncompressed_bytes > kMaxChunkBytes || uncompressed_bytes / factor > from.size())
    location.fail("the uncompressed size in the chunk's header is impossible");
  if (compression.empty()) {
    if (uncompressed_bytes != from.size())
      location.fail("the chunk's size differs from its header");
    return compressed;
  }
  if (uncompressed_bytes == 0 && from.empty()) return {};
  // The comparison also holds for ZSTD_CONTENTSIZE_ERROR.
  if (is_zstd && ZSTD_getFrameContentSize(from.data(), from.size()) != ZSTD_CONTENTSIZE_UNKNOWN &&
      ZSTD_getFrameContentSize(from.data(), from.size()) > uncompressed_bytes)
    location.fail("the chunk's zstd frame is damaged, or larger than the chunk's header states");
  Buffer raw(uncompressed_bytes);
  if (is_lz4)
    decompress_lz4(raw.all(), from, location);
  else
    decompress_zstd(raw.all(), from, location);
  return raw;
}

}  // namespace fivepipe::mcap
