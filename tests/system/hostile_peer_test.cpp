// A deployment with a peer in its domain (hostile_peer.cpp), which sends invented names, wrong
// sizes, extreme timestamps and NaN.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/pipeline/bus/topics.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/pipeline/node/drop_counts.h"
#include "common/pipeline/node/log_budget.h"
#include "tests/support/process/memory.h"
#include "tests/support/recording/recordings.h"
#include "tests/support/sanitizer.h"
#include "tests/support/text.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::milliseconds;

// `fivepipe up` reports a longer time without a composited frame.
constexpr auto kMaxFrameGap = 2s * kSlowdown;
constexpr int kRate_Hz = 1000;

bool is_long() { return std::getenv("FIVEPIPE_LONG") != nullptr; }
int attack_s() { return is_long() ? 60 : 4; }

constexpr bool kMeasuresMemory = !kHasSanitizer;  // which keeps freed memory
// A reader keeps about 650 bytes per key. InventedNamesDoNotFillTheMemory sees that a node refuses
// kMinRefused names, which would be 9.1 MB, after its memory was measured. The buffers of DDS, the
// keys that a reader accepts and the chunks of the recorder (0.1 to 4.2 MB measured) take less than
// this.
constexpr double kMaxGrowth_mb = 8;
constexpr std::uint64_t kMinRefused = 14000;

double resident_mb(pid_t pid) { return double(resident_bytes(pid)) / 1e6; }

// The most lines that `fivepipe up` prints in this time with kSmallDeployment and a recorder. A
// node logs at most LogBudget::kMaxLines in each period and then one line about the suppressed
// ones; at most one more period than fits begins, and one has begun before. `up` and the recorder
// print their progress every 5 s.
std::ptrdiff_t max_lines(Clock::duration time) {
  const auto periods = std::ptrdiff_t(time / node::LogBudget::kPeriod) + 2;
  return periods * ((std::ssize(kNodes) + 1) * (node::LogBudget::kMaxLines + 1) + 2);
}
// The table at the end of `up`: at most 64 drops and one more for each of 32 reasons, one peer,
// five nodes, the topics of the recorder twice, and 20 other lines.
const std::ptrdiff_t kMaxTableLines = 122 + 2 * std::ssize(bus::topics::all());
// At most 65 counts and 96 drops for each of five nodes, 96 drops together, of at most 280 bytes
// each (the texts of a DropCount in NodeStatus, and indentation), and 10 kB of other values.
constexpr std::size_t kMaxReportBytes = 256 * 1024;

// Writes the small deployment so that its nodes read every topic of one host: with coverage, an
// object that has a spacing, and particles. Without a video, whose encoder takes memory for its
// first frames and time at the end. Returns the path of the deployment file.
std::string deployment_that_reads_all(const std::filesystem::path& folder) {
  const std::string scene = FIVEPIPE_SOURCE_DIR "/scenes/demo/scene.yaml";
  const std::string file =
      changed_deployment(folder, "program: render_node}",
                         "program: render_node, video: false}\nhull: {coverage: true}");
  const std::string text = text_of(file);
  std::ofstream(file) << replaced(text, scene, "scene.yaml");
  std::ofstream(folder / "scene.yaml") << text_of(scene) << R"(
  - name: slider
    box: {size_m: [0.04, 0.04, 0.04]}
    position_m: [0.6, 0.5, 0.1]
    spacing: {axis: [1, 0, 0], at_m: 0.1, range_m: [0.05, 0.2]}
particles:
  - {name: grains, from_m: [0.6, 0.4, 0.3], to_m: [0.65, 0.45, 0.3], rate_hz: 20, lifetime_s: 1,
     radius_m: 0.004}
)";
  return file;
}

class HostilePeer : public RecordingTest {
 protected:
  HostilePeer() {
    EXPECT_TRUE(eventually(bus_, kStart, [&] {
      watch();
      return frames_ >= 20;
    })) << deployed_.said();
    for (const std::string& node : kNodes) pids_[node] = deployed_.pid_of(node).value_or(-1);
    for (const pid_t child : deployed_.all_children())
      if (std::none_of(pids_.begin(), pids_.end(),
                       [&](const auto& known) { return known.second == child; }))
        pids_["recorder"] = child;
    pids_["up"] = deployed_.pid();
  }

  // deployment: that the peer claims to belong to.
  std::unique_ptr<Program> peer(int seconds, int rate_hz, const std::string& topic = "",
                                const std::string& deployment = "small") {
    std::vector<std::string> words{std::string(FIVEPIPE_BINARY_DIR) + "/hostile_peer",
                                   std::to_string(domain_), std::to_string(seconds),
                                   std::to_string(rate_hz)};
    if (!topic.empty()) words.push_back(topic);
    if (!deployment.empty()) words.insert(words.end(), {"--deployment", deployment});
    return std::make_unique<Program>(words, folder_ / "peer.log");
  }

  // Takes the frames that the deployment composites and the statuses of its nodes.
  void watch() {
    for (const auto& sample : composited_.take()) {
      if (!sample.valid() || messages::why_implausible(sample->frame, sample->composited_stamp_ns))
        continue;  // the peer's
      ++frames_;
      newest_frame_ = Clock::now();
    }
    longest_gap_ = std::max(longest_gap_, Clock::now() - newest_frame_);
    for (const auto& sample : statuses_.take()) {
      const auto process = sample.valid() ? statuses_.process(sample) : std::nullopt;
      const auto known = pids_.find(sample->node);
      if (!process || known == pids_.end() || process->pid != std::uint32_t(known->second))
        continue;
      std::map<std::string, std::uint64_t>& drops = drops_[sample->node];
      std::map<std::string, std::size_t> entries;
      drops.clear();
      for (const fivepipe_v1_DropCount& drop : messages::span_of(sample->drops)) {
        drops[drop.reason] += drop.count;
        most_entries_ = std::max(most_entries_, ++entries[drop.reason]);
      }
    }
  }
  // Watches until the condition holds.
  bool watch_until(Milliseconds timeout, const std::function<bool()>& condition) {
    return eventually(bus_, timeout, [&] {
      watch();
      return condition();
    });
  }

  std::map<std::string, double> memory_mb() const {
    std::map<std::string, double> memory;
    for (const auto& [name, pid] : pids_) memory[name] = resident_mb(pid);
    return memory;
  }
  void expect_level(const std::map<std::string, double>& before,
                    const std::map<std::string, double>& after) {
    for (const auto& [name, mb] : after) {
      RecordProperty("growth_kb_" + name, int(1000 * (mb - before.at(name))));
      if (kMeasuresMemory) {
        EXPECT_LT(mb - before.at(name), kMaxGrowth_mb) << name;
      }
    }
  }

  void expect_same_processes() {
    for (const std::string& node : kNodes) EXPECT_EQ(deployed_.pid_of(node), pids_[node]) << node;
    EXPECT_EQ(deployed_.all_children().size(), std::size(kNodes) + 1);
  }

  const std::filesystem::path out_ = folder_ / "out", recording_ = folder_ / "recorded.mcap";
  bus::Reader<bus::topics::FrameComposited> composited_ =
      bus_.reader<bus::topics::FrameComposited>();
  bus::Reader<bus::topics::NodeStatus> statuses_ = bus_.reader<bus::topics::NodeStatus>();
  std::uint64_t frames_ = 0;
  Clock::time_point newest_frame_ = Clock::now();
  Clock::duration longest_gap_{};
  std::map<std::string, std::map<std::string, std::uint64_t>> drops_;  // by node and reason
  std::size_t most_entries_ = 0;  // of one reason in one status
  Deployed deployed_{deployment_that_reads_all(folder_ / "files"),
                     domain_,
                     out_,
                     {"--record", recording_.string()}};
  std::map<std::string, pid_t> pids_;  // of the nodes, "recorder" and "up"
};

// The sum over the drops with this reason in a node or in the frames of report.json.
std::uint64_t dropped(const nlohmann::json& drops, const std::string& reason) {
  std::uint64_t sum = 0;
  for (const auto& [text, count] : drops.items())
    if (text == reason || text.starts_with(reason + ":")) sum += count.get<std::uint64_t>();
  return sum;
}

TEST_F(HostilePeer, DeploymentWorksOnAndNamesThePeer) {
  const std::ptrdiff_t lines_before = line_count(deployed_.said());
  // Every topic except HullTile has reached its maximum of keys: of all topics in turn, some with
  // an invented name in every second message only. HullTile's further keys fit into kMaxGrowth_mb.
  const auto tables_full =
      bus::topics::all().size() * 2 * bus::topics::kMaxKeys * 1000ms / kRate_Hz;
  std::map<std::string, double> memory_full;
  longest_gap_ = {};
  const auto start = Clock::now();
  const auto attacked_for = [&] { return Clock::now() - start; };
  // It continues while the deployment ends.
  const auto peer = this->peer(attack_s() + 60, kRate_Hz);
  EXPECT_FALSE(watch_until(Milliseconds(1000 * attack_s()), [&] {
    if (memory_full.empty() && attacked_for() >= tables_full) memory_full = memory_mb();
    return deployed_.wait_for_end(0ms).has_value();
  })) << deployed_.said();
  EXPECT_LT(longest_gap_, kMaxFrameGap) << deployed_.said();
  EXPECT_LE(line_count(deployed_.said()), lines_before + max_lines(attacked_for()))
      << deployed_.said();
  EXPECT_LE(most_entries_, node::DropCounts::kMaxPerReason + 2) << "others, and without a name";
  if (is_long()) expect_level(memory_full, memory_mb());
  expect_same_processes();
  const std::ptrdiff_t lines_of_attack = line_count(deployed_.said());
  deployed_.signal(SIGINT);
  // `up` waits for the final reports of the nodes for at most 0.5 s, then ends the recorder.
  const auto has_ended = [&](const auto& known) { return !is_alive(known.second); };
  EXPECT_TRUE(eventually(bus_, 2s * kSlowdown, [&] {
    return std::count_if(pids_.begin(), pids_.end(), has_ended) >= int(std::size(kNodes));
  })) << deployed_.said();
  EXPECT_EQ(deployed_.wait_for_end(500ms + 2s * kSlowdown), 130) << deployed_.said();
  for (const auto& [name, pid] : pids_) EXPECT_FALSE(is_alive(pid)) << name;
  EXPECT_TRUE(is_alive(peer->pid()));
  EXPECT_LE(line_count(deployed_.said()), lines_of_attack + kMaxTableLines) << deployed_.said();

  EXPECT_LT(std::filesystem::file_size(out_ / "report.json"), kMaxReportBytes);
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  // The peer waits for no reader. Each message counts once for each node that refuses it.
  const std::string name = "process " + std::to_string(peer->pid()) + " on host ";
  ASSERT_EQ(report["refused_from"].size(), 1u) << report["refused_from"];
  const auto offender = report["refused_from"].items().begin();
  EXPECT_EQ(offender.key().substr(0, name.size()), name);
  EXPECT_GT(offender.value().get<int>(), attack_s() * kRate_Hz / 4);
  for (const char* reason :
       {"bad_map", "bad_coverage", "bad_colour", "bad_camera_info", "bad_head_pose", "bad_view",
        "bad_tile", "bad_state", "bad_collision", "bad_composited", "bad_particles",
        "bad_tile_costs", "bad_spacing", "bad_replay"})
    EXPECT_GT(dropped(report["frames"]["dropped"], reason), 0u) << reason << '\n'
                                                                << report["frames"].dump(1);
  EXPECT_EQ(report["duplicate_nodes"], nlohmann::json::array());
  for (const std::string& node : kNodes) {
    EXPECT_EQ(report["nodes"][node]["restarts"].size(), 0u) << node;
    // With a sanitizer, a node may need longer to end than `up` waits.
    const std::string end = report["nodes"][node]["end"];
    EXPECT_TRUE(end == "exit code 0 (exited cleanly)" ||
                (kHasSanitizer && end == "killed by signal 9 (SIGKILL)"))
        << node << ": " << end;
  }
  EXPECT_EQ(report["recorder"]["end"], "exit code 0 (exited cleanly)");
  EXPECT_EQ(report["recorder"]["lost"], 0);
  const recording::Recording recording(recording_);
  EXPECT_TRUE(recording.mcap().is_finished()) << recording.mcap().damage().summary;
  EXPECT_GE(counts_by_topic(recording).at(bus::topics::FrameComposited::name), frames_);
}

TEST_F(HostilePeer, InventedNamesDoNotFillTheMemory) {
  constexpr int kFastRate_Hz = 4000;
  const auto attack = [&](int seconds, const auto& each) {
    const auto peer = this->peer(seconds, kFastRate_Hz, "ObjectPixelMap");
    return watch_until(Milliseconds(1000 * seconds) + 30s, [&] {
      each();
      return peer->wait_for_end(0ms).has_value();
    });
  };
  // DDS fills its buffers with the first frames.
  ASSERT_TRUE(watch_until(kStart, [&] { return frames_ >= 150; }));
  // Fills the buffers, among them two chunks of the recorder, and the tables of names: every second
  // map has an invented one.
  constexpr int kFill_s = 3, kFillNames = kFill_s * kFastRate_Hz / 2;
  static_assert(kFillNames >= bus::topics::kMaxKeys);
  std::map<std::string, double> before;
  ASSERT_TRUE(attack(kFill_s, [&] {
    for (const auto& [name, mb] : memory_mb()) before[name] = std::max(before[name], mb);
  }));
  // What each process holds throughout the last second. The recorder needs more for a moment
  // whenever a chunk waits for the disk.
  std::deque<std::pair<Clock::time_point, std::map<std::string, double>>> last_second;
  ASSERT_TRUE(attack(is_long() ? 60 : 9, [&] {
    last_second.emplace_back(Clock::now(), memory_mb());
    while (last_second.back().first - last_second.front().first > 1s) last_second.pop_front();
  }));
  std::map<std::string, double> held = last_second.front().second;
  for (const auto& [time, memory] : last_second)
    for (const auto& [name, mb] : memory) held[name] = std::min(held[name], mb);
  expect_level(before, held);
  for (const char* node : {"recon_a", "recon_b", "simulation"})
    EXPECT_TRUE(
        watch_until(10s, [&] { return drops_[node]["too_many_keys"] >= kFillNames + kMinRefused; }))
        << node << ": " << testing::PrintToString(drops_[node]);
  expect_same_processes();
}

// It claims no deployment, or another one.
TEST_F(HostilePeer, AStrangerIsRefusedAndNamed) {
  longest_gap_ = {};
  const auto stranger = peer(3, kRate_Hz, "", ""), other = peer(3, kRate_Hz, "", "elsewhere");
  ASSERT_TRUE(watch_until(20s * kSlowdown, [&] {
    return stranger->wait_for_end(0ms).has_value() && other->wait_for_end(0ms).has_value();
  })) << deployed_.said();
  EXPECT_LT(longest_gap_, kMaxFrameGap) << deployed_.said();
  for (const std::string& node : kNodes) {
    EXPECT_TRUE(
        watch_until(10s * kSlowdown, [&] { return drops_[node]["other_deployment"] > 100; }))
        << node << testing::PrintToString(drops_[node]);
    for (const auto& [reason, count] : drops_[node])
      EXPECT_FALSE(reason.starts_with("bad_")) << node << " " << reason;
  }
  expect_same_processes();
  deployed_.signal(SIGINT);
  EXPECT_EQ(deployed_.wait_for_end(5s * kSlowdown), 130) << deployed_.said();
  const auto report = nlohmann::json::parse(std::ifstream(out_ / "report.json"));
  EXPECT_EQ(report["refused_from"].size(), 2u) << report["refused_from"];
  for (const auto& program : {&stranger, &other}) {
    const std::string name = "process " + std::to_string((*program)->pid()) + " on host ";
    EXPECT_TRUE(contains(report["refused_from"].dump(), name)) << report["refused_from"];
  }
  for (const char* text : {" of no deployment", " of deployment elsewhere"})
    EXPECT_TRUE(contains(deployed_.said(), text)) << deployed_.said();
}

// Standard output is no terminal, so that `top` appends each update to the previous one.
TEST_F(HostilePeer, TopShowsTheNodesAndThePeerInABoundedText) {
  // The table of at most 50 nodes with its head, 200 lines about them, 20 about duplicates and the
  // numbers of further nodes and lines and of ignored statuses; of at most 1,000 bytes each.
  constexpr std::ptrdiff_t kMaxLines = 50 + 1 + 200 + 20 + 3, kMaxBytes = 1000 * kMaxLines;
  const auto peer = this->peer(60, kRate_Hz);
  ASSERT_TRUE(watch_until(20s, [&] { return drops_["recon_a"]["bad_map"] >= 100; }));
  const auto top = fivepipe("top", {"top"});
  // An update has two tables: the nodes and the simulation's metrics.
  std::vector<std::string> tables;
  ASSERT_TRUE(watch_until(20s, [&] {
    tables.clear();
    const std::string said = top->said();
    for (std::size_t at = 0, end; (end = said.find("\n\n", at)) != said.npos; at = end + 2)
      tables.push_back(said.substr(at, end - at));
    return tables.size() >= 8;
  })) << top->said();
  for (const std::string& table : tables) {
    EXPECT_LE(line_count(table), kMaxLines);
    EXPECT_LE(std::ssize(table), kMaxBytes);
  }
  const std::string last = tables[tables.size() - 2] + "\n" + tables.back();
  for (const std::string& node : kNodes)
    EXPECT_NE(last.find("\n" + node + " "), last.npos) << node << '\n' << last;
  EXPECT_NE(last.find(" messages from process " + std::to_string(peer->pid())), last.npos) << last;
}

}  // namespace
}  // namespace fivepipe::test
