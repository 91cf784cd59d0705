// The nodes that `fivepipe up` starts on a host.
#include <gtest/gtest.h>

#include "common/base/machine.h"
#include "common/config/yaml/config_error.h"
#include "launch/supervise/hosts/hosts.h"

namespace fivepipe::launch {
namespace {

config::Deployment deployment_of(const std::vector<std::pair<std::string, std::string>>& nodes) {
  config::Deployment deployment;
  deployment.file = "demo.yaml";
  for (const auto& [name, host] : nodes) {
    config::Node& node = deployment.nodes.emplace_back();
    node.name = name;
    node.host = host;
  }
  return deployment;
}

std::string names(const std::vector<config::Node>& nodes) {
  std::string names;
  for (const config::Node& node : nodes) names += node.name + " ";
  return names;
}

std::string error_of(const config::Deployment& deployment, const std::string& host) {
  try {
    nodes_of_host(deployment, host);
  } catch (const config::ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(NodesOfHost, ThisMachineHasItsOwnNodesAndThoseWithoutAHost) {
  const config::Deployment deployment = deployment_of(
      {{"a", "no host"}, {"b", ""}, {"c", base::host_name()}, {"d", "nor this"}, {"e", "no host"}});
  EXPECT_EQ(names(nodes_of_host(deployment, "")), "b c ");
  EXPECT_EQ(names(nodes_of_host(deployment, "no host")), "a e ");
  EXPECT_EQ(names(nodes_of_host(deployment, "nor this")), "d ");
  EXPECT_EQ(names(nodes_of_host(deployment, base::host_name())), "c ");
}

TEST(NodesOfHost, AHostWithoutNodesIsAnErrorThatListsTheHosts) {
  EXPECT_EQ(error_of(deployment_of({{"a", "beta"}, {"b", "alpha"}, {"c", ""}, {"d", "beta"}}), "x"),
            "demo.yaml: no node for host 'x'; choose one of the deployment's hosts with --host: "
            "alpha, beta");
  EXPECT_EQ(error_of(deployment_of({{"a", ""}}), "x"),
            "demo.yaml: no node for host 'x'; choose one of the deployment's hosts with --host: "
            "none");
}

// Such as one that only runs `fivepipe top`.
TEST(OtherHosts, OneWithoutNodesIsNotWaitedFor) {
  config::Deployment deployment = deployment_of({{"a", "alpha"}, {"b", "beta"}});
  deployment.hosts = {
      {"alpha", "127.0.0.1", ""}, {"beta", "203.0.113.7", ""}, {"observer", "203.0.113.8", ""}};
  OtherHosts others(deployment, {deployment.nodes.front()});
  const std::vector<std::string> missing = others.missing({});
  ASSERT_EQ(missing.size(), 1u);
  EXPECT_TRUE(missing.front().starts_with("waiting for host beta (203.0.113.7): "))
      << missing.front();
}

}  // namespace
}  // namespace fivepipe::launch
