// The supervisor with real processes: small shell scripts replace the nodes.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <sstream>

#include "launch/supervise/claims.h"
#include "launch/supervise/supervisor.h"
#include "tests/support/test_folder.h"

using namespace fivepipe;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;
// Maximum wait for events that should happen immediately. It is long because test machines are
// busy.
constexpr auto kTimeout = 30s;

class SupervisorTest : public ::testing::Test {
 protected:
  const test::TestFolder test_folder;
  const fs::path folder = test_folder.path;
  std::vector<std::string> events, lines;

  launch::Program node(const std::string& name, const std::string& script) {
    return {name, {"/bin/sh", "-c", script}, {}, folder / "log" / (name + ".log")};
  }

  launch::SupervisorOutput output() {
    return {.line = [this](const std::string& name,
                           const std::string& line) { lines.push_back(name + ": " + line); },
            .event = [this](const std::string& text) { events.push_back(text); }};
  }

  bool said(const std::string& part) const {
    return std::any_of(events.begin(), events.end(), [&](const std::string& text) {
      return text.find(part) != std::string::npos;
    });
  }
  bool printed(const std::string& line) const {
    return std::find(lines.begin(), lines.end(), line) != lines.end();
  }

  // Steps until the condition holds. Returns false after kTimeout.
  template <class Condition>
  static bool step_until(launch::Supervisor& supervisor, Condition condition) {
    const auto until = Clock::now() + kTimeout;
    while (!condition()) {
      if (Clock::now() > until) return false;
      supervisor.step(20ms);
    }
    return true;
  }
};

// exec replaces the shell, so that signals reach the sleep and no process outlives it.
const std::string kRunsForever = "echo up; exec sleep 1000";
const std::string kIgnoresSigterm = "trap '' TERM; echo up; exec sleep 1000";

bool exists(pid_t pid) { return kill(pid, 0) == 0; }

}  // namespace

TEST_F(SupervisorTest, ForwardsAndLogsOutputPerNode) {
  {
    launch::Supervisor supervisor(
        {node("capture", "echo to stdout; echo to stderr >&2; printf unfinished")}, {}, output());
    ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
    EXPECT_TRUE(supervisor.exited_cleanly("capture"));
  }
  EXPECT_EQ(lines, (std::vector<std::string>{"capture: to stdout", "capture: to stderr",
                                             "capture: unfinished"}));
  std::stringstream log;
  log << std::ifstream(folder / "log" / "capture.log").rdbuf();
  EXPECT_EQ(log.str(), "to stdout\nto stderr\nunfinished\n");
}

// A pipe that is not read stands for the disk: it takes 64 KB.
TEST_F(SupervisorTest, AHungDiskUnderTheLogDoesNotDelayTheSupervision) {
  const launch::Program printing =
      node("capture", "i=0; while [ $i -lt 200 ]; do printf '%01000d\\n' 0; i=$((i+1)); done");
  fs::create_directories(printing.log.parent_path());
  ASSERT_EQ(mkfifo(printing.log.c_str(), 0600), 0);
  const int unread = open(printing.log.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(unread, 0);
  auto supervisor = std::make_unique<launch::Supervisor>(std::vector{printing},
                                                         launch::RestartSettings{}, output());
  EXPECT_TRUE(step_until(*supervisor, [&] { return supervisor->all_exited(); }));
  EXPECT_EQ(lines.size(), 200u);
  EXPECT_FALSE(said("its log is incomplete"));
  const auto end = Clock::now();
  supervisor.reset();
  EXPECT_LT(Clock::now() - end, 1s);
  EXPECT_TRUE(said("capture: its log is incomplete"));
  close(unread);  // the writing thread ends
}

TEST_F(SupervisorTest, RestartsKilledNodeAndReportsCause) {
  launch::Supervisor supervisor({node("recon_a", kRunsForever), node("recon_b", kRunsForever)}, {},
                                output());
  ASSERT_TRUE(
      step_until(supervisor, [&] { return printed("recon_a: up") && printed("recon_b: up"); }));
  const pid_t first = supervisor.history()[0].processes[0].pid,
              other = supervisor.history()[1].processes[0].pid;
  lines.clear();
  kill(first, SIGKILL);
  ASSERT_TRUE(step_until(supervisor, [&] { return printed("recon_a: up"); }));
  EXPECT_TRUE(said("recon_a died: killed by signal 9 (SIGKILL), restart 1 in 0.25 s"));
  const auto history = supervisor.history();
  ASSERT_EQ(history[0].processes.size(), 2u);
  EXPECT_EQ(history[0].processes[0].end, "killed by signal 9 (SIGKILL)");
  EXPECT_GE(history[0].processes[1].start_stamp_ns - history[0].processes[0].start_stamp_ns,
            250'000'000);
  ASSERT_EQ(history[1].processes.size(), 1u);
  EXPECT_TRUE(exists(other));
}

TEST_F(SupervisorTest, NodeThatCannotStartStopsDeploymentWithItsOutput) {
  launch::Supervisor supervisor(
      {node("sim", kRunsForever), node("render", "echo scene.yaml:3:5: no such key; exit 2")}, {},
      output());
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  ASSERT_TRUE(supervisor.failure());
  EXPECT_EQ(supervisor.failure()->node, "render");
  EXPECT_EQ(supervisor.failure()->exit_code, 2);
  EXPECT_EQ(supervisor.failure()->last_lines,
            std::vector<std::string>{"scene.yaml:3:5: no such key"});
  EXPECT_EQ(supervisor.history()[0].processes[0].end, "killed by signal 15 (SIGTERM)");
  EXPECT_EQ(supervisor.history()[1].processes.size(), 1u);
}

TEST_F(SupervisorTest, RepeatedQuickExitsStopDeployment) {
  launch::RestartSettings fast;
  fast.first_delay_s = fast.max_delay_s = 0.01;
  launch::Supervisor supervisor({node("sim", "kill -SEGV $$")}, fast, output());
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  ASSERT_TRUE(supervisor.failure());
  EXPECT_EQ(supervisor.failure()->exit_code, 1);
  EXPECT_NE(supervisor.failure()->reason.find("SIGSEGV"), std::string::npos)
      << supervisor.failure()->reason;
  EXPECT_EQ(supervisor.history()[0].processes.size(), 5u);
}

TEST_F(SupervisorTest, ErrorNamesMissingProgram) {
  launch::Supervisor supervisor({{"capture", {(folder / "capture_node").string()}, {}, {}}}, {},
                                output());
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  ASSERT_TRUE(supervisor.failure());
  EXPECT_NE(
      supervisor.failure()->reason.find((folder / "capture_node").string() + ": No such file"),
      std::string::npos)
      << supervisor.failure()->reason;
}

TEST_F(SupervisorTest, AfterItsFirstStatusANodeWithoutHardwareIsRestarted) {
  const std::string gone_on_demand = "echo up; while [ ! -e " + (folder / "unplugged").string() +
                                     " ]; do sleep 0.02; done; exit 3";
  launch::Supervisor supervisor({node("capture", gone_on_demand)}, {}, output());
  ASSERT_TRUE(step_until(supervisor, [&] { return printed("capture: up"); }));
  supervisor.mark_healthy("capture", supervisor.history()[0].processes[0].start_stamp_ns + 1);
  std::ofstream(folder / "unplugged") << '\n';
  ASSERT_TRUE(step_until(supervisor, [&] { return said("restart 1"); }));
  EXPECT_FALSE(supervisor.failure());
}

TEST_F(SupervisorTest, IgnoresStatusFromBeforeDeployment) {
  launch::Supervisor supervisor({node("capture", "exit 3")}, {}, output());
  supervisor.mark_healthy("capture", supervisor.history()[0].processes[0].start_stamp_ns - 1);
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  ASSERT_TRUE(supervisor.failure());
  EXPECT_EQ(supervisor.failure()->exit_code, 3);
}

TEST_F(SupervisorTest, StopsAllWithinTwoSecondsAndReportsKilledNodes) {
  launch::Supervisor supervisor({node("sim", kRunsForever), node("render", kIgnoresSigterm)}, {},
                                output());
  ASSERT_TRUE(step_until(supervisor, [&] { return printed("sim: up") && printed("render: up"); }));
  const auto begin = Clock::now();
  supervisor.stop(1500ms);
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  EXPECT_LT(Clock::now() - begin, 2s);
  EXPECT_EQ(supervisor.killed(), std::vector<std::string>{"render"});
  EXPECT_TRUE(supervisor.crashed_while_stopping().empty());
  for (const launch::ProgramHistory& program : supervisor.history())
    EXPECT_FALSE(exists(program.processes[0].pid)) << program.name;
}

TEST_F(SupervisorTest, CrashWhileStoppingIsNotACleanExit) {
  launch::Supervisor supervisor(
      {node("render", "trap 'kill -ABRT $$' TERM; echo up; while :; do sleep 0.05; done")}, {},
      output());
  ASSERT_TRUE(step_until(supervisor, [&] { return printed("render: up"); }));
  supervisor.stop(10s);
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  EXPECT_EQ(supervisor.crashed_while_stopping(), std::vector<std::string>{"render"});
}

TEST_F(SupervisorTest, NothingIsStartedOnceStopping) {
  launch::RestartSettings settings;
  settings.first_delay_s = 1000;
  launch::Supervisor supervisor({node("sim", "exit 1")}, settings, output());
  ASSERT_TRUE(step_until(supervisor, [&] { return said("restart 1"); }));
  EXPECT_FALSE(supervisor.all_exited());
  supervisor.stop(0ms);
  EXPECT_TRUE(supervisor.all_exited());
}

TEST_F(SupervisorTest, KillsProcessGroupOfNode) {
  launch::Supervisor supervisor({node("capture", "sleep 1000 & echo $!; exit 1")}, {}, output());
  ASSERT_TRUE(step_until(supervisor, [&] { return said("restart 1"); }));
  ASSERT_FALSE(lines.empty());
  const pid_t grandchild = std::stoi(lines.front().substr(lines.front().find(": ") + 2));
  supervisor.stop(0ms);
  // An orphan that no process reaps remains as a zombie, state Z.
  EXPECT_TRUE(step_until(supervisor, [&] {
    std::ifstream stat("/proc/" + std::to_string(grandchild) + "/stat");
    std::string pid, name, state;
    return !(stat >> pid >> name >> state) || state == "Z";
  }));
}

TEST_F(SupervisorTest, ANodeIsPinnedToItsCores) {
  const int core = [] {
    cpu_set_t allowed;
    CPU_ZERO(&allowed);
    sched_getaffinity(0, sizeof allowed, &allowed);
    int last = 0;
    for (int i = 0; i < CPU_SETSIZE; ++i)
      if (CPU_ISSET(i, &allowed)) last = i;
    return last;
  }();
  launch::Program pinned = node("recon_a", "grep Cpus_allowed_list /proc/self/status");
  pinned.cores = {core};
  launch::Supervisor supervisor({pinned}, {}, output());
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  EXPECT_EQ(lines,
            std::vector<std::string>{"recon_a: Cpus_allowed_list:\t" + std::to_string(core)});
}

TEST_F(SupervisorTest, ReportsMissingCore) {
  launch::Program pinned = node("recon_a", "exit 0");
  pinned.cores = {CPU_SETSIZE + 5};
  launch::Supervisor supervisor({pinned}, {}, output());
  EXPECT_TRUE(said("recon_a: core " + std::to_string(CPU_SETSIZE + 5) + " is not available"));
}

TEST_F(SupervisorTest, ChildrenExitWhenSupervisorIsKilled) {
  prctl(PR_SET_CHILD_SUBREAPER,
        1);  // this process becomes the parent of orphans and can wait for them
  const fs::path pid_file = folder / "pid";
  const pid_t supervisor_pid = fork();
  if (supervisor_pid == 0) {
    launch::Supervisor supervisor(
        {node("render", "trap '' TERM; echo $$ > " + pid_file.string() + ".new; mv " +
                            pid_file.string() + ".new " + pid_file.string() + "; exec sleep 1000")},
        {}, {});
    for (;;) supervisor.step(20ms);
  }
  const auto until = Clock::now() + kTimeout;
  while (!fs::exists(pid_file) && Clock::now() < until) sched_yield();
  pid_t node_pid = 0;
  ASSERT_TRUE(std::ifstream(pid_file) >> node_pid);
  kill(supervisor_pid, SIGKILL);
  ASSERT_EQ(waitpid(supervisor_pid, nullptr, 0), supervisor_pid);
  int status = 0;
  pid_t reaped = 0;
  while ((reaped = waitpid(node_pid, &status, WNOHANG)) <= 0 && Clock::now() < until) sched_yield();
  ASSERT_EQ(reaped, node_pid);
  EXPECT_TRUE(WIFSIGNALED(status));
}

TEST(NodeClaims, ErrorNamesHolderOfTakenName) {
  const std::uint32_t domain = 100000 + std::uint32_t(getpid());  // unused by other tests
  launch::NodeClaims first(domain, {"capture", "sim"});
  try {
    launch::NodeClaims second(domain, {"render", "sim"});
    FAIL() << "the second claim was granted";
  } catch (const launch::ClaimRefused& taken) {
    const std::string what = taken.what();
    EXPECT_NE(what.find("'sim'"), std::string::npos) << what;
    EXPECT_NE(what.find("process " + std::to_string(getpid())), std::string::npos) << what;
    EXPECT_EQ(what.find("'render'"), std::string::npos) << what;
  }
  launch::NodeClaims free_name(domain, {"render"});  // the refused claim does not hold it
  launch::NodeClaims other_domain(domain + 1'000'000'000, {"sim"});
}

TEST(NodeClaims, NameIsReleasedWhenHolderExits) {
  const std::uint32_t domain = 100000 + std::uint32_t(getpid());
  { launch::NodeClaims first(domain, {"sim"}); }
  EXPECT_NO_THROW(launch::NodeClaims(domain, {"sim"}));
}

class FolderClaimTest : public SupervisorTest {};

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
      EXPECT_NE(what.find("process " + std::to_string(getpid())), std::string::npos) << what;
      EXPECT_NE(what.find(name.string()), std::string::npos) << what;
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
    EXPECT_NE(std::string(error.what()).find("missing"), std::string::npos) << error.what();
  }
}
