// How a process on a host of a deployment joins its network.
#include "common/pipeline/node/deployment_network.h"

#include <gtest/gtest.h>

#include "common/config/yaml/config_error.h"
#include "tests/support/deployments.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::node {
namespace {

// The error; empty if the host lab1 joins.
std::string error_of(const std::vector<config::Host>& hosts) {
  config::Deployment deployment;
  deployment.file = "lab.yaml";
  deployment.network_profile = "lan";
  deployment.hosts = hosts;
  try {
    const bus::Network network = network_of(deployment, {.host = "lab1"});
    return "";
  } catch (const config::ConfigError& error) {
    return error.what();
  }
}

TEST(DeploymentNetwork, TheLoopbackInterfaceReachesNoOtherMachine) {
  const std::string error =
      error_of({{"lab1", "192.168.10.11", "lo"}, {"lab2", "192.168.10.12", ""}});
  EXPECT_TRUE(test::contains(error,
                             "host lab1: the network interface lo reaches no other machine, such "
                             "as host lab2 (192.168.10.12). Name the interface"))
      << error;
  EXPECT_FALSE(error_of({{"lab1", "127.0.0.1", ""}, {"lab2", "192.168.10.12", ""}}).empty())
      << "by its address";
  EXPECT_EQ(error_of({{"lab1", "192.168.10.11", "lo"}}), "") << "there is no other machine";
  EXPECT_EQ(error_of({{"lab1", "127.0.0.1", "lo"}, {"lab2", "127.0.0.2", ""}}), "")
      << "both are this machine";
}

TEST(DeploymentNetwork, AnAbsentInterfaceIsNamedAsTheFileNamesIt) {
  EXPECT_TRUE(test::contains(error_of({{"lab1", "203.0.113.7", ""}, {"lab2", "203.0.113.8", ""}}),
                             "host lab1: this machine has no network interface with address "
                             "203.0.113.7"));
  EXPECT_TRUE(test::contains(error_of({{"lab1", "203.0.113.7", "eth77"}}),
                             "host lab1: this machine has no network interface 'eth77'"));
}

// The file can name the profiles that the programs contain, and no other.
TEST(DeploymentNetwork, TheFileNamesTheShippedProfiles) {
  const test::TestFolder folder;
  const auto is_refused = [&](const std::string& profile) {
    try {
      config::load_deployment(test::changed_deployment(folder.path, "name: small",
                                                       "name: small\nnetwork_profile: " + profile));
    } catch (const config::ConfigError& error) {
      return test::contains(error.what(), "network_profile must be one of");
    }
    return false;
  };
  for (const std::string& profile : bus::profile_names()) EXPECT_FALSE(is_refused(profile));
  EXPECT_TRUE(is_refused("wifi"));
}

}  // namespace
}  // namespace fivepipe::node
