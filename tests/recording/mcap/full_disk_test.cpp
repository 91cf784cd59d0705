// MCAP files that cannot be written.
#include <gtest/gtest.h>

#include <cerrno>
#include <system_error>

#include "tests/support/process/file_size_limit.h"
#include "tests/support/recording/mcap_files.h"

namespace fivepipe::mcap {
namespace {

TEST(McapFullDisk, FullDiskKeepsCompleteChunks) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "a.mcap";
  const std::uint64_t room_bytes = 20'000;
  ChunkBuilder builder;
  const Id channel = builder.add_channel({0, "t", "cdr", {}});
  const Bytes payload(3'000);
  FileWriter writer(path, Compression::none, "");
  std::uint32_t written = 0;
  {
    const test::FileSizeLimit limit(room_bytes);
    try {
      for (;; ++written) {
        builder.add({channel, written, written, written, payload});
        writer.write(builder.take());
      }
    } catch (const std::system_error& error) {
      EXPECT_EQ(error.code().value(), EFBIG);
      EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
    }
    EXPECT_EQ(written, 6u);
    EXPECT_EQ(std::filesystem::file_size(path), writer.bytes_written());
    EXPECT_EQ(test::all_messages(Reader(path).messages()).size(), written);
  }
  // The disk has space again: the file has all messages except those of the failed call.
  writer.finish();
  const Reader reader(path);
  EXPECT_TRUE(reader.is_finished()) << reader.damage().summary;
  EXPECT_EQ(reader.statistics().messages, written);
  EXPECT_EQ(test::all_messages(reader.messages()).size(), written);
}

TEST(McapFullDisk, ErrorNamesUnwritableFile) {
  const test::TestFolder folder;
  try {
    FileWriter(folder.path / "none" / "a.mcap", Compression::none, "");
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_NE(std::string(error.what()).find("none/a.mcap"), std::string::npos);
  }
  try {
    FileWriter("/dev/full", Compression::none, "");
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), ENOSPC);
    EXPECT_NE(std::string(error.what()).find("/dev/full: cannot be written"), std::string::npos);
  }
}

}  // namespace
}  // namespace fivepipe::mcap
