#include "common/base/readable_file.h"
#include "tests/support/optional_package.h"
#include "tests/support/test_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

namespace fivepipe::base {
namespace {

class ReadableFile : public testing::Test {
 protected:
  const test::TestFolder test_folder_;
  const std::filesystem::path folder_ = test_folder_.path;
};

TEST_F(ReadableFile, RegularFilesAndLinksToThemAreReadable) {
  std::ofstream(folder_ / "file") << "text";
  std::filesystem::create_symlink("file", folder_ / "link");
  EXPECT_EQ(why_unreadable(folder_ / "file"), std::nullopt);
  EXPECT_EQ(why_unreadable(folder_ / "link"), std::nullopt);
}

TEST_F(ReadableFile, EverythingElseIsRefusedWithItsKind) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink("pipe", folder_ / "link_to_pipe");
  std::filesystem::create_symlink("nothing", folder_ / "dangling");
  std::filesystem::create_symlink("loop", folder_ / "loop");
  EXPECT_EQ(why_unreadable(folder_ / "loop"), "cannot be read: Too many levels of symbolic links");
  EXPECT_EQ(why_unreadable(folder_ / "pipe"), "is a pipe, not a file");
  EXPECT_EQ(why_unreadable(folder_ / "link_to_pipe"), "is a pipe, not a file");
  EXPECT_EQ(why_unreadable("/dev/zero"), "is a device, not a file");
  EXPECT_EQ(why_unreadable(folder_), "is a directory, not a file");
  EXPECT_EQ(why_unreadable(folder_ / "none"), "there is no such file");
  EXPECT_EQ(why_unreadable(folder_ / "dangling"), "there is no such file");
  EXPECT_EQ(why_unreadable(""), "there is no such file");
}

TEST_F(ReadableFile, AFileWithoutPermissionIsRefused) {
  std::ofstream(folder_ / "file") << "text";
  chmod((folder_ / "file").c_str(), 0);
  const std::optional<std::string> why = why_unreadable(folder_ / "file");
  if (geteuid() == 0)
    EXPECT_EQ(why, std::nullopt) << "root may read every file";
  else
    EXPECT_EQ(why, "cannot be read: check its permissions");
}

// The real user decides. Root has the right to become another one, unless a container forbids it.
TEST_F(ReadableFile, AFileThatOnlyOthersMayReadIsRefused) {
  std::ofstream(folder_ / "file") << "text";
  chmod(folder_.c_str(), 0711);
  chmod((folder_ / "file").c_str(), 0600);
  constexpr uid_t kNobody = 65534, kUnchanged = uid_t(-1);
  if (geteuid() != 0 || setresuid(kNobody, kUnchanged, kUnchanged) != 0)
    FIVEPIPE_SKIP_WITHOUT_PACKAGE("only root with CAP_SETUID can become another user");
  const bool may_enter = access(folder_.c_str(), X_OK) == 0;
  const std::optional<std::string> of_owner = why_unreadable(folder_ / "file");
  chmod((folder_ / "file").c_str(), 0644);
  const std::optional<std::string> of_all = why_unreadable(folder_ / "file");
  ASSERT_EQ(setresuid(0, kUnchanged, kUnchanged), 0);
  if (!may_enter)
    FIVEPIPE_SKIP_WITHOUT_PACKAGE("others may not enter " + folder_.string() + ": change TMPDIR");
  EXPECT_EQ(of_owner, "cannot be read: check its permissions");
  EXPECT_EQ(of_all, std::nullopt);
}

}  // namespace
}  // namespace fivepipe::base
