// `fivepipe up` as a process; shell scripts replace the nodes.
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/wait.h>

#include <regex>

#include "tests/launch/cli/up_fixture.h"
#include "tests/support/sanitizer.h"

using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace fivepipe::test {
namespace {

TEST_F(Up, PassesArgumentsToNodes) {
  const Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  const std::string args = log_of("recon_b");
  for (const std::string& part :
       {std::string("--deployment " FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml"),
        std::string("--node recon_b"), "--out " + (folder_ / "out").string(),
        "--domain " + std::to_string(domain_)})
    EXPECT_NE(args.find(part), std::string::npos) << part << " is not in " << args;
}

// llvmpipe would start a thread per core in each process.
TEST_F(Up, NodesDrawWithOneThreadUnlessTheEnvironmentStatesAnotherNumber) {
  write_nodes("echo threads $LP_NUM_THREADS\nexec sleep 1000\n");
  const char* const set = getenv("LP_NUM_THREADS");
  const std::string before = set ? set : "";
  for (const auto& [given, expected] : {std::pair{"", "1"}, {"3", "3"}}) {
    *given ? setenv("LP_NUM_THREADS", given, 1) : unsetenv("LP_NUM_THREADS");
    fs::remove_all(folder_ / "out");
    Program& up = start_up();
    ASSERT_TRUE(all_nodes_run()) << up.said();
    EXPECT_EQ(log_of("rendering"), std::string("threads ") + expected + "\n");
    up.signal(SIGINT);
    EXPECT_EQ(up.wait_for_end(kTimeout), 130) << up.said();
  }
  set ? setenv("LP_NUM_THREADS", before.c_str(), 1) : unsetenv("LP_NUM_THREADS");
}

TEST_F(Up, OnlyResultsOfAnEarlierRunAreDeleted) {
  fs::create_directories(folder_ / "out");
  for (const char* file : {"report.json", "composite.mp4", "composite_0001.png", "report.txt"})
    std::ofstream(folder_ / "out" / file) << "earlier";
  const Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  for (const char* file : {"report.json", "composite.mp4", "composite_0001.png"})
    EXPECT_FALSE(fs::exists(folder_ / "out" / file)) << file;
  EXPECT_EQ(text_of(folder_ / "out" / "report.txt"), "earlier");
  EXPECT_TRUE(says(up, "[capture]    pid ")) << up.said();
  EXPECT_TRUE(says(up, "[simulation] pid ")) << "the widest name: " << up.said();
}

TEST_F(Up, SigintStopsAllWithinTwoSecondsAndWritesReport) {
  // One node ignores the signals.
  write_program("sim_node", "trap '' TERM INT\necho pid $$\nexec sleep 1000\n");
  Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  const auto begin = Clock::now();
  up.signal(SIGINT);
  EXPECT_EQ(up.wait_for_end(kTimeout), 130) << up.said();
  EXPECT_LT(Clock::now() - begin, 2s * test::kSlowdown);
  for (const std::string& node : nodes_)
    EXPECT_NE(kill(pid_of(node), 0), 0) << node << " still runs";
  EXPECT_NE(up.said().find("simulation did not end on SIGTERM"), std::string::npos) << up.said();
  const auto report = this->report();
  EXPECT_EQ(report["ended_by"], "SIGINT");
  EXPECT_EQ(report["nodes"]["simulation"]["end"], "killed by signal 9 (SIGKILL)");
  EXPECT_EQ(report["nodes"]["recon_a"]["pids"][0], pid_of("recon_a"));
}

TEST_F(Up, NodeThatCannotStartSetsExitCodeAndOutput) {
  write_program("sim_node", "echo the table is too low\nexit 3\n");
  Program& up = start_up();
  EXPECT_EQ(up.wait_for_end(kTimeout), 3) << up.said();
  EXPECT_NE(up.said().find("simulation cannot start: exit code 3"), std::string::npos) << up.said();
  EXPECT_NE(up.said().find("Its last output:\n  the table is too low"), std::string::npos)
      << up.said();
  EXPECT_EQ(report()["ended_by"],
            "simulation cannot start: exit code 3 (hardware or peer missing)");
}

TEST_F(Up, NodesExitWhenUpIsKilled) {
  prctl(PR_SET_CHILD_SUBREAPER, 1);  // this process becomes the parent of orphans and can reap them
  Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  up.signal(SIGKILL);
  EXPECT_EQ(up.wait_for_end(kTimeout), 128 + SIGKILL);
  for (const std::string& node : nodes_) {
    const pid_t pid = pid_of(node);
    EXPECT_TRUE(wait_for([&] { return waitpid(pid, nullptr, WNOHANG) == pid; }))
        << node << " still runs";
  }
}

TEST_F(Up, ASecondDeploymentOfTheSameNodesIsRefusedByName) {
  const Program& first = start_up();
  ASSERT_TRUE(all_nodes_run()) << first.said();
  const auto composite = folder_ / "second" / "composite.png";
  fs::create_directories(composite.parent_path());
  std::ofstream(composite) << "of the first deployment";
  Program& second = start_up("second", {}, "second.said");
  EXPECT_EQ(second.wait_for_end(kTimeout), 2) << second.said();
  EXPECT_TRUE(fs::exists(composite)) << "a refused deployment deletes nothing";
  EXPECT_NE(second.said().find("node 'rendering' already runs in domain"), std::string::npos)
      << second.said();
  EXPECT_NE(second.said().find("process " + std::to_string(first.pid())), std::string::npos)
      << second.said();
}

// Whatever its domain, a second `up` deletes nothing in the folder of a running one.
TEST_F(Up, ASecondUpLeavesTheResultsOfARunningOne) {
  Program& first = start_up();
  ASSERT_TRUE(all_nodes_run()) << first.said();
  const fs::path video = folder_ / "out" / "composite.mp4",
                 report = folder_ / "out" / "report.json";
  for (const fs::path& result : {video, report}) std::ofstream(result) << "of the running one";
  const std::string log = log_of("recon_a");
  for (const std::uint32_t domain : {domain_, own_second_domain()}) {
    Program& second = start(up_words("out", domain), "second.said");
    ASSERT_EQ(second.wait_for_end(kTimeout), 2) << second.said();
    EXPECT_NE(second.said().find("process " + std::to_string(first.pid())), std::string::npos)
        << second.said();
    EXPECT_NE(second.said().find(domain == domain_ ? "choose another --domain"
                                                   : (folder_ / "out").string() + "\n"),
              std::string::npos)
        << second.said();
    for (const fs::path& result : {video, report})
      EXPECT_EQ(text_of(result), "of the running one") << result;
    EXPECT_EQ(log_of("recon_a"), log);
  }
  first.signal(SIGINT);
  ASSERT_EQ(first.wait_for_end(kTimeout), 130) << first.said();
  EXPECT_EQ(this->report()["ended_by"], "SIGINT");
  // The end of the first one releases the folder.
  Program& third = start(up_words("out", own_second_domain()), "third.said");
  EXPECT_TRUE(wait_for([&] { return !fs::exists(video); })) << third.said();
}

TEST_F(Up, ContinuesAndReportsAfterTheReaderOfItsOutputHasEnded) {
  write_nodes("while :; do echo line; sleep 0.02; done\n");
  Program& up = start_into_head(up_words("out", domain_), "said");
  ASSERT_TRUE(says(up, "\n")) << up.said();
  // `up` prints a line before it writes it to the log.
  const std::size_t bytes = log_of("capture").size();
  ASSERT_TRUE(
      wait_for([&] { return log_of("capture").size() > bytes + 100 || up.wait_for_end(0ms); }));
  up.signal(SIGINT);
  EXPECT_EQ(up.wait_for_end(kTimeout), 130);
  EXPECT_EQ(report()["ended_by"], "SIGINT");
}

TEST_F(Up, NodesHaveTheDefaultDispositionOfSigpipe) {
  write_nodes("grep SigIgn /proc/self/status\nexec sleep 1000\n");
  const Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  const std::string log = log_of("capture"), field = "SigIgn:";
  ASSERT_EQ(log.find(field), 0u) << log;
  EXPECT_EQ(std::stoull(log.substr(field.size()), nullptr, 16) >> (SIGPIPE - 1) & 1, 0u) << log;
}

TEST_F(Up, OtherCommandsEndWithoutASignalIfTheirReaderEnds) {
  const std::string program = FIVEPIPE_BINARY_DIR "/fivepipe", domain = std::to_string(domain_);
  Program& top = start_into_head({program, "top", "--domain", domain}, "top.said");
  Program& hz = start_into_head({program, "hz", "HeadPose", "--domain", domain}, "hz.said");
  const fs::path file = folder_ / "session.mcap";
  Program& record =
      start_into_head({program, "record", "-o", file, "--domain", domain}, "record.said");
  EXPECT_EQ(top.wait_for_end(kTimeout), 0);
  EXPECT_EQ(hz.wait_for_end(kTimeout), 0);
  ASSERT_TRUE(says(record, "recording"));
  record.signal(SIGTERM);
  EXPECT_EQ(record.wait_for_end(kTimeout), 1) << "no message arrived";
}

// A traced process outlives SIGKILL until its tracer takes notice, as a process does that waits for
// a disk in the kernel.
TEST_F(Up, AProcessThatOutlivesSigkillDoesNotDelayTheEnd) {
  Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  const pid_t stuck = pid_of("recon_b");
  ASSERT_EQ(ptrace(PTRACE_SEIZE, stuck, nullptr, nullptr), 0) << strerror(errno);
  const auto begin = Clock::now();
  up.signal(SIGINT);
  EXPECT_EQ(up.wait_for_end(kTimeout), 130) << up.said();
  // 1.3 s until SIGKILL and 0.3 s after it; the rest is for a busy machine.
  EXPECT_LT(Clock::now() - begin, 5s);
  EXPECT_NE(
      up.said().find("recon_b (process " + std::to_string(stuck) + ") does not end on SIGKILL"),
      std::string::npos)
      << up.said();
  EXPECT_EQ(kill(stuck, 0), 0) << "the process was not stuck";
  EXPECT_NE(report()["nodes"]["recon_b"]["end"].get<std::string>().find("does not end on SIGKILL"),
            std::string::npos);
  waitpid(stuck, nullptr, __WALL);
}

class RecordingUp : public Up {
 protected:
  const fs::path file_ = folder_ / "session.mcap";
  bus::Bus bus_{{domain_}};
  bus::Reader<bus::topics::NodeStatus> statuses_ = bus_.reader<bus::topics::NodeStatus>();

  // Starts `up --record` and waits until the recorder publishes.
  Program& start_recording(const std::vector<std::string>& more = {}) {
    write_publishing_nodes();
    std::vector<std::string> all = {"--record", file_};
    all.insert(all.end(), more.begin(), more.end());
    Program& up = start_up("out", all);
    EXPECT_TRUE(eventually(bus_, kTimeout, [&] {
      for (const auto& sample : statuses_.take())
        if ("recorder_" + std::to_string(up.pid()) == sample->node)
          if (const auto process = statuses_.process(sample)) recorder_ = pid_t(process->pid);
      return recorder_ > 0;
    })) << up.said();
    return up;
  }
  pid_t recorder_ = 0;
};

TEST_F(RecordingUp, ReportsACompleteRecording) {
  // A frame that a node composites before it has discovered the recorder is missing.
  Program& up = start_recording({"--record-option=--topics=NodeStatus"});
  bool published = false;
  ASSERT_TRUE(eventually(bus_, kTimeout, [&] {
    for (const auto& sample : statuses_.take())
      published |= std::string(sample->node) == "rendering";
    return published;
  })) << up.said();
  up.signal(SIGINT);
  ASSERT_EQ(up.wait_for_end(kTimeout), 130) << up.said();
  const auto recorder = report()["recorder"];
  EXPECT_EQ(recorder["file"], file_.string());
  EXPECT_EQ(recorder["pid"], recorder_);
  EXPECT_EQ(recorder["end"], "exit code 0 (exited cleanly)");
  EXPECT_TRUE(recorder["complete"].get<bool>());
  EXPECT_TRUE(recorder["ended_after_s"].is_null());
  EXPECT_GT(recorder["recorded"].get<int>(), 0);
  EXPECT_EQ(recorder["recorded"], recorder["received"]);
  EXPECT_NE(up.said().find("[recorder] " + file_.string() + ": "), std::string::npos)
      << "its summary: " << up.said();
  EXPECT_EQ(up.said().find("is killed"), std::string::npos) << up.said();
}

TEST_F(RecordingUp, ReportsTheDeathOfTheRecorderAtOnce) {
  Program& up = start_recording();
  ASSERT_GT(recorder_, 0);
  kill(recorder_, SIGKILL);
  EXPECT_TRUE(
      says(up, "the recorder ended while the deployment runs: killed by signal 9 (SIGKILL)"))
      << up.said();
  EXPECT_FALSE(up.wait_for_end(0ms)) << "the deployment continues";
  up.signal(SIGINT);
  EXPECT_EQ(up.wait_for_end(kTimeout), 1) << up.said();
  EXPECT_NE(up.said().find("the recording is incomplete: " + file_.string()), std::string::npos)
      << up.said();
  const auto recorder = report()["recorder"];
  EXPECT_EQ(recorder["end"], "killed by signal 9 (SIGKILL)");
  EXPECT_FALSE(recorder["complete"].get<bool>());
  EXPECT_TRUE(recorder["ended_after_s"].is_number());
}

// A stopped recorder stands for one that waits for the disk.
TEST_F(RecordingUp, DurationEndsByTheClockAlthoughTheRecorderHangs) {
  Program& up = start_recording({"--duration", "3"});
  ASSERT_GT(recorder_, 0);
  kill(recorder_, SIGSTOP);
  const auto begin = Clock::now();
  EXPECT_EQ(up.wait_for_end(kTimeout), 1) << up.said();
  // At most 3 s to run, and 2 s until the recorder is killed; the rest is for a busy machine.
  EXPECT_LT(Clock::now() - begin, 10s);
  EXPECT_EQ(report()["ended_by"], "duration");
  EXPECT_EQ(report()["recorder"]["end"], "killed by signal 9 (SIGKILL)");
}

TEST_F(Up, EndOfInputStopsUpAndFailsWithoutComposites) {
  write_program("capture_node", "echo end of footage\nexit 0\n");
  Program& up = start_up();
  EXPECT_EQ(up.wait_for_end(kTimeout), 1);
  EXPECT_NE(up.said().find("no frame was composited"), std::string::npos) << up.said();
  EXPECT_EQ(report()["ended_by"], "every capture_node ended");
}

// DDS gives the statuses of a process new publication handles after a silence longer than the
// lease.
TEST_F(Up, AStoppedRenderNodeIsReportedAndCountsOnceWhenItContinues) {
  // A shorter lease than that of the profile: it ends before `up` reports the silence.
  std::string profile = text_of(FIVEPIPE_SOURCE_DIR "/launch/profiles/loopback.xml");
  setenv("CYCLONEDDS_URI", replaced(profile, "<LeaseDuration>2s", "<LeaseDuration>500ms").c_str(),
         1);
  bus::Bus bus({domain_});
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  auto composited = bus.reader<bus::topics::FrameComposited>();
  // Whether statuses and frames of the node arrive.
  const auto renders = [&] {
    int status_count = 0, frame_count = 0;
    return eventually(bus, kTimeout, [&] {
      for (const auto& sample : statuses.take())
        status_count += sample.valid() && std::string(sample->node) == "rendering";
      for (const auto& sample : composited.take()) frame_count += sample.valid();
      return status_count >= 2 && frame_count >= 2;
    });
  };
  write_publishing_nodes();
  write_program("sim_node", "echo pid $$\nexec sleep 1000\n");  // publishes nothing
  Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  ASSERT_TRUE(renders()) << up.said();
  // `up` has seen frames, too. Its first line may report less than one frame per second.
  const std::regex line(
      " [1-9][0-9]* s: [1-9][0-9]* frames composited, now [1-9][0-9.]* frames/s; "
      "simulation: no status yet\n");
  ASSERT_TRUE(wait_for([&] { return std::regex_search(up.said(), line); })) << up.said();
  const pid_t rendering = pid_of("rendering");
  kill(rendering, SIGSTOP);
  ASSERT_TRUE(says(up, "frames composited, no frame for ")) << up.said();
  kill(rendering, SIGCONT);
  ASSERT_TRUE(renders()) << up.said();
  up.signal(SIGINT);
  ASSERT_EQ(up.wait_for_end(kTimeout), 130) << up.said();
  EXPECT_EQ(up.said().find("two processes"), std::string::npos) << up.said();
  const auto report = this->report();
  EXPECT_TRUE(report["duplicate_nodes"].empty());
  const std::string printed = "composited ", log = log_of("rendering");
  ASSERT_NE(log.find(printed), std::string::npos) << log;
  EXPECT_GT(report["frames"]["composited"].get<int>(), 0);
  EXPECT_GT(report["frame_rate_hz"].get<double>(), 0);
  EXPECT_LE(report["frames"]["composited"].get<int>(),
            std::stoi(log.substr(log.find(printed) + printed.size())));
  unsetenv("CYCLONEDDS_URI");
}

TEST_F(Up, ASecondProcessOfANodeIsReportedWithItsPid) {
  write_publishing_nodes();
  Program& up = start_up();
  ASSERT_TRUE(all_nodes_run()) << up.said();
  const Program other({FIVEPIPE_BINARY_DIR "/status_writer", "recon_a", std::to_string(domain_)},
                      folder_ / "other.said");
  ASSERT_TRUE(says(up, "2 processes publish as node 'recon_a'")) << up.said();
  for (const pid_t pid : {other.pid(), pid_of("recon_a")})
    EXPECT_NE(up.said().find("process " + std::to_string(pid) + " on host "), std::string::npos)
        << up.said();
  up.signal(SIGINT);
  ASSERT_EQ(up.wait_for_end(kTimeout), 130) << up.said();
  const std::string said = up.said(), text = "2 processes publish as node";
  EXPECT_EQ(said.find(text), said.rfind(text)) << "once";
}

}  // namespace
}  // namespace fivepipe::test
