// The network cable of one of two hosts is unplugged for 3 s; FIVEPIPE_LONG: also for 1 and 10 s.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <iostream>
#include <mutex>

#include "common/pipeline/bus/bus.h"
#include "tests/system/hosts/two_hosts.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;

constexpr double kMaxReturn_s = 0.5 * kSlowdown;  // from the link to a frame captured since
constexpr std::uint64_t kFrames = 20;             // one second of them

// Counts the composited frames in a thread of its own, on a host: independent of `fivepipe up`.
class FrameCounter {
 public:
  struct Frame {
    std::uint64_t frame = 0;
    std::int64_t capture_stamp_ns = 0, arrived_ns = 0;
  };
  FrameCounter(const TestHosts& hosts, int host)
      : thread_([this, &hosts, host] {
          if (hosts.enter(host))
            count(host);
          else
            is_outside_ = true;
        }) {}
  ~FrameCounter() {
    ends_ = true;
    thread_.join();
  }
  bool is_outside() const { return is_outside_; }  // it cannot enter the host
  std::vector<Frame> frames() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }
  // Those captured since.
  std::vector<Frame> frames(std::int64_t since_ns) const {
    std::vector<Frame> since = frames();
    std::erase_if(since, [&](const Frame& frame) { return frame.capture_stamp_ns < since_ns; });
    return since;
  }

 private:
  void count(int host) {
    bus::Network network("lan");
    network.interface = TestHosts::address(host);
    network.peers = {TestHosts::address(0), TestHosts::address(1)};
    bus::Bus bus({0, network});
    auto reader = bus.reader<bus::topics::FrameComposited>();
    while (!ends_) {
      bus.wait(20ms);
      for (const auto& sample : reader.take()) {
        if (!sample.valid()) continue;
        const std::lock_guard lock(mutex_);
        frames_.push_back({sample->frame, sample->capture_stamp_ns, sample.arrived_ns()});
      }
    }
  }

  mutable std::mutex mutex_;
  std::vector<Frame> frames_;
  std::atomic<bool> ends_ = false, is_outside_ = false;
  std::thread thread_;
};

class LinkDown : public TwoHosts {
 protected:
  nlohmann::json report_of(int host) const {
    return nlohmann::json::parse(std::ifstream(folder_.path / name(host) / "report.json"));
  }
  // Of `fivepipe up`, which names each restart, too.
  static void expect_no_false_message(const std::string& said) {
    for (const char* text :
         {"another deployment", "processes publish as", "is stalled", "hang", "hung", "died",
          "killed", ", restart ", "no status for", "waiting for host"})
      EXPECT_FALSE(contains(said, text)) << text << ":\n" << said;
  }
  // Each frame counts once, and no process has taken the place of another one.
  static void expect_equal_counts(const nlohmann::json& report, std::size_t composited) {
    EXPECT_EQ(report["frames"]["composited"], composited) << report["frames"];
    EXPECT_LE(composited, report["frames"]["captured"].get<std::size_t>());
    EXPECT_TRUE(report["duplicate_nodes"].empty()) << report["duplicate_nodes"];
    EXPECT_TRUE(report["refused_from"].empty()) << report["refused_from"];
    for (const auto& [node, described] : report["nodes"].items())
      EXPECT_TRUE(described["restarts"].empty() && described["pids"].size() <= 1)
          << node << described;
  }

  // A cable that is unplugged several times.
  void unplug_for(const std::vector<std::chrono::milliseconds>& times) {
    const std::string file = deployment();
    const FrameCounter counter(hosts_, 1);  // where rendering is
    const auto alpha = up(0, file), beta = up(1, file);
    ASSERT_TRUE(holds(kStart, [&] { return counter.frames().size() > 2 * kFrames; }))
        << counter.is_outside() << beta->said() << alpha->said();
    const std::size_t alpha_before = alpha->said().size(), beta_before = beta->said().size();
    for (const auto down : times) {
      hosts_.set_link(0, false);
      std::this_thread::sleep_for(down);
      const std::int64_t returned_ns = base::now_realtime_ns();
      hosts_.set_link(0, true);
      ASSERT_EQ(hosts_.why_not(), "");
      ASSERT_TRUE(holds(10s, [&] { return counter.frames(returned_ns).size() >= 2 * kFrames; }))
          << beta->said();
      const auto since = counter.frames(returned_ns);
      const double first_s = base::difference_s(since.front().arrived_ns, returned_ns);
      std::cout << "link down for " << down.count() << " ms: a frame " << first_s
                << " s after its return\n";
      EXPECT_LE(first_s, kMaxReturn_s);
      EXPECT_LE(base::difference_s(since[kFrames].arrived_ns, since.front().arrived_ns),
                2.0 * kSlowdown)
          << "frames go on at their rate\n"
          << alpha->said() << beta->said();
    }

    beta->signal(SIGINT);
    EXPECT_EQ(beta->wait_for_end(5s * kSlowdown), 130) << beta->said();
    alpha->signal(SIGINT);
    EXPECT_EQ(alpha->wait_for_end(5s * kSlowdown), 130) << alpha->said();
    const std::string of_alpha = alpha->said().substr(alpha_before),
                      of_beta = beta->said().substr(beta_before);
    for (const std::string& said : {of_alpha, of_beta}) expect_no_false_message(said);
    // Rendering counts as stopped after 2 s.
    EXPECT_TRUE(contains(of_beta, "capture: out of reach, no status from host alpha for "))
        << of_beta;
    EXPECT_TRUE(contains(of_alpha, ": out of reach, no status from host beta for ")) << of_alpha;
    const auto all = counter.frames();
    std::set<std::uint64_t> distinct;
    for (const auto& frame : all) distinct.insert(frame.frame);
    EXPECT_EQ(distinct.size(), all.size());
    for (const int host : {0, 1}) expect_equal_counts(report_of(host), all.size());
  }
};

// Discovery and the resolution of addresses try again periodically, so the time at which the link
// returns matters.
TEST_F(LinkDown, FramesReturnWithinHalfASecondAndTheReportCountsThem) {
  if (std::getenv("FIVEPIPE_LONG"))
    unplug_for({1s, 3s, 10s, 3250ms, 3500ms, 3750ms});
  else
    unplug_for({3s, 3300ms});
}

}  // namespace
}  // namespace fivepipe::test
