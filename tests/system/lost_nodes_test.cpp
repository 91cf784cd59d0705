// How long the picture stops when a node is killed or stops, with real processes and DDS.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <tuple>
#include <vector>

#include "tests/support/deployments.h"
#include "tests/support/process.h"
#include "tests/support/process/memory.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kStart = 60s;
// `up` restarts a node at once that ran this long.
constexpr auto kHealthyAfter = 10s;

// The allocator keeps some freed memory; a leak grows with the rounds.
constexpr std::size_t kMaxGrowth_bytes = 4'000'000;

struct Fault {
  std::string node;
  int signal;
  bool operator<(const Fault& other) const {
    return std::tie(node, signal) < std::tie(other.node, other.signal);
  }
};

// FIVEPIPE_ROUNDS: how often each node is killed, and how often stopped, in random order. The quick
// run inflicts one fault on each node: one whose gap max_median_gap_s() limits, or with a
// sanitizer, where limits mean less, the other one.
std::vector<Fault> faults() {
  if (!std::getenv("FIVEPIPE_ROUNDS") && !std::getenv("FIVEPIPE_LONG")) {
    if (kHasSanitizer)
      return {{"rendering", SIGSTOP},
              {"recon_b", SIGSTOP},
              {"capture", SIGSTOP},
              {"simulation", SIGSTOP},
              {"recon_a", SIGKILL}};
    return {{"recon_a", SIGSTOP},
            {"rendering", SIGKILL},
            {"simulation", SIGKILL},
            {"recon_b", SIGKILL},
            {"capture", SIGKILL}};
  }
  const char* const text = std::getenv("FIVEPIPE_ROUNDS");
  const int rounds = text ? std::atoi(text) : 3;
  std::mt19937_64 random(17);
  // Each node is killed in one of two passes and stopped in the other one.
  std::vector<Fault> faults;
  for (int round = 0; round < rounds; ++round) {
    std::map<std::string, int> first;
    for (const std::string& node : kNodes) first[node] = random() % 2 ? SIGKILL : SIGSTOP;
    for (const bool second : {false, true}) {
      std::vector<std::string> nodes(std::begin(kNodes), std::end(kNodes));
      std::shuffle(nodes.begin(), nodes.end(), random);
      for (const std::string& node : nodes)
        faults.push_back({node, second ? SIGKILL + SIGSTOP - first[node] : first[node]});
    }
  }
  return faults;
}

// The limit of the median gap of a killed node, or of a silent recon_node.
std::optional<double> max_median_gap_s(const Fault& fault) {
  if (fault.node.starts_with("recon")) return 0.2 * kSlowdown;
  if (fault.signal == SIGKILL) return (fault.node == "rendering" ? 0.5 : 1.0) * kSlowdown;
  return std::nullopt;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

std::size_t open_files_of(pid_t pid) {
  const std::filesystem::directory_iterator files("/proc/" + std::to_string(pid) + "/fd");
  return std::size_t(std::distance(files, std::filesystem::directory_iterator()));
}

// Preloads the library that simulates a reset of the GPU into the programs that are started while
// it exists.
class PreloadedReset {
 public:
  explicit PreloadedReset(const std::filesystem::path& file) {
    const char* const asan = std::getenv("ASAN_OPTIONS");
    asan_before_ = asan ? asan : "";
    setenv("LD_PRELOAD", FIVEPIPE_GPU_RESET, 1);
    setenv("FIVEPIPE_TEST_GPU_RESET", file.c_str(), 1);
    // The preloaded library precedes that of the sanitizer.
    setenv("ASAN_OPTIONS", (asan_before_ + ":verify_asan_link_order=0").c_str(), 1);
  }
  ~PreloadedReset() {
    unsetenv("LD_PRELOAD");
    unsetenv("FIVEPIPE_TEST_GPU_RESET");
    setenv("ASAN_OPTIONS", asan_before_.c_str(), 1);
  }
  PreloadedReset(const PreloadedReset&) = delete;
  PreloadedReset& operator=(const PreloadedReset&) = delete;

 private:
  std::string asan_before_;
};

class LostNodes : public testing::Test {
 protected:
  // Takes the frames that were composited, and expects that none shows an earlier time than the
  // one before.
  void take() {
    for (const auto& sample : composited_.take()) {
      if (!sample.valid()) continue;
      EXPECT_GT(sample->capture_stamp_ns, newest_stamp_ns_);
      newest_stamp_ns_ = sample->capture_stamp_ns;
      times_.push_back(Clock::now());
    }
  }
  bool frames_go_on(std::size_t more, std::chrono::seconds timeout) {
    const std::size_t before = (take(), times_.size());
    return eventually(bus_, timeout, [&] {
      take();
      return times_.size() >= before + more;
    });
  }
  void watch_for(Clock::duration time) {
    const auto end = Clock::now() + time;
    while (Clock::now() < end) {
      bus_.wait(10ms);
      take();
    }
  }
  // Returns the longest time between two composited frames that ends after `from`.
  double longest_gap_s(Clock::time_point from) {
    double longest_s = 0;
    for (std::size_t i = 1; i < times_.size(); ++i)
      if (times_[i] > from)
        longest_s =
            std::max(longest_s, std::chrono::duration<double>(times_[i] - times_[i - 1]).count());
    return longest_s;
  }

  struct Result {
    std::vector<double> gap_s, back_s;
  };
  struct Level {
    pid_t process;
    std::size_t open_files, resident_bytes;
  };
  std::map<std::string, Level> levels() {
    std::map<std::string, Level> levels;
    for (const std::string& node : kNodes)
      if (const auto process = deployed_.pid_of(node))
        levels[node] = {*process, open_files_of(*process), resident_bytes(*process)};
    return levels;
  }
  // Compares the processes that the fault did not end with themselves before it.
  void expect_level(const std::map<std::string, Level>& before) {
    for (const auto& [node, level] : levels()) {
      const auto earlier = before.find(node);
      if (earlier == before.end() || earlier->second.process != level.process) continue;
      // For each status, a node opens a file for a moment.
      EXPECT_TRUE(eventually(bus_, 2s * kSlowdown, [&, process = level.process] {
        take();
        return open_files_of(process) <= earlier->second.open_files;
      })) << node;
      const auto first_bytes = first_bytes_.try_emplace(level.process, level.resident_bytes).first;
      std::size_t& growth = growth_bytes_[node];
      growth = std::max(growth,
                        std::max(level.resident_bytes, first_bytes->second) - first_bytes->second);
    }
  }
  // Sends the signal to the node's process, and waits until the node has another one.
  void inflict(const Fault& fault, Result& result) {
    const auto started = starts_.find(fault.node);
    if (started != starts_.end()) watch_for(started->second + kHealthyAfter + 500ms - Clock::now());
    ASSERT_TRUE(frames_go_on(10, 20s * kSlowdown)) << fault.node << deployed_.said();
    const std::optional<pid_t> process = deployed_.pid_of(fault.node);
    ASSERT_TRUE(process) << fault.node << deployed_.said();
    const auto before = levels();
    const auto at = Clock::now();
    kill(*process, fault.signal);
    while (deployed_.pid_of(fault.node).value_or(*process) == *process &&
           Clock::now() < at + 10s * kSlowdown)
      watch_for(10ms);
    starts_[fault.node] = Clock::now();
    result.back_s.push_back(std::chrono::duration<double>(Clock::now() - at).count());
    EXPECT_TRUE(frames_go_on(30, 20s * kSlowdown)) << fault.node << deployed_.said();
    result.gap_s.push_back(longest_gap_s(at));
    expect_level(before);
  }

  TestFolder folder_;
  const std::filesystem::path reset_ = folder_.path / "reset";
  std::uint32_t domain_ = own_domain();
  bus::Bus bus_{{domain_}};
  bus::Reader<bus::topics::FrameComposited> composited_ =
      bus_.reader<bus::topics::FrameComposited>();
  PreloadedReset preloaded_{reset_};
  Deployed deployed_{
      changed_deployment(folder_.path / "files", "frame_rate_hz: 20", "frame_rate_hz: 30"), domain_,
      folder_.path / "out"};
  std::vector<Clock::time_point> times_;
  std::int64_t newest_stamp_ns_ = 0;
  std::map<std::string, Clock::time_point> starts_;
  std::map<pid_t, std::size_t> first_bytes_;  // resident after the first fault of another node
  std::map<std::string, std::size_t> growth_bytes_;  // since then, the most of a process
};

TEST_F(LostNodes, StopThePictureShortly) {
  ASSERT_TRUE(frames_go_on(30, kStart)) << deployed_.said();
  for (const std::string& node : kNodes) starts_[node] = Clock::now();
  std::map<Fault, Result> results;
  const std::size_t files_before = open_files_of(deployed_.pid());
  const std::size_t bytes_before = resident_bytes(deployed_.pid());
  const std::vector<Fault> all = faults();
  ASSERT_FALSE(all.empty()) << "FIVEPIPE_ROUNDS must be at least 1";
  for (const Fault& fault : all) {
    inflict(fault, results[fault]);
    if (HasFatalFailure()) return;
  }
  // The limits are those of medians. One value above its limit does not decide: it takes part in a
  // median of three.
  for (auto& [fault, result] : results) {
    const std::optional<double> limit_s = max_median_gap_s(fault);
    if (result.gap_s.size() > 1 || !limit_s || result.gap_s[0] <= *limit_s) continue;
    std::cout << fmt::format("repeated: {}, {:.3f} s\n", fault.node, result.gap_s[0]);
    for (int i = 0; i < 2; ++i) {
      inflict(fault, result);
      if (HasFatalFailure()) return;
    }
  }
  std::cout << "node        signal  longest time without a frame, s: median, max  back after, s\n";
  for (const auto& [fault, result] : results) {
    const double gap_s = median(result.gap_s),
                 max_gap_s = *std::max_element(result.gap_s.begin(), result.gap_s.end()),
                 max_back_s = *std::max_element(result.back_s.begin(), result.back_s.end());
    std::cout << fmt::format("{:11} {:7} {:.3f} {:.3f}  {:.3f}\n", fault.node,
                             fault.signal == SIGKILL ? "SIGKILL" : "SIGSTOP", gap_s, max_gap_s,
                             max_back_s);
    EXPECT_LE(max_back_s, 2 * kSlowdown) << fault.node;
    if (const auto limit_s = max_median_gap_s(fault)) {
      EXPECT_LE(gap_s, *limit_s) << fault.node;
    }
    if (fault.node.starts_with("recon")) {
      EXPECT_LE(max_gap_s, 0.5 * kSlowdown) << fault.node;
    }
  }
  EXPECT_EQ(open_files_of(deployed_.pid()), files_before);
  for (const auto& [node, bytes] : growth_bytes_)
    std::cout << fmt::format("{:11} grew by at most {:.1f} MB\n", node, 1e-6 * double(bytes));
  // The address sanitizer keeps freed memory for a while.
  if (!kHasSanitizer) {
    EXPECT_LE(resident_bytes(deployed_.pid()), bytes_before + kMaxGrowth_bytes);
    for (const auto& [node, bytes] : growth_bytes_) EXPECT_LE(bytes, kMaxGrowth_bytes) << node;
  }
  for (const auto& [fault, result] : results)
    if (fault.signal == SIGSTOP) {
      EXPECT_TRUE(contains(deployed_.said(), fault.node + " is stalled: no heartbeat"))
          << deployed_.said();
      if (fault.node.starts_with("recon")) {
        EXPECT_TRUE(contains(deployed_.said(), fault.node + ": gives no answer"))
            << deployed_.said();
      }
    }
}

// The process of a lost context ends, and its successor makes another one.
TEST_F(LostNodes, ALostGlContextIsMadeAgain) {
  ASSERT_TRUE(frames_go_on(30, kStart)) << deployed_.said();
  const std::optional<pid_t> before = deployed_.pid_of("rendering");
  std::ofstream(reset_).put(' ');
  ASSERT_TRUE(eventually(bus_, 20s * kSlowdown, [&] {
    take();
    return deployed_.pid_of("rendering").value_or(*before) != *before;
  })) << deployed_.said();
  EXPECT_TRUE(contains(deployed_.said(), "the GPU was reset because of this process"))
      << deployed_.said();
  EXPECT_TRUE(frames_go_on(30, 20s * kSlowdown)) << deployed_.said();
}

}  // namespace
}  // namespace fivepipe::test
