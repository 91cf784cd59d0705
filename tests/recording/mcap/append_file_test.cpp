#include "common/recording/mcap/append_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/test_folder.h"

namespace fivepipe::mcap {
namespace {

TEST(AppendFile, AFileThatWasMovedFromClosesNoFile) {
  const test::TestFolder folder;
  {
    AppendFile first = AppendFile::create(folder.path / "file");
    const AppendFile second = std::move(first);
  }
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    EXPECT_NE(fcntl(standard, F_GETFD), -1) << standard;
  EXPECT_NO_THROW(AppendFile::create(folder.path / "file")) << "the file is still locked";
}

}  // namespace
}  // namespace fivepipe::mcap
