// What `cmake --install` puts on a machine, used as a user would. Runs real processes.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include "tests/support/optional_package.h"
#include "tests/support/process.h"
#include "tests/support/source_text.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"

using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace fivepipe::test {
namespace {

class Installed : public testing::Test {
 protected:
  Installed() {
    EXPECT_EQ(run({"cmake", "--install", fs::path(FIVEPIPE_BINARY_DIR).parent_path(), "--prefix",
                   prefix_}),
              0)
        << said_;
  }
  // Runs a program to its end; its output is in said_.
  int run(const std::vector<std::string>& words) {
    std::vector<std::string> found{"/usr/bin/env"};
    found.insert(found.end(), words.begin(), words.end());
    Program program(found, folder_.path / "log");
    const std::optional<int> exit_code = program.wait_for_end(60s);
    said_ = program.said();
    return exit_code.value_or(-1);
  }

  TestFolder folder_;
  fs::path prefix_ = folder_.path / "usr";
  std::string said_;
};

TEST_F(Installed, ADeploymentRunsByItsName) {
  const fs::path out = folder_.path / "out";
  EXPECT_EQ(run({prefix_ / "bin/fivepipe", "up", "demo", "--domain", std::to_string(own_domain()),
                 "--duration", "1", "--out", out}),
            0)
      << said_;
  EXPECT_TRUE(fs::exists(out / "composite.png"));
  EXPECT_EQ(run({prefix_ / "bin/fivepipe", "up", "dmeo"}), 2);
  EXPECT_NE(said_.find("there is no file dmeo, and no shipped deployment of this name; shipped: "),
            std::string::npos)
      << said_;
  EXPECT_NE(said_.find("demo"), std::string::npos) << said_;
}

// Programs that another package may have, such as capture_node, are not in the search path.
TEST_F(Installed, OnlyOneProgramIsInTheSearchPath) {
  std::vector<std::string> programs;
  for (const auto& entry : fs::directory_iterator(prefix_ / "bin"))
    programs.push_back(entry.path().filename());
  EXPECT_EQ(programs, std::vector<std::string>{"fivepipe"});
}

TEST_F(Installed, AnExternalProgramQueriesAHull) {
  const fs::path build = folder_.path / "build";
  ASSERT_EQ(run({"cmake", "-S", FIVEPIPE_SOURCE_DIR "/docs/examples/hull_query", "-B", build,
                 "-DCMAKE_PREFIX_PATH=" + prefix_.string(), "-DCMAKE_CXX_FLAGS=-march=native"}),
            0)
      << said_;
  ASSERT_EQ(run({"cmake", "--build", build}), 0) << said_;
  EXPECT_EQ(run({build / "hull_query"}), 0) << said_;
  EXPECT_NE(said_.find("centre in the hull: 1\n"), std::string::npos) << said_;
  EXPECT_NE(said_.find("fivepipe::v1::ObjectPixelMap"), std::string::npos) << said_;
  std::smatch match;
  ASSERT_TRUE(std::regex_search(said_, match, std::regex("enters after ([0-9.]+) m"))) << said_;
  // The ray meets the ball after 0.5 - sqrt(0.1^2 - 0.01^2 - 0.02^2) m, and the hull earlier by
  // less than a centimetre: the camera from there sees the ball's edge.
  EXPECT_LT(std::stod(match[1]), 0.4026);
  EXPECT_GT(std::stod(match[1]), 0.39);
}

TEST_F(Installed, TheSystemdUnitIsValid) {
  if (run({"systemd-analyze", "--version"}) != 0)
    FIVEPIPE_SKIP_WITHOUT_PACKAGE("package systemd is not installed");
  const std::string unit = text_of(prefix_ / "lib/systemd/system/fivepipe@.service");
  for (const std::string& line :
       {"\nExecStart=" + (prefix_ / "bin/fivepipe").string() + " up /etc/fivepipe/%i.yaml ",
        "\nDocumentation=file://" + (prefix_ / "share/doc/fivepipe/docs/lab.md").string() + "\n"})
    EXPECT_NE(unit.find(line), std::string::npos) << "of any prefix: " << unit;
  std::ofstream(folder_.path / "fivepipe@lab.service") << unit;
  EXPECT_EQ(run({"systemd-analyze", "verify", folder_.path / "fivepipe@lab.service"}), 0) << said_;
  EXPECT_EQ(said_, "");
}

TEST_F(Installed, TheDocumentsHaveWhatTheyLink) {
  const std::regex link("\\]\\(([^)#:]+)(#[^)]*)?\\)");
  const fs::path documents = prefix_ / "share/doc/fivepipe";
  int links = 0;
  for (const auto& entry : fs::recursive_directory_iterator(documents)) {
    if (entry.path().extension() != ".md") continue;
    const std::string text = text_of(entry.path());
    for (std::sregex_iterator found(text.begin(), text.end(), link), end; found != end; ++found) {
      EXPECT_TRUE(fs::exists(entry.path().parent_path() / (*found)[1].str()))
          << entry.path() << ": " << (*found)[1];
      ++links;
    }
  }
  EXPECT_GT(links, 100);
  for (const char* file : {"README.md", "LICENSE", "docs/configuration.md", "docs/study.md"})
    EXPECT_TRUE(fs::exists(documents / file)) << file;
}

TEST_F(Installed, BashCompletesSubcommandsOptionsAndDeployments) {
  const auto completions = [&](const std::string& words) {
    EXPECT_EQ(
        run({"bash", "-c",
             "PATH=" + (prefix_ / "bin").string() + ":$PATH; . " +
                 (prefix_ / "share/bash-completion/completions/fivepipe").string() +
                 "; COMP_WORDS=(" + words +
                 "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _fivepipe; echo \"${COMPREPLY[@]}\""}),
        0)
        << said_;
    return said_;
  };
  EXPECT_EQ(completions("fivepipe rep"), "replay\n");
  EXPECT_EQ(completions("fivepipe up --dur"), "--duration\n");
  EXPECT_EQ(completions("fivepipe record x --comp"), "--compression\n");
  EXPECT_EQ(completions("fivepipe up seated"), "seated4cam\n");
  EXPECT_EQ(completions("fivepipe up seated4cam --host seated"), "\n") << "no deployment";
  EXPECT_EQ(completions("fivepipe simulation re"), "reset resume\n");
  EXPECT_EQ(completions("fivepipe study what"), "what-if\n");
  EXPECT_EQ(completions("fivepipe study space --dep"), "--deployment\n");
  EXPECT_EQ(completions("fivepipe bench ''"), "pipeline compare\n") << "no suite is installed";
}

// The sysctl file grants what the network profiles request.
TEST_F(Installed, TheKernelGrantsTheReceiveBuffersOfTheProfiles) {
  const std::string granted = text_of(prefix_ / "lib/sysctl.d/05-fivepipe.conf");
  std::smatch bytes;
  ASSERT_TRUE(std::regex_search(granted, bytes, std::regex("net\\.core\\.rmem_max = ([0-9]+)\n")));
  int profiles = 0;
  for (const auto& profile : fs::directory_iterator(prefix_ / "share/fivepipe/launch/profiles")) {
    const std::string xml = text_of(profile.path());
    std::smatch megabytes;
    ASSERT_TRUE(std::regex_search(xml, megabytes,
                                  std::regex("SocketReceiveBufferSize min=\"([0-9]+)MB\"")));
    EXPECT_GE(std::stol(bytes[1]), std::stol(megabytes[1]) << 20) << profile.path();
    ++profiles;
  }
  EXPECT_GE(profiles, 3);
}

}  // namespace
}  // namespace fivepipe::test
