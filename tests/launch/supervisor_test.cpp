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
#include <utility>
#include <vector>

#include "launch/supervise/claims.h"
#include "launch/supervise/supervisor.h"
#include "tests/support/sanitizer.h"
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

// A pipe that is not read stands for the disk: it takes 64 KiB of 200 kB.
TEST_F(SupervisorTest, AHungDiskUnderTheLogDoesNotDelayTheSupervision) {
  const launch::Program printing =
      node("capture", "i=0; while [ $i -lt 200 ]; do printf '%01000d\\n' 0; i=$((i+1)); done");
  fs::create_directories(printing.log.parent_path());
  ASSERT_EQ(mkfifo(printing.log.c_str(), 0600), 0);
  const int unread = open(printing.log.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(unread, 0);
  ASSERT_EQ(fcntl(unread, F_SETPIPE_SZ, 65536), 65536);
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
  EXPECT_LT(Clock::now() - begin, 2s * test::kSlowdown);
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

TEST_F(SupervisorTest, AFailureHasTheLastFifteenLines) {
  launch::Supervisor supervisor(
      {node("sim", "i=0; while [ $i -lt 20 ]; do echo $i; i=$((i+1)); done; exit 2")}, {},
      output());
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  ASSERT_TRUE(supervisor.failure());
  EXPECT_EQ(supervisor.failure()->last_lines.size(), 15u);
  EXPECT_EQ(supervisor.failure()->last_lines.front(), "5");
  EXPECT_EQ(supervisor.failure()->last_lines.back(), "19");
  EXPECT_TRUE(
      said("sim cannot start: exit code 2 (usage or configuration); stopping the "
           "deployment"));
  EXPECT_EQ(supervisor.history()[0].program, "sh");
  EXPECT_EQ(supervisor.history()[0].processes[0].end, "exit code 2 (usage or configuration)");
}

TEST_F(SupervisorTest, TheFirstFailureIsTheReason) {
  const std::string until_both_run =
      "while [ ! -e " + (folder / "go").string() + " ]; do sleep 0.01; done; exit ";
  launch::Supervisor supervisor({node("a", until_both_run + "2"), node("b", until_both_run + "3")},
                                {}, output());
  std::ofstream(folder / "go") << '\n';
  // Both have ended before the supervisor polls them.
  for (const launch::ProgramHistory& program : supervisor.history()) {
    siginfo_t ended{};
    ASSERT_EQ(waitid(P_PID, id_t(program.processes[0].pid), &ended, WEXITED | WNOWAIT), 0);
  }
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  EXPECT_EQ(supervisor.failure()->node, "a");
  EXPECT_EQ(supervisor.failure()->exit_code, 2);
  EXPECT_EQ(supervisor.crashed_while_stopping(), std::vector<std::string>{"b"});
  EXPECT_TRUE(said("b died while stopping: exit code 3 (hardware or peer missing)"));
}

TEST_F(SupervisorTest, OnlyAStatusOfTheNodeItselfMarksItAsHealthy) {
  launch::Supervisor supervisor({node("capture", "exit 3"), node("sim", kRunsForever)}, {},
                                output());
  supervisor.mark_healthy("sim", supervisor.history()[1].processes[0].start_stamp_ns + 1000);
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.failure().has_value(); }));
  EXPECT_EQ(supervisor.failure()->exit_code, 3);
  launch::Supervisor healthy({node("capture", "exit 3")}, {}, output());
  healthy.mark_healthy("capture", healthy.history()[0].processes[0].start_stamp_ns);
  ASSERT_TRUE(step_until(healthy, [&] { return said("capture died: exit code 3"); }));
  EXPECT_FALSE(healthy.failure());
}

TEST_F(SupervisorTest, AfterStopExitCodes0And130AreExpected) {
  const auto exits = [&](const std::string& name, const std::string& code) {
    return node(name, "trap 'exit " + code + "' TERM; echo up; while :; do sleep 0.02; done");
  };
  launch::Supervisor supervisor({exits("a", "0"), exits("b", "130"), exits("c", "1")}, {},
                                output());
  ASSERT_TRUE(step_until(supervisor, [&] { return lines.size() == 3; }));
  supervisor.stop(20s);
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  EXPECT_EQ(supervisor.crashed_while_stopping(), std::vector<std::string>{"c"});
  EXPECT_EQ(events, std::vector<std::string>{"c died while stopping: exit code 1 (failed)"});
  EXPECT_TRUE(supervisor.killed().empty());
  EXPECT_FALSE(supervisor.exited_cleanly("a")) << "not before stop()";
}

TEST_F(SupervisorTest, ALaterStopCanOnlyShortenTheGrace) {
  for (const bool shortens : {true, false}) {
    lines.clear();
    launch::Supervisor supervisor({node("render", kIgnoresSigterm)}, {}, output());
    ASSERT_TRUE(step_until(supervisor, [&] { return printed("render: up"); }));
    supervisor.stop(shortens ? 1000s : 0s);
    supervisor.stop(shortens ? 0s : 1000s);
    ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
    EXPECT_EQ(supervisor.killed(), std::vector<std::string>{"render"});
    EXPECT_TRUE(supervisor.crashed_while_stopping().empty()) << "the supervisor killed it";
  }
}

TEST_F(SupervisorTest, ALogThatCannotBeWrittenIsReported) {
  launch::Program program = node("capture", "echo line");
  fs::create_directories(program.log);
  launch::Supervisor supervisor({program}, {}, output());
  EXPECT_EQ(events, std::vector<std::string>{"capture: cannot write " + program.log.string()});
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  EXPECT_TRUE(printed("capture: line"));
  EXPECT_TRUE(said("capture exited cleanly"));
  EXPECT_FALSE(said("incomplete"));
}

TEST_F(SupervisorTest, AFullDiskUnderTheLogIsReportedOnce) {
  launch::Program program =
      node("capture", "while [ ! -e " + (folder / "end").string() + " ]; do echo line; done");
  program.log = "/dev/full";
  auto supervisor = std::make_unique<launch::Supervisor>(std::vector{program},
                                                         launch::RestartSettings{}, output());
  ASSERT_TRUE(step_until(*supervisor, [&] { return said("its log is incomplete"); }));
  const std::size_t before = lines.size();
  ASSERT_TRUE(step_until(*supervisor, [&] { return lines.size() > before + 10; }));
  std::ofstream(folder / "end") << '\n';
  ASSERT_TRUE(step_until(*supervisor, [&] { return supervisor->all_exited(); }));
  supervisor.reset();
  EXPECT_EQ(std::count(events.begin(), events.end(),
                       "capture: its log is incomplete: the disk is full or too slow"),
            1);
}

TEST_F(SupervisorTest, OutputIsForwardedWhenItsEndIsClosed) {
  launch::Supervisor supervisor({node("sim", "printf unfinished; exec sleep 1000 >&- 2>&-")}, {},
                                output());
  ASSERT_TRUE(step_until(supervisor, [&] { return printed("sim: unfinished"); }));
  EXPECT_TRUE(exists(supervisor.history()[0].processes[0].pid));
  supervisor.stop(20s);
  EXPECT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
}

TEST_F(SupervisorTest, AnUnavailableCoreIsReportedAndTheOthersAreUsed) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  sched_getaffinity(0, sizeof allowed, &allowed);
  int first = 0;
  while (!CPU_ISSET(first, &allowed)) ++first;
  launch::Program pinned = node("recon_a", "grep Cpus_allowed_list /proc/self/status");
  pinned.cores = {first, -1, CPU_SETSIZE};
  launch::Supervisor supervisor({pinned}, {}, output());
  const auto missing = [](int core) {
    return "recon_a: core " + std::to_string(core) +
           " is not available on this machine; the node is not pinned to it";
  };
  EXPECT_EQ(events, (std::vector<std::string>{missing(-1), missing(CPU_SETSIZE)}));
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  EXPECT_EQ(lines,
            std::vector<std::string>{"recon_a: Cpus_allowed_list:\t" + std::to_string(first)});
}

// Nodes inherit neither the input, nor the open files, nor the signal settings of `fivepipe up`.
TEST_F(SupervisorTest, AChildStartsWithTheDefaultsOfAProcess) {
  int to_stdin[2];
  ASSERT_EQ(pipe(to_stdin), 0);
  ASSERT_EQ(write(to_stdin[1], "typed\n", 6), 6);
  close(to_stdin[1]);
  const int own_stdin = dup(STDIN_FILENO);
  dup2(to_stdin[0], STDIN_FILENO);
  std::ofstream(folder / "inherited") << "text";
  std::vector<int> inherited;  // the lowest free numbers, without O_CLOEXEC
  for (int i = 0; i < 3; ++i) inherited.push_back(open((folder / "inherited").c_str(), O_RDONLY));
  sigset_t all, before;
  sigfillset(&all);
  sigprocmask(SIG_SETMASK, &all, &before);
  std::vector<std::pair<int, sighandler_t>> handlers;
  for (const int number : {SIGINT, SIGTERM, SIGPIPE})
    handlers.emplace_back(number, signal(number, SIG_IGN));
  // A test in the background may have started with these ignored, which nodes inherit.
  for (const int number : {SIGHUP, SIGQUIT}) handlers.emplace_back(number, signal(number, SIG_DFL));
  {
    launch::ChildProcess child({"/bin/sh", "-c",
                                "cat; echo to stderr >&2; ls -l /proc/self/fd | grep -c inherited; "
                                "grep -E 'SigBlk|SigIgn' /proc/self/status"},
                               {});
    std::vector<std::string> printed;
    const auto until = Clock::now() + kTimeout;
    for (bool ended = false; !ended && Clock::now() < until;) {
      ended = child.wait_for_end(1ms);
      for (const std::string& line : child.read_lines(ended)) printed.push_back(line);
    }
    EXPECT_EQ(printed, (std::vector<std::string>{"to stderr", "0", "SigBlk:\t0000000000000000",
                                                 "SigIgn:\t0000000000000000"}));
    EXPECT_EQ(child.output_fd(), -1);
  }
  for (const auto& [number, handler] : handlers) signal(number, handler);
  sigprocmask(SIG_SETMASK, &before, nullptr);
  for (const int file : inherited) close(file);
  dup2(own_stdin, STDIN_FILENO);
  for (const int file : {own_stdin, to_stdin[0]}) close(file);
}

TEST_F(SupervisorTest, ADestroyedChildLeavesNoOpenFile) {
  int output = -1;
  {
    const launch::ChildProcess child({"/bin/sh", "-c", kRunsForever}, {});
    output = child.output_fd();
    ASSERT_NE(fcntl(output, F_GETFD), -1);
  }
  EXPECT_EQ(fcntl(output, F_GETFD), -1);
}

// The supervisor would otherwise need memory for any length.
TEST_F(SupervisorTest, ALineOfMoreThan64KiBIsSplit) {
  launch::ChildProcess child({"/bin/sh", "-c", "printf '%0300000d\\nlast\\n' 0"}, {});
  std::vector<std::string> pieces;
  const auto until = Clock::now() + kTimeout;
  while (child.output_fd() >= 0 && Clock::now() < until)
    for (const std::string& line : child.read_lines()) pieces.push_back(line);
  ASSERT_GE(pieces.size(), 4u);
  EXPECT_EQ(pieces.back(), "last");
  pieces.pop_back();
  std::size_t bytes = 0;
  constexpr std::size_t kLimit = 64 * 1024, kReadBytes = 16 * 1024;
  for (const std::string& piece : pieces) {
    bytes += piece.size();
    EXPECT_LE(piece.size(), kLimit + kReadBytes);
    if (&piece != &pieces.back()) {
      EXPECT_GT(piece.size(), kLimit);
    }
  }
  EXPECT_EQ(bytes, 300'000u);
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
    EXPECT_NE(what.find("in domain " + std::to_string(domain) + ", started by process "),
              std::string::npos)
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
