#include "common/pipeline/node/arguments.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "tests/support/text.h"

namespace fivepipe::node {
namespace {

// What the parser returns, or the exit code, and what it prints.
struct Parsed {
  Arguments arguments;
  std::optional<int> exit_code;
  std::string printed;
};

Parsed parsed(std::vector<std::string> words, const std::string& program = "sim_node") {
  std::vector<char*> argv;
  words.insert(words.begin(), program);
  for (std::string& word : words) argv.push_back(word.data());
  Parsed result;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  try {
    result.arguments = parse_arguments(program, int(argv.size()), argv.data());
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
  const Parsed required_only = parsed(kRequired);
  EXPECT_FALSE(required_only.exit_code) << required_only.printed;
  EXPECT_EQ(required_only.arguments.deployment, "d.yaml");
  EXPECT_EQ(required_only.arguments.node, "simulation");
  EXPECT_EQ(required_only.arguments.out, "");
  EXPECT_EQ(required_only.arguments.domain, std::nullopt);
  EXPECT_TRUE(required_only.arguments.settings.empty());
  EXPECT_TRUE(required_only.arguments.spacings_m.empty());
  const Parsed all = parsed(with({"--out", "folder", "--domain", "0", "--set", "a=1", "--set",
                                  "path=x=y", "--set", "empty=", "--set", "b=2", "--spacing",
                                  "part", "-0.05", "--spacing", "other=1", "1.5e-3"}));
  EXPECT_FALSE(all.exit_code) << all.printed;
  EXPECT_EQ(all.arguments.out, "folder");
  EXPECT_EQ(all.arguments.domain, 0u);
  EXPECT_EQ(all.arguments.settings, (std::map<std::string, std::string>{
                                        {"a", "1"}, {"path", "x=y"}, {"empty", ""}, {"b", "2"}}));
  EXPECT_EQ(all.arguments.spacings_m,
            (std::map<std::string, double>{{"part", -0.05}, {"other=1", 1.5e-3}}));
}

TEST(NodeArguments, WrongOnesExitWithTwoAndTheReason) {
  const auto reason = [](const std::vector<std::string>& words) {
    const Parsed wrong = parsed(words);
    EXPECT_EQ(wrong.exit_code, 2);
    return wrong.printed;
  };
  EXPECT_TRUE(test::contains(reason({"--node", "simulation"}), "--deployment is required"));
  EXPECT_TRUE(test::contains(reason({"--deployment", "d.yaml"}), "--node is required"));
  for (const char* setting : {"novalue", "=x", "="})
    EXPECT_EQ(reason(with({"--set", setting})),
              "sim_node: --set expects KEY=VALUE, got '" + std::string(setting) + "'\n");
  EXPECT_TRUE(test::contains(reason(with({"--set", "a=1", "b=2"})), "b=2"))
      << "one value per option";
  EXPECT_TRUE(test::contains(reason(with({"--spacing", "part", "wide"})), "wide"));
  EXPECT_TRUE(test::contains(reason(with({"--spacing", "part"})), "--spacing"));
  EXPECT_EQ(parsed(with({"--spacing", "part", "0.1"}), "recon_node").printed,
            "recon_node: only sim_node has --spacing; omit it\n");
  EXPECT_EQ(parsed(with({"--spacing", "part", "0.1"}), "recon_node").exit_code, 2);
  EXPECT_TRUE(test::contains(reason(with({"--domain", "231"})), "231"));
  EXPECT_TRUE(test::contains(reason(with({"--domain", "-1"})), "-1"));
  EXPECT_FALSE(parsed(with({"--domain", "230"})).exit_code) << "the largest domain";
}

TEST(NodeArguments, HelpAndVersionExitWithZero) {
  const Parsed help = parsed({"--help"}), version = parsed({"--version"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* option : {"--deployment", "--node", "--out", "--domain", "--set", "--version"})
    EXPECT_TRUE(test::contains(help.printed, option)) << option;
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.printed.find('\n'), version.printed.size() - 1) << version.printed;
}

}  // namespace
}  // namespace fivepipe::node
