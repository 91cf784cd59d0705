// The supervisor with real processes: small shell scripts replace the nodes.
#include <fcntl.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <sstream>

#include "tests/launch/supervise/supervisor_fixture.h"
#include "tests/support/process/open_files.h"
#include "tests/support/process/stat.h"
#include "tests/support/sanitizer.h"

using namespace fivepipe;
using namespace fivepipe::test;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

TEST_F(SupervisorTest, ForwardsAndLogsOutputPerNode) {
  const std::size_t open_before = open_files();
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
  log.clear();
  EXPECT_EQ(open_files(), open_before);
  const mode_t mask = umask(0);
  umask(mask);
  struct stat of_log {};
  ASSERT_EQ(stat((folder / "log" / "capture.log").c_str(), &of_log), 0);
  EXPECT_EQ(of_log.st_mode & 0777, 0666 & ~mask) << "others may read it";
}

// A node that prints, dies, is restarted and ends without an open output. Each event ends a step
// long before its maximum wait.
TEST_F(SupervisorTest, AStepEndsAtTheNextEvent) {
  constexpr auto kWait = 20s;
  const auto begin = Clock::now();
  const auto step_until_all_exited = [&](launch::Supervisor& supervisor) {
    while (!supervisor.all_exited() && Clock::now() - begin < kWait) supervisor.step(kWait);
    EXPECT_TRUE(supervisor.all_exited());
    EXPECT_LT(Clock::now() - begin, kWait);
  };
  const std::string second = (folder / "second").string();
  launch::Supervisor restarting(
      {node("sim", "if [ -e " + second + " ]; then exec >&- 2>&-; sleep 0.1; exit 0; fi; touch " +
                       second + "; sleep 0.1; echo first; exit 1")},
      {}, output());
  step_until_all_exited(restarting);
  EXPECT_TRUE(restarting.exited_cleanly("sim"));
  EXPECT_EQ(restarting.history()[0].processes.size(), 2u);
  EXPECT_EQ(lines, std::vector<std::string>{"sim: first"});
  launch::Supervisor stopping({node("render", kIgnoresSigterm)}, {}, output());
  ASSERT_TRUE(step_until(stopping, [&] { return printed("render: up"); }));
  stopping.stop(50ms);
  step_until_all_exited(stopping);
  EXPECT_EQ(stopping.killed(), std::vector<std::string>{"render"});
}

TEST_F(SupervisorTest, AsksForTheArgumentsOfEachStart) {
  launch::Program sim = node("sim", "echo $1; exit ${1#start}");
  int starts = 0;
  sim.arguments_at_start = [&] {
    return std::vector<std::string>{"sh", "start" + std::to_string(2 - ++starts)};
  };
  launch::Supervisor supervisor({sim}, {}, output());
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  EXPECT_EQ(lines, (std::vector<std::string>{"sim: start1", "sim: start0"}));
}

TEST_F(SupervisorTest, AStepWaitsWhileNothingHappens) {
  launch::Supervisor supervisor({node("sim", kRunsForever)}, {}, output());
  ASSERT_TRUE(step_until(supervisor, [&] { return printed("sim: up"); }));
  const auto begin = Clock::now();
  supervisor.step(100ms);
  EXPECT_GE(Clock::now() - begin, 99ms);
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
  launch::Supervisor supervisor(
      {{"capture", {(folder / "capture_node").string()}, {}, {}}, node("sim", kRunsForever)}, {},
      output());
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.all_exited(); }));
  ASSERT_TRUE(supervisor.failure());
  EXPECT_NE(
      supervisor.failure()->reason.find((folder / "capture_node").string() + ": No such file"),
      std::string::npos)
      << supervisor.failure()->reason;
  EXPECT_EQ(supervisor.failure()->exit_code, 1);
  EXPECT_TRUE(supervisor.history()[1].processes.empty()) << "no further node is started";
}

TEST_F(SupervisorTest, AfterItsFirstStatusANodeWithoutHardwareIsRestarted) {
  const std::string gone_on_demand = "echo up; while [ ! -e " + (folder / "unplugged").string() +
                                     " ]; do sleep 0.02; done; exit 3";
  launch::Supervisor supervisor({node("capture", gone_on_demand)}, {}, output());
  ASSERT_TRUE(step_until(supervisor, [&] { return printed("capture: up"); }));
  supervisor.mark_healthy("capture", supervisor.history()[0].processes[0].pid);
  std::ofstream(folder / "unplugged") << '\n';
  ASSERT_TRUE(step_until(supervisor, [&] { return said("restart 1"); }));
  EXPECT_FALSE(supervisor.failure());
}

TEST_F(SupervisorTest, IgnoresTheStatusOfAProcessThatItHasNotStarted) {
  launch::Supervisor supervisor({node("capture", "exit 3")}, {}, output());
  supervisor.mark_healthy("capture", getpid());
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
    const char state = state_in("/proc/" + std::to_string(grandchild) + "/stat");
    return state == 'X' || state == 'Z';
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
  supervisor.mark_healthy("sim", supervisor.history()[1].processes[0].pid);
  ASSERT_TRUE(step_until(supervisor, [&] { return supervisor.failure().has_value(); }));
  EXPECT_EQ(supervisor.failure()->exit_code, 3);
  launch::Supervisor healthy({node("capture", "exit 3")}, {}, output());
  healthy.mark_healthy("capture", healthy.history()[0].processes[0].pid);
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
                       "capture: its log is incomplete: the disk is full or too slow, or the "
                       "processor is overloaded"),
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

namespace {

// Beats 20 times per second, forever or this number of times.
std::string beats(const std::string& times = "") {
  return "i=0; while [ $((i += 1)) -ne 0" + (times.empty() ? "" : " ] && [ $i -le " + times) +
         " ]; do printf \"\\\\$(printf %03o $((i % 200 + 1)))\" "
         "1<>/proc/self/fd/$FIVEPIPE_HEARTBEAT; [ $i -ne 2 ] || echo beats; sleep 0.05; done; ";
}

}  // namespace

// A busy machine may hold up the node that beats for a second.
TEST_F(SupervisorTest, ANodeThatStopsBeatingIsKilledAndRestarted) {
  launch::Supervisor supervisor({node("hangs", beats("20") + "exec sleep 1000"),
                                 node("beats", beats()), node("starts", kRunsForever)},
                                {}, output(),
                                launch::WatchdogSettings{.no_heartbeat_s = 1.5 * kSlowdown});
  ASSERT_TRUE(
      step_until(supervisor, [&] { return supervisor.history()[0].processes.size() == 3; }));
  EXPECT_TRUE(said("hangs is stalled: no heartbeat for ")) << testing::PrintToString(events);
  EXPECT_TRUE(said("hangs died: killed by signal 9 (SIGKILL), restart 1 in ")) << events.size();
  EXPECT_EQ(supervisor.history()[1].processes.size(), 1u) << testing::PrintToString(events);
  EXPECT_EQ(supervisor.history()[2].processes.size(), 1u) << "it has not begun to beat";
}

TEST_F(SupervisorTest, WithoutAWatchdogANodeMayStopBeating) {
  launch::Supervisor supervisor({node("hangs", kRunsForever)}, {}, output(), std::nullopt);
  const auto until = Clock::now() + 2s;
  while (Clock::now() < until) supervisor.step(20ms);
  EXPECT_EQ(supervisor.history()[0].processes.size(), 1u) << testing::PrintToString(events);
}

TEST_F(SupervisorTest, ANodeThatADebuggerHoldsIsNotStalled) {
  launch::Supervisor supervisor({node("traced", beats())}, {}, output(),
                                launch::WatchdogSettings{.no_heartbeat_s = 0.5 * kSlowdown});
  const pid_t pid = supervisor.history()[0].processes[0].pid;
  ASSERT_TRUE(step_until(supervisor, [&] { return printed("traced: beats"); }));
  ASSERT_EQ(ptrace(PTRACE_SEIZE, pid, nullptr, nullptr), 0);
  ASSERT_EQ(ptrace(PTRACE_INTERRUPT, pid, nullptr, nullptr), 0);
  const auto until = Clock::now() + 1500ms * kSlowdown;
  while (Clock::now() < until) supervisor.step(20ms);
  EXPECT_EQ(supervisor.history()[0].processes.size(), 1u) << testing::PrintToString(events);
  EXPECT_FALSE(said("stalled")) << testing::PrintToString(events);
}
