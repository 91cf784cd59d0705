// Size limits of the reader, which bound its memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "common/recording/mcap/format/records.h"
#include "common/recording/mcap/format/summary_section.h"
#include "tests/support/recording/mcap_files.h"

namespace fivepipe::mcap {
namespace {

// Returns the message without its location.
template <class Callable>
std::string error_of(Callable&& call) {
  try {
    call();
  } catch (const McapError& error) {
    const std::string all = error.what();
    return all.substr(all.rfind(": ") + 2);
  }
  return "";
}

// The indexes state sizes that the chunks do not have, so a cursor that accepts them fails next.
TEST(McapLimits, ACursorOpensChunksOf2GiBAtMost) {
  constexpr std::uint64_t k2GiB = std::uint64_t(2) << 30;
  const std::string too_much = "more than 2 GiB of chunks overlap in time",
                    accepted = "the chunk differs from its entry in the summary";
  const test::TestFolder folder;
  test::Recording recording = test::made_up_recording(1, 2, 10);
  test::write(recording, folder.path / "a.mcap", Compression::lz4);
  const auto file = std::make_shared<const File>(folder.path / "a.mcap");
  const std::vector<ChunkIndex> chunks = Reader(folder.path / "a.mcap").chunks();
  const std::vector<bool> all(1 << 16, true);
  const auto error_after = [&](int messages, std::uint64_t start_ns, std::uint64_t claimed_bytes) {
    std::vector<ChunkIndex> changed = chunks;
    changed[1].start_ns = start_ns;
    changed[1].uncompressed_bytes = claimed_bytes;
    Cursor cursor(file, changed, 0, ~std::uint64_t(0), all);
    for (int i = 0; i < messages; ++i) EXPECT_TRUE(cursor.next());
    return error_of([&] { cursor.next(); });
  };
  // The second chunk is opened while the first one is, or after it.
  const std::uint64_t last_ns = chunks[0].end_ns, open_bytes = chunks[0].uncompressed_bytes;
  EXPECT_EQ(error_after(9, last_ns, k2GiB - open_bytes), accepted);
  EXPECT_EQ(error_after(9, last_ns, k2GiB - open_bytes + 1), too_much);
  EXPECT_EQ(error_after(10, last_ns + 1, k2GiB), accepted);
  EXPECT_EQ(error_after(10, last_ns + 1, k2GiB + 1), too_much);
}

// One record fills the section, whose pages the file does not store.
TEST(McapLimits, ASummaryHas256MiBAtMost) {
  constexpr std::uint64_t k256MiB = 256 << 20;
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "a.mcap";
  const auto error_with = [&](std::uint64_t summary_bytes) {
    Bytes start, footer;
    append_magic(start);
    {
      const OpenRecord data_end(start, Op::data_end);
      append(start, std::uint32_t(0));
    }
    const std::uint64_t summary_start = start.size();
    append(start, std::uint8_t(0x99));
    append(start, summary_bytes - kRecordHeaderBytes);
    {
      const OpenRecord record(footer, Op::footer);
      append(footer, summary_start);
      append(footer, std::uint64_t(0));
      append(footer, std::uint32_t(0));
    }
    append_magic(footer);
    test::write_file(path, start);
    std::filesystem::resize_file(path, summary_start + summary_bytes);
    std::ofstream(path, std::ios::binary | std::ios::app)
        .write(reinterpret_cast<const char*>(footer.data()), std::streamsize(footer.size()));
    return error_of([&] { read_summary(File(path)); });
  };
  // Reading the largest section would take too long.
  EXPECT_EQ(error_with(k256MiB / 2 + 1), "the summary has no statistics");
  EXPECT_EQ(error_with(k256MiB + 1), "the footer's summary offset is invalid");
}

// A later version's fields may follow those of a channel.
TEST(McapLimits, AChunkHasDefinitionsOf64MiBAtMost) {
  const auto error_with = [](std::uint64_t definition_bytes) {
    Bytes channel;
    append_channel(channel, 1, {0, "t", "cdr", {}});
    std::memcpy(channel.data() + 1, &definition_bytes, sizeof definition_bytes);
    Buffer records(kRecordHeaderBytes + definition_bytes);
    std::copy(channel.begin(), channel.end(), records.all().begin());
    return error_of([&] { content_of(records.view(), {"file", 0}); });
  };
  EXPECT_EQ(error_with(64 << 20), "");
  EXPECT_EQ(error_with((64 << 20) + 1), "the schemas and channels of a chunk exceed 64 MiB");
}

}  // namespace
}  // namespace fivepipe::mcap
