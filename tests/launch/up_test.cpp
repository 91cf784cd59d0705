// Runs `fivepipe up` as a process; shell scripts replace the nodes.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/test_domain.h"

using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kTimeout = 30s;
const std::vector<std::string> nodes = {"capture", "recon_a", "recon_b", "simulation",
                                        "rendering"};  // of demo.yaml

std::string text_of(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

bool wait_for(const std::function<bool()>& condition) {
  const auto until = Clock::now() + kTimeout;
  while (!condition()) {
    if (Clock::now() > until) return false;
    sched_yield();
  }
  return true;
}

class Up : public ::testing::Test {
 protected:
  fs::path folder = [] {
    std::string pattern = fs::temp_directory_path() / "fivepipe-up-XXXXXX";
    return fs::path(mkdtemp(pattern.data()));
  }();
  std::vector<pid_t> started;

  // `up` finds the nodes in the folder of its own program.
  void SetUp() override {
    fs::copy_file(FIVEPIPE_BINARY_DIR "/fivepipe", folder / "fivepipe");
    for (const char* program : {"capture_node", "recon_node", "sim_node", "render_node"})
      write_program(program, "echo pid $$ args \"$@\"\nexec sleep 1000\n");
  }
  ~Up() override {
    for (const pid_t pid : started) kill(pid, SIGKILL);
    fs::remove_all(folder);
  }

  void write_program(const std::string& name, const std::string& script) {
    std::ofstream(folder / name) << "#!/bin/sh\n" << script;
    fs::permissions(folder / name, fs::perms::owner_all);
  }

  pid_t start_up(const std::string& out, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {folder / "fivepipe",
                                      "up",
                                      FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml",
                                      "--out",
                                      folder / out,
                                      "--domain",
                                      std::to_string(fivepipe::test::own_domain())};
    words.insert(words.end(), more.begin(), more.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string said = said_file(out);
    const pid_t pid = fork();
    if (pid == 0) {
      const int fd = open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      dup2(fd, STDOUT_FILENO);
      dup2(fd, STDERR_FILENO);
      execv(argv[0], argv.data());
      _exit(127);
    }
    started.push_back(pid);
    return pid;
  }

  fs::path said_file(const std::string& out) const { return folder / (out + ".said"); }
  std::string said(const std::string& out = "out") const { return text_of(said_file(out)); }
  std::string log_of(const std::string& node) const {
    return text_of(folder / "out" / "log" / (node + ".log"));
  }

  bool all_nodes_run() const {
    return wait_for([&] {
      return std::all_of(nodes.begin(), nodes.end(), [&](const std::string& node) {
        return log_of(node).find('\n') != std::string::npos;
      });
    });
  }
  pid_t pid_of(const std::string& node) const { return std::stoi(log_of(node).substr(4)); }

  int exit_code_of(pid_t pid) {
    int status = 0;
    if (!wait_for([&] { return waitpid(pid, &status, WNOHANG) == pid; })) return -1;
    std::erase(started, pid);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
};

}  // namespace

TEST_F(Up, PassesArgumentsToNodes) {
  start_up("out");
  ASSERT_TRUE(all_nodes_run()) << said();
  const std::string args = log_of("recon_b");
  for (const std::string& part :
       {std::string("--deployment " FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml"),
        std::string("--node recon_b"), "--out " + (folder / "out").string(),
        "--domain " + std::to_string(fivepipe::test::own_domain())})
    EXPECT_NE(args.find(part), std::string::npos) << part << " is not in " << args;
}

TEST_F(Up, SigintStopsAllWithinTwoSecondsAndWritesReport) {
  // One node ignores the signals.
  write_program("sim_node", "trap '' TERM INT\necho pid $$\nexec sleep 1000\n");
  const pid_t up = start_up("out");
  ASSERT_TRUE(all_nodes_run()) << said();
  const auto begin = Clock::now();
  kill(up, SIGINT);
  EXPECT_EQ(exit_code_of(up), 130) << said();
  EXPECT_LT(Clock::now() - begin, 2s);
  for (const std::string& node : nodes)
    EXPECT_NE(kill(pid_of(node), 0), 0) << node << " still runs";
  EXPECT_NE(said().find("simulation did not end on SIGTERM"), std::string::npos) << said();
  const auto report = nlohmann::json::parse(text_of(folder / "out" / "report.json"));
  EXPECT_EQ(report["ended_by"], "SIGINT");
  EXPECT_EQ(report["nodes"]["simulation"]["end"], "killed by signal 9 (SIGKILL)");
  EXPECT_EQ(report["nodes"]["recon_a"]["pids"][0], pid_of("recon_a"));
}

TEST_F(Up, NodeThatCannotStartSetsExitCodeAndOutput) {
  write_program("sim_node", "echo the table is too low\nexit 3\n");
  const pid_t up = start_up("out");
  EXPECT_EQ(exit_code_of(up), 3) << said();
  EXPECT_NE(said().find("simulation cannot start: exit code 3"), std::string::npos) << said();
  EXPECT_NE(said().find("Its last output:\n  the table is too low"), std::string::npos) << said();
}

TEST_F(Up, NodesExitWhenUpIsKilled) {
  prctl(PR_SET_CHILD_SUBREAPER, 1);  // this process becomes the parent of orphans and can reap them
  const pid_t up = start_up("out");
  ASSERT_TRUE(all_nodes_run()) << said();
  kill(up, SIGKILL);
  EXPECT_EQ(exit_code_of(up), -SIGKILL);
  for (const std::string& node : nodes) {
    const pid_t pid = pid_of(node);
    EXPECT_TRUE(wait_for([&] { return waitpid(pid, nullptr, WNOHANG) == pid; }))
        << node << " still runs";
  }
}

TEST_F(Up, ASecondDeploymentOfTheSameNodesIsRefusedByName) {
  const pid_t first = start_up("out");
  ASSERT_TRUE(all_nodes_run()) << said();
  const auto composite = folder / "second" / "composite.png";
  std::filesystem::create_directories(composite.parent_path());
  std::ofstream(composite) << "of the first deployment";
  EXPECT_EQ(exit_code_of(start_up("second")), 2) << said("second");
  EXPECT_TRUE(std::filesystem::exists(composite)) << "a refused deployment deletes nothing";
  EXPECT_NE(said("second").find("node 'rendering' already runs in domain"), std::string::npos)
      << said("second");
  EXPECT_NE(said("second").find("process " + std::to_string(first)), std::string::npos)
      << said("second");
}

TEST_F(Up, EndOfInputStopsUpAndFailsWithoutComposites) {
  write_program("capture_node", "echo end of footage\nexit 0\n");
  EXPECT_EQ(exit_code_of(start_up("out")), 1);
  EXPECT_NE(said().find("no frame was composited"), std::string::npos) << said();
  EXPECT_EQ(nlohmann::json::parse(text_of(folder / "out" / "report.json"))["ended_by"],
            "every capture_node ended");
}
