// A long recorded run on two hosts: nothing grows, nothing slows down, and every message is
// accounted for. FIVEPIPE_SOAK_S: its length; 1800 takes half an hour.
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>

#include "common/pipeline/bus/bus.h"
#include "tests/system/hosts/two_hosts.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr double kShort_s = 8, kMinute_s = 60;
// The first minutes warm up caches and pools.
constexpr double kWarm_s = 5 * kMinute_s;
constexpr double kMaxGrowth_mb = 1, kMaxSlowdown = 0.1;

// Values with their times since the start [s].
class Series {
 public:
  void add(double t_s, double value) { values_.emplace_back(t_s, value); }
  // Of the values in [from_s, until_s).
  double median(double from_s, double until_s) const {
    std::vector<double> in;
    for (const auto& [t_s, value] : values_)
      if (t_s >= from_s && t_s < until_s) in.push_back(value);
    if (in.empty()) return NAN;
    std::nth_element(in.begin(), in.begin() + std::ptrdiff_t(in.size() / 2), in.end());
    return in[in.size() / 2];
  }

 private:
  std::vector<std::pair<double, double>> values_;
};

// Memory that the process has allocated: its anonymous pages in RAM. Pages of program files, which
// the kernel drops and reads again, are not part of it.
double allocated_mb(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  for (std::string key; file >> key; file.ignore(1 << 10, '\n')) {
    double kib = 0;
    if (key == "RssAnon:" && file >> kib) return kib * 1.024e-3;
  }
  return NAN;
}

// Of `fivepipe up` and of the processes that it has started: by the name of the node or recorder.
std::map<std::string, pid_t> processes_of(const std::string& host, pid_t up) {
  std::map<std::string, pid_t> found{{"up " + host, up}};
  const std::string of = "/proc/" + std::to_string(up);
  std::ifstream children(of + "/task/" + std::to_string(up) + "/children");
  for (pid_t child = 0; children >> child;) {
    std::ifstream words("/proc/" + std::to_string(child) + "/cmdline");
    std::string name, word;
    while (name.empty() && std::getline(words, word, '\0'))
      if (word == "--node" || word == "--name") std::getline(words, name, '\0');
    if (!name.empty()) found[name] = child;
  }
  return found;
}

std::uint64_t sum_of(const nlohmann::ordered_json& counts) {
  std::uint64_t sum = 0;
  for (const auto& count : counts) sum += count["count"].get<std::uint64_t>();
  return sum;
}

using Soak = TwoHosts;

TEST_F(Soak, IsLevelAndLosesNothing) {
  const char* const given = std::getenv("FIVEPIPE_SOAK_S");
  const double duration_s = given ? std::atof(given) : kShort_s * kSlowdown;
  const std::string file = deployment();
  std::ofstream(folder_.path / "files/soak.yaml")
      << replaced(text_of(file), "frame_rate_hz: 20", "frame_rate_hz: 30");
  const std::string soak = (folder_.path / "files/soak.yaml").string(),
                    recorded = (folder_.path / "soak.mcap").string();
  bus::Bus bus({0, observer_network()});
  auto composites = bus.reader<bus::topics::FrameComposited>();
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  const auto beta = up(1, soak, {"--record", recorded}), alpha = up(0, soak);
  Clock::time_point start{};
  std::set<std::uint64_t> composited;
  Series latency_ms;
  std::map<std::string, Series> memory;  // [MB] by process
  std::set<std::string> has_ended;       // nodes
  int recorder_statuses = 0;
  const auto take = [&] {
    const double t_s = std::chrono::duration<double>(Clock::now() - start).count();
    for (const auto& sample : composites.take()) {
      if (!sample.valid()) continue;
      composited.insert(sample->frame);
      latency_ms.add(t_s, 1e-6 * double(sample->composited_stamp_ns - sample->capture_stamp_ns));
    }
    for (const auto& sample : statuses.take())
      if (sample.valid()) {
        recorder_statuses += std::string(sample->node).starts_with("recorder");
        if (sample->final_report) has_ended.insert(sample->node);
      }
    return !composited.empty();
  };
  ASSERT_TRUE(holds(kStart, take)) << beta->said() << alpha->said();
  start = Clock::now();
  double next_memory_s = 0;
  holds(std::chrono::seconds(std::int64_t(duration_s / kSlowdown)), [&] {
    take();
    const double t_s = std::chrono::duration<double>(Clock::now() - start).count();
    if (t_s < next_memory_s) return false;
    next_memory_s = t_s + 1;
    for (const auto& [host, program] : {std::pair{"alpha", &alpha}, {"beta", &beta}})
      for (const auto& [process, pid] : processes_of(host, (*program)->pid()))
        memory[process].add(t_s, allocated_mb(pid));
    return false;
  });
  // The recorder gets the last status of the nodes on alpha.
  alpha->signal(SIGINT);
  EXPECT_EQ(alpha->wait_for_end(5s * kSlowdown), 130) << alpha->said();
  EXPECT_TRUE(holds(10s, [&] { return (take(), has_ended.contains("capture")); })) << beta->said();
  const int statuses_before = recorder_statuses;  // the recorder sends them between its messages
  EXPECT_TRUE(holds(10s, [&] { return (take(), recorder_statuses >= statuses_before + 2); }));
  beta->signal(SIGINT);
  EXPECT_EQ(beta->wait_for_end(5s * kSlowdown), 130) << beta->said();
  take();

  const auto report = nlohmann::json::parse(std::ifstream(folder_.path / "beta/report.json"));
  EXPECT_EQ(report["recorder"]["lost"], 0);
  const recording::Recording recording(recorded);
  // This process may have found render_node after its first frames; the recorder ran before.
  const auto composites_in_file = counts_by_frame(recording, bus::topics::FrameComposited::name),
             captured = counts_by_frame(recording, bus::topics::HeadPose::name);
  ASSERT_FALSE(composites_in_file.empty());
  EXPECT_EQ(report["frames"]["composited"], composites_in_file.size());
  EXPECT_LE(composites_in_file.size(), composited.size() + 30);
  const auto in_file = counts_by_topic(recording);
  const auto last = final_statuses(recording);
  for (const auto& [topic, count] : sent_by_topic(last))
    EXPECT_EQ(in_file.at(topic), count) << topic;
  std::uint64_t dropped = 0;
  for (const auto& [node, status] : last)
    if (node != "capture") dropped += sum_of(status["drops"]);
  // capture_node sends frames by the clock until render_node is there. At the end, a few frames are
  // on their way.
  const auto missing = std::ranges::count_if(captured, [&](const auto& frame) {
    return frame.first > composites_in_file.begin()->first &&
           !composites_in_file.contains(frame.first);
  });
  EXPECT_GT(captured.size(), std::size_t(0.5 * 30 * duration_s / kSlowdown));
  EXPECT_LE(std::uint64_t(missing), dropped + 5);

  const double window_s = std::min(kWarm_s, duration_s / 4);
  const double first_ms = latency_ms.median(0, window_s),
               last_ms = latency_ms.median(duration_s - window_s, duration_s);
  std::cout << duration_s << " s, " << captured.size() << " frames captured, "
            << composites_in_file.size() << " composited, " << dropped
            << " dropped; median latency of the first and last " << window_s << " s: " << first_ms
            << ", " << last_ms << " ms\n";
  const bool is_long = duration_s >= 2 * kWarm_s;
  EXPECT_TRUE(!is_long || std::abs(last_ms / first_ms - 1) <= kMaxSlowdown);
  EXPECT_GE(memory.size(), 8u) << "two of up, five nodes, the recorder";
  for (const auto& [process, series] : memory) {
    const double warm_s = is_long ? kWarm_s : duration_s / 2,
                 part_s = std::min(kMinute_s, duration_s / 4);
    const double every_s = is_long ? kWarm_s : part_s;
    std::cout << process << ", MB allocated, every " << every_s << " s:";
    for (double t_s = 0; t_s + part_s <= duration_s; t_s += every_s)
      std::cout << ' ' << series.median(t_s, t_s + part_s);
    const double before = series.median(warm_s, warm_s + part_s),
                 after = series.median(duration_s - part_s, duration_s);
    std::cout << ", in the last one " << after << '\n';
    EXPECT_FALSE(std::isnan(before) || std::isnan(after)) << process;
    EXPECT_TRUE(!is_long || kHasSanitizer || after - before < kMaxGrowth_mb) << process;
  }
}

}  // namespace
}  // namespace fivepipe::test
