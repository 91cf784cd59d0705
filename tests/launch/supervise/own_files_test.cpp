// Where the program finds the files that come with it.
#include "launch/supervise/own_files.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/base/usage_error.h"
#include "tests/support/test_folder.h"

namespace fs = std::filesystem;

namespace fivepipe::launch {
namespace {

// A folder of programs, and the deployments `a` and `b` in `deployments`, relative to it.
class OwnFiles : public testing::TestWithParam<std::pair<const char*, const char*>> {
 protected:
  OwnFiles() {
    fs::create_directories(programs_);
    fs::create_directories(deployments_);
    for (const char* file : {"b.yaml", "a.yaml", "notes.txt"}) std::ofstream(deployments_ / file);
  }
  test::TestFolder folder_;
  fs::path programs_ = folder_.path / GetParam().first,
           deployments_ = folder_.path / GetParam().second;
};

TEST_P(OwnFiles, ANameIsThatOfAShippedDeployment) {
  EXPECT_EQ(shipped_deployments(programs_), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(deployment_file("b", programs_), deployments_ / "b.yaml");
}

TEST_P(OwnFiles, APathIsAFileOfTheUser) {
  for (const char* path : {"a.yaml", "./a", "/nowhere/a", "lab.yml"})
    EXPECT_EQ(deployment_file(path, programs_), path);
}

TEST_P(OwnFiles, AFileOfTheUserComesFirst) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_.path);
  std::ofstream("a");
  EXPECT_EQ(deployment_file("a", programs_), "a");
  fs::current_path(before);
}

// `fivepipe up a --out a` makes the folder.
TEST_P(OwnFiles, AFolderOfTheNameIsNoDeployment) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_.path);
  fs::create_directory("a");
  EXPECT_EQ(deployment_file("a", programs_), deployments_ / "a.yaml");
  fs::current_path(before);
}

TEST_P(OwnFiles, AnUnknownNameListsTheShippedOnes) {
  try {
    deployment_file("c", programs_);
    FAIL();
  } catch (const base::UsageError& error) {
    EXPECT_STREQ(error.what(),
                 "there is no file c, and no shipped deployment of this name; shipped: a, b");
  }
}

INSTANTIATE_TEST_SUITE_P(
    Layouts, OwnFiles,
    testing::Values(std::pair{"usr/lib/fivepipe", "usr/share/fivepipe/launch/deployments"},
                    std::pair{"build/release/bin", "launch/deployments"}),
    [](const auto& layout) { return layout.index == 0 ? "Installed" : "SourceTree"; });

TEST(OwnFilesMissing, NothingIsShipped) {
  const test::TestFolder folder;
  EXPECT_TRUE(shipped_deployments(folder.path).empty());
  try {
    deployment_file("demo", folder.path);
    FAIL();
  } catch (const base::UsageError& error) {
    EXPECT_STREQ(error.what(), "there is no file demo");
  }
}

}  // namespace
}  // namespace fivepipe::launch
