// `security` of the deployment file.
#include "common/config/network/security.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/config/deployment.h"
#include "tests/support/deployment_files.h"

namespace fivepipe::config {
namespace {

using test::DeploymentFile;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(DeploymentFile, SecurityIsOffWithoutItsKey) {
  EXPECT_FALSE(load(test::kGoodDeployment).security);
}

TEST_F(DeploymentFile, KeysAreInAFolderBesideTheFileThatNeedNotExist) {
  const Deployment d = load(test::kGoodDeployment + "security: {keys: some/keys}\n");
  ASSERT_TRUE(d.security);
  EXPECT_EQ(d.security->keys, d.file.parent_path() / "some/keys");
  EXPECT_GT(d.security->line, 1);
  EXPECT_EQ(load(test::kGoodDeployment + "security: {keys: /etc/keys}\n").security->keys,
            "/etc/keys");
}

TEST_F(DeploymentFile, ProblemsOfSecurity) {
  EXPECT_THAT(problems(test::kGoodDeployment + "security: {}\n"), ElementsAre(HasSubstr("keys")));
  EXPECT_THAT(problems(test::kGoodDeployment + "security: {keys: k, sign: true}\n"),
              ElementsAre(HasSubstr("sign")));
}

}  // namespace
}  // namespace fivepipe::config
