#include "common/pipeline/node/arguments.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace fivepipe::node {
namespace {

// What the parser returns, or the exit code, and what it prints.
struct Parsed {
  Arguments arguments;
  std::optional<int> exit_code;
  std::string printed;
};

Parsed parsed(std::vector<std::string> words) {
  std::vector<char*> argv;
  words.insert(words.begin(), "sim_node");
  for (std::string& word : words) argv.push_back(word.data());
  Parsed result;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  try {
    result.arguments = parse_arguments("sim_node", int(argv.size()), argv.data());
  } catch (const CommandLineExit& ends) {
    result.exit_code = ends.exit_code;
  }
  result.printed = testing::internal::GetCapturedStdout();
  result.printed += testing::internal::GetCapturedStderr();
  return result;
}

const std::vector<std::string> kRequired = {"--deployment", "d.yaml", "--node", "simulation"};

std::vector<std::string> with(std::vector<std::string> more) {
  more.insert(more.begin(), kRequired.begin(), kRequired.end());
  return more;
}

TEST(NodeArguments, HaveTheValuesOfTheirOptions) {
  const Parsed least = parsed(kRequired);
  EXPECT_FALSE(least.exit_code) << least.printed;
  EXPECT_EQ(least.arguments.deployment, "d.yaml");
  EXPECT_EQ(least.arguments.node, "simulation");
  EXPECT_EQ(least.arguments.out, "");
  EXPECT_EQ(least.arguments.domain, std::nullopt);
  EXPECT_TRUE(least.arguments.settings.empty());
  const Parsed all = parsed(with({"--out", "folder", "--domain", "0", "--set", "a=1", "--set",
                                  "path=x=y", "--set", "empty=", "--set", "b=2"}));
  EXPECT_FALSE(all.exit_code) << all.printed;
  EXPECT_EQ(all.arguments.out, "folder");
  EXPECT_EQ(all.arguments.domain, 0u);
  EXPECT_EQ(all.arguments.settings, (std::map<std::string, std::string>{
                                        {"a", "1"}, {"path", "x=y"}, {"empty", ""}, {"b", "2"}}));
}

TEST(NodeArguments, WrongOnesExitWithTwoAndTheReason) {
  const auto reason = [](const std::vector<std::string>& words) {
    const Parsed wrong = parsed(words);
    EXPECT_EQ(wrong.exit_code, 2);
    return wrong.printed;
  };
  EXPECT_NE(reason({"--node", "simulation"}).find("--deployment is required"), std::string::npos);
  EXPECT_NE(reason({"--deployment", "d.yaml"}).find("--node is required"), std::string::npos);
  for (const char* setting : {"novalue", "=x", "="})
    EXPECT_EQ(reason(with({"--set", setting})),
              "sim_node: --set expects KEY=VALUE, got '" + std::string(setting) + "'\n");
  EXPECT_NE(reason(with({"--set", "a=1", "b=2"})).find("b=2"), std::string::npos)
      << "one value per option";
  EXPECT_NE(reason(with({"--domain", "231"})).find("231"), std::string::npos);
  EXPECT_NE(reason(with({"--domain", "-1"})).find("-1"), std::string::npos);
  EXPECT_FALSE(parsed(with({"--domain", "230"})).exit_code) << "the largest domain";
}

TEST(NodeArguments, HelpAndVersionExitWithZero) {
  const Parsed help = parsed({"--help"}), version = parsed({"--version"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* option : {"--deployment", "--node", "--out", "--domain", "--set", "--version"})
    EXPECT_NE(help.printed.find(option), std::string::npos) << option;
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.printed.find('\n'), version.printed.size() - 1) << version.printed;
}

}  // namespace
}  // namespace fivepipe::node
