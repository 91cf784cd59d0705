// Claims of node names and folders, which keep two deployments apart.
#include "launch/supervise/claims.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <string>
#include <system_error>

#include "tests/support/process/open_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

using namespace fivepipe;
using namespace fivepipe::test;
namespace fs = std::filesystem;

TEST(NodeClaims, ErrorNamesHolderOfTakenName) {
  const std::uint32_t domain = 100000 + std::uint32_t(getpid());  // unused by other tests
  launch::NodeClaims first(domain, {"capture", "sim"});
  try {
    launch::NodeClaims second(domain, {"render", "sim"});
    FAIL() << "the second claim was granted";
  } catch (const launch::ClaimRefused& taken) {
    const std::string what = taken.what();
    EXPECT_TRUE(contains(what, "'sim'")) << what;
    EXPECT_TRUE(contains(what, "process " + std::to_string(getpid()))) << what;
    EXPECT_FALSE(contains(what, "'render'")) << what;
    EXPECT_TRUE(contains(what, "in domain " + std::to_string(domain) + ", started by process "))
        << what;
    EXPECT_TRUE(what.ends_with("\nStop that deployment or choose another --domain.")) << what;
  }
  launch::NodeClaims free_name(domain, {"render"});  // the refused claim does not hold it
  launch::NodeClaims other_domain(domain + 1'000'000'000, {"sim"});
}

TEST(NodeClaims, NameIsReleasedWhenHolderExits) {
  const std::uint32_t domain = 100000 + std::uint32_t(getpid());
  { launch::NodeClaims first(domain, {"sim"}); }
  EXPECT_NO_THROW(launch::NodeClaims(domain, {"sim"}));
}

TEST(NodeClaims, ARefusedClaimLeavesNoOpenFile) {
  const std::uint32_t domain = 100000 + std::uint32_t(getpid());
  const launch::NodeClaims first(domain, {"sim"});
  const std::size_t before = open_files();
  EXPECT_THROW(launch::NodeClaims(domain, {"capture", "sim", "render"}), launch::ClaimRefused);
  EXPECT_EQ(open_files(), before);
}

TEST(NodeClaims, NeedOpenFiles) {
  if (!kCanThrowWithoutFiles) GTEST_SKIP() << "see kCanThrowWithoutFiles";
  const std::exception_ptr thrown =
      thrown_without_files([] { launch::NodeClaims(100000 + std::uint32_t(getpid()), {"sim"}); });
  ASSERT_TRUE(thrown);
  EXPECT_THROW(std::rethrow_exception(thrown), std::system_error);
}

// Another process may claim a name without listening yet.
TEST(NodeClaims, AHolderThatDoesNotListenIsAnotherProcess) {
  const std::uint32_t domain = 100000 + std::uint32_t(getpid());
  const std::string name = "fivepipe/domain-" + std::to_string(domain) + "/sim";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(address.sun_path + 1, name.size());
  const int holder = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(bind(holder, reinterpret_cast<const sockaddr*>(&address),
                 socklen_t(offsetof(sockaddr_un, sun_path) + 1 + name.size())),
            0);
  try {
    launch::NodeClaims second(domain, {"sim"});
    ADD_FAILURE() << "the claim was granted";
  } catch (const launch::ClaimRefused& refused) {
    EXPECT_EQ(std::string(refused.what()),
              "node 'sim' already runs in domain " + std::to_string(domain) +
                  ", started by another process\nStop that deployment or choose another --domain.");
  }
  close(holder);
}

// The name of a socket has at most 107 bytes after its zero byte.
TEST(NodeClaims, LongNamesAreDistinguishedByTheFirst107Bytes) {
  const std::uint32_t domain = 100000 + std::uint32_t(getpid());
  const std::size_t before = ("fivepipe/domain-" + std::to_string(domain) + "/").size();
  const std::string name(107 - before - 1, 'n'), long_name = name + "c" + std::string(100, 'x');
  const launch::NodeClaims claims(domain, {name + "a", name + "b", long_name});
  for (const std::string& taken : {name + "a", name + "b", long_name})
    EXPECT_THROW(launch::NodeClaims(domain, {taken}), launch::ClaimRefused) << taken;
}

class FolderClaimTest : public testing::Test {
 protected:
  const TestFolder test_folder_;
  const fs::path folder = test_folder_.path;
};

TEST_F(FolderClaimTest, ErrorNamesHolderAndFolder) {
  const launch::FolderClaim first(folder);
  EXPECT_EQ(first.warning(), "");
  const fs::path link = folder.string() + "-link";
  fs::create_symlink(folder, link);
  for (const fs::path& name : {folder, folder / ".", link}) try {
      launch::FolderClaim second(name);
      ADD_FAILURE() << "the second claim was granted: " << name;
    } catch (const launch::ClaimRefused& refused) {
      const std::string what = refused.what();
      EXPECT_TRUE(contains(what, "process " + std::to_string(getpid()))) << what;
      EXPECT_TRUE(contains(what, name.string())) << what;
    }
  fs::remove(link);
}

TEST_F(FolderClaimTest, FolderIsReleasedByItsHolder) {
  { const launch::FolderClaim first(folder); }
  EXPECT_NO_THROW(launch::FolderClaim second(folder));
}

TEST_F(FolderClaimTest, MissingFolderIsNamed) {
  try {
    const launch::FolderClaim claim(folder / "missing");
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_TRUE(contains(std::string(error.what()), "missing")) << error.what();
  }
}

TEST_F(FolderClaimTest, ARefusedClaimLeavesNoOpenFile) {
  const launch::FolderClaim first(folder);
  const std::size_t before = open_files();
  EXPECT_THROW(launch::FolderClaim second(folder), launch::ClaimRefused);
  EXPECT_EQ(open_files(), before);
}
