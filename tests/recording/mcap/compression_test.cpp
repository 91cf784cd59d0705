// Compressed chunks, including those of damaged and hostile files.
#include "common/recording/mcap/format/compression.h"

#include <gtest/gtest.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>

namespace fivepipe::mcap {
namespace {

Buffer buffer_of(ByteView bytes) {
  Buffer buffer(bytes.size());
  std::copy(bytes.begin(), bytes.end(), buffer.all().begin());
  return buffer;
}

// Returns the error without its place; empty if there is none.
std::string decompression_error(std::string_view compression, ByteView bytes,
                                std::uint64_t uncompressed_bytes) {
  try {
    const Buffer raw = decompressed(compression, buffer_of(bytes), uncompressed_bytes, {"file", 0});
    EXPECT_EQ(raw.view().size(), uncompressed_bytes);
  } catch (const McapError& error) {
    return std::string(error.what()).substr(std::string("file: byte 0: ").size());
  }
  return "";
}

TEST(McapCompression, LimitsAreTheLargestPossibleExpansion) {
  const std::string impossible = "the uncompressed size in the chunk's header is impossible";
  const Bytes ten(10);
  EXPECT_EQ(decompression_error("lz4", ten, 11 * 255), impossible);
  EXPECT_NE(decompression_error("lz4", ten, 11 * 255 - 1), impossible);
  EXPECT_EQ(decompression_error("zstd", ten, 11 * 32768), impossible);
  EXPECT_NE(decompression_error("zstd", ten, 11 * 32768 - 1), impossible);
  EXPECT_EQ(decompression_error("", ten, 11), impossible);
  EXPECT_EQ(decompression_error("", ten, 9), "the chunk's size differs from its header");
  EXPECT_EQ(decompression_error("", ten, 10), "");
  const Bytes large((std::size_t(1) << 30) / 32768 + 1);
  EXPECT_NE(decompression_error("zstd", large, std::uint64_t(1) << 30), impossible);
  EXPECT_EQ(decompression_error("zstd", large, (std::uint64_t(1) << 30) + 1), impossible);
  EXPECT_EQ(decompression_error("lz4", {}, 0), "");
  EXPECT_EQ(decompression_error("zstd", {}, 0), "");
  EXPECT_NE(decompression_error("lz4", ten, 0), "") << "zeros are no frame";
  EXPECT_NE(decompression_error("zstd", ten, 0), "") << "zeros are no frame";
  EXPECT_EQ(decompression_error("lz5", ten, 10), "unknown compression of a chunk: \"lz5\"");
}

TEST(McapCompression, FramesHaveTheStatedSize) {
  const Bytes raw(100'000, std::byte(7));
  for (const Compression compression : {Compression::lz4, Compression::zstd}) {
    const std::string name(name_of(compression));
    Bytes frame;
    append_compressed(frame, raw, compression);
    EXPECT_EQ(decompression_error(name, frame, raw.size()), "");
    for (const std::uint64_t wrong : {raw.size() - 1, raw.size() + 1})
      EXPECT_NE(decompression_error(name, frame, wrong).find("frame is damaged"), std::string::npos)
          << name;
    Bytes two = frame;
    append(two, ByteView(frame));
    EXPECT_EQ(decompression_error(name, two, 2 * raw.size()), "") << name;
    two.pop_back();
    EXPECT_NE(decompression_error(name, two, 2 * raw.size()), "") << name;
  }
}

TEST(McapCompression, UsesLz4BlocksOf4MiBAndLevel3OfZstd) {
  Bytes raw(3 << 20), lz4, zstd, expected(ZSTD_compressBound(raw.size()));
  for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = std::byte(i * i >> 12);
  append_compressed(zstd, raw, Compression::zstd);
  expected.resize(ZSTD_compress(expected.data(), expected.size(), raw.data(), raw.size(), 3));
  EXPECT_TRUE(zstd == expected);
  append_compressed(lz4, raw, Compression::lz4);
  LZ4F_dctx* context = nullptr;
  ASSERT_FALSE(LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)));
  LZ4F_frameInfo_t info{};
  std::size_t bytes = lz4.size();
  EXPECT_FALSE(LZ4F_isError(LZ4F_getFrameInfo(context, &info, lz4.data(), &bytes)));
  LZ4F_freeDecompressionContext(context);
  EXPECT_EQ(info.contentSize, raw.size());
  EXPECT_EQ(info.blockSizeID, LZ4F_max4MB);
  // Zeros compress nearly as far as the formats can.
  const Bytes zeros(8 << 20);
  for (const Compression compression : {Compression::lz4, Compression::zstd}) {
    Bytes frame;
    append_compressed(frame, zeros, compression);
    EXPECT_EQ(decompression_error(name_of(compression), frame, zeros.size()), "");
  }
}

}  // namespace
}  // namespace fivepipe::mcap
