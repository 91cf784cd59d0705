// Runs `fivepipe replay` with the kept recording: when it refuses to start, what it sends, how it
// is paused and stopped.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <thread>

#include "common/recording/schema/cdr.h"
#include "common/recording/schema/wire_types.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/recording/replayed_nodes.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using recording::Recording;
using test::eventually;
using test::Outputs;

class Replay : public test::RecordingTest {
 protected:
  std::unique_ptr<test::Program> replay(std::vector<std::string> options, bool typed_to = false) {
    options.insert(options.begin(), {"replay", kKeptRecording});
    return fivepipe("replay", options, typed_to);
  }
  // Takes outputs until the program has ended. Returns its exit code; nullopt after `timeout`.
  std::optional<int> end_of(test::Program& program, Outputs& outputs,
                            std::chrono::milliseconds timeout = 20s) {
    std::optional<int> exit_code;
    eventually(bus_, timeout, [&] {
      exit_code = program.wait_for_end(0ms);  // before the last messages are taken
      outputs.take();
      return exit_code.has_value();
    });
    return exit_code;
  }
  bool has_arrived(Outputs& outputs, const std::string& topic, std::size_t count,
                   std::chrono::milliseconds timeout = 10s) {
    return eventually(bus_, timeout, [&] {
      outputs.take();
      return outputs.sorted()[topic].size() >= count;
    });
  }
};

TEST_F(Replay, IsRefusedDuringDeploymentUnlessForced) {
  const auto capture = node("capture_node", "capture");
  ASSERT_TRUE(eventually(bus_, test::kStart, [&] {
    return takes_part("capture", true, {bus::topics::ObjectPixelMap::name});
  })) << capture->said();
  const auto refused = replay({"--no-wait"});
  EXPECT_EQ(refused->wait_for_end(10s), 2);
  EXPECT_NE(refused->said().find("'capture' writes fivepipe/v1/ObjectPixelMap"), std::string::npos)
      << refused->said();
  const auto forced = replay({"--no-wait", "--force", "--rate", "max"});
  EXPECT_EQ(forced->wait_for_end(10s), 0) << forced->said();
}

// The other writers may start while the replay waits for its readers.
TEST_F(Replay, IsRefusedIfADeploymentStartsBeforeItSends) {
  const auto waiting = replay({"--inputs-of", "recon_a", "--wait", "60", "--rate", "max"});
  std::this_thread::sleep_for(1s);  // it looks for other writers for the first half second
  const auto capture = node("capture_node", "capture");
  ASSERT_TRUE(eventually(bus_, test::kStart, [&] {
    return takes_part("capture", true, {bus::topics::ObjectPixelMap::name});
  })) << capture->said();
  ASSERT_FALSE(waiting->wait_for_end(2s)) << waiting->said();  // until it knows capture_node, too
  const auto recon = node("recon_node", "recon_a");
  EXPECT_EQ(waiting->wait_for_end(20s), 2) << waiting->said();
  EXPECT_NE(waiting->said().find("'capture' writes fivepipe/v1/ObjectPixelMap"), std::string::npos)
      << waiting->said();
}

TEST_F(Replay, ExitsWithThreeWithoutReaders) {
  const auto unread = replay({"--wait", "1"});
  EXPECT_EQ(unread->wait_for_end(5s), 3) << unread->said();
  EXPECT_NE(unread->said().find("no node reads"), std::string::npos) << unread->said();
  const auto node = replay({"--wait", "1", "--inputs-of", "recon_a"});
  EXPECT_EQ(node->wait_for_end(5s), 3) << node->said();
  EXPECT_NE(node->said().find("recon_a"), std::string::npos) << node->said();
}

TEST_F(Replay, SigtermStopsWithinTwoSeconds) {
  Outputs maps(bus_, {bus::topics::ObjectPixelMap::name});
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"--rate", "0.01"}, {"--loop"}, {"--paused"}}) {
    const auto replay = this->replay(options, true);  // a closed stdin ends a paused replay
    ASSERT_TRUE(eventually(bus_, 10s, [&] { return maps.has_writers(1); })) << replay->said();
    replay->signal(SIGTERM);
    EXPECT_EQ(replay->wait_for_end(2s * kSlowdown), 130) << options[0] << '\n' << replay->said();
    ASSERT_TRUE(eventually(bus_, 10s, [&] { return maps.has_writers(0); }));
  }
}

TEST_F(Replay, KeepsTheRecordedPace) {
  std::optional<std::int64_t> first_ns;
  std::int64_t last_ns = 0;
  const Recording recording(kKeptRecording);
  for (auto messages = recording.messages(); const auto message = messages.next();) {
    if (message->channel->topic != bus::topics::HeadPose::name) continue;
    if (!first_ns) first_ns = message->log_stamp_ns;
    last_ns = message->log_stamp_ns;
  }
  const double recorded_s = 1e-9 * double(last_ns - *first_ns);
  ASSERT_GT(recorded_s, 1.5);
  for (const double rate : {0.5, 2.0}) {
    Outputs poses(bus_, {bus::topics::HeadPose::name});
    const auto launch = std::chrono::steady_clock::now();
    const auto replay = this->replay({"--rate", std::to_string(rate)});
    ASSERT_TRUE(has_arrived(poses, bus::topics::HeadPose::name, 1)) << replay->said();
    const auto first_pose = std::chrono::steady_clock::now();
    EXPECT_EQ(end_of(*replay, poses), 0) << replay->said();
    const auto end = std::chrono::steady_clock::now();
    // The replay runs between the launch and the end, whatever the load. The upper bound allows
    // 2 s, times kSlowdown, for the end of the program after its last message.
    const std::chrono::duration<double> at_most = end - launch, at_least = end - first_pose;
    EXPECT_GT(at_most.count(), recorded_s / rate) << rate;
    EXPECT_LT(at_least.count(), recorded_s / rate + 2 * kSlowdown) << rate;
  }
}

// capture_node sends one pose per frame.
TEST_F(Replay, KeysPauseStepAndStop) {
  for (const char* rate : {"1", "max"}) {
    SCOPED_TRACE(rate);
    Outputs poses(bus_, {bus::topics::HeadPose::name});
    const auto replay = this->replay({"--paused", "--rate", rate}, true);
    ASSERT_TRUE(eventually(bus_, 10s, [&] { return poses.has_writers(1); })) << replay->said();
    EXPECT_FALSE(has_arrived(poses, bus::topics::HeadPose::name, 1, 300ms)) << replay->said();
    replay->type("sss");
    ASSERT_TRUE(has_arrived(poses, bus::topics::HeadPose::name, 3)) << replay->said();
    EXPECT_FALSE(has_arrived(poses, bus::topics::HeadPose::name, 4, 300ms)) << replay->said();
    replay->type("s");
    ASSERT_TRUE(has_arrived(poses, bus::topics::HeadPose::name, 4)) << replay->said();
    replay->type("q");
    EXPECT_EQ(end_of(*replay, poses, 5s), 0) << replay->said();
    EXPECT_EQ(poses.taken(), 4u);
    const auto resumed = this->replay({"--paused", "--rate", rate}, true);
    resumed->type("s ");
    EXPECT_EQ(end_of(*resumed, poses), 0) << resumed->said();
    EXPECT_EQ(poses.taken(), 4u + test::counts_by_topic(recording::Recording(kKeptRecording))
                                      .at(bus::topics::HeadPose::name));
  }
}

TEST_F(Replay, RangeIncludesEarlierLatchedMessages) {
  const recording::Recording recording(kKeptRecording);
  std::set<mcap::Id> pose_channels;
  for (const auto& channel : recording.channels())
    if (channel.topic == bus::topics::HeadPose::name && !channel.key_states)
      pose_channels.insert(channel.id);
  std::vector<std::int64_t> stamps_ns;
  auto cursor = recording.messages(recording.start_ns(), recording.end_ns(), pose_channels);
  while (const auto message = cursor.next()) stamps_ns.push_back(message->log_stamp_ns);
  ASSERT_GT(stamps_ns.size(), 9u);
  // A time between two poses, so that rounding to microseconds does not select another pose.
  const auto between = [&](std::size_t i) {
    return std::to_string(0.5e-9 *
                          double(stamps_ns[i - 1] + stamps_ns[i] - 2 * recording.start_ns()));
  };
  Outputs outputs(bus_, {bus::topics::HeadPose::name, bus::topics::CameraInfo::name,
                         bus::topics::ViewInfo::name});
  const auto replay =
      this->replay({"--start", between(3), "--end", between(7), "--rate", "max", "--lossless"});
  EXPECT_EQ(end_of(*replay, outputs), 0) << replay->said();
  auto sent = outputs.sorted();
  EXPECT_EQ(sent[bus::topics::HeadPose::name].size(), 4u);
  EXPECT_EQ(sent[bus::topics::CameraInfo::name].size(), 3u);
  EXPECT_EQ(sent[bus::topics::ViewInfo::name].size(), 1u);
}

// The node handles every round of a loop like the first.
TEST_F(Replay, LoopsIntoARunningNode) {
  Outputs tiles(bus_, {bus::topics::HullTile::name});
  const auto recon = node("recon_node", "recon_a", kKeptDeployment);
  ASSERT_TRUE(eventually(bus_, test::kStart, [&] { return tiles.has_writers(1); }))
      << recon->said();
  const auto replay =
      this->replay({"--inputs-of", "recon_a", "--lossless", "--loop", "--rate", "max"});
  std::size_t a_round = 0;
  ASSERT_TRUE(eventually(bus_, 20s,
                         [&] {
                           tiles.take();
                           const auto sorted = tiles.sorted()[bus::topics::HullTile::name];
                           a_round = 0;
                           bool all_twice = !sorted.empty();
                           for (auto tile = sorted.begin(); tile != sorted.end(); ++a_round) {
                             const auto next = std::upper_bound(tile, sorted.end(), *tile);
                             all_twice &= next - tile >= 2;
                             tile = next;
                           }
                           return all_twice;
                         }))
      << a_round << '\n'
      << replay->said();
  replay->signal(SIGTERM);
  EXPECT_EQ(replay->wait_for_end(5s), 130) << replay->said();
  EXPECT_EQ(replay->said().find("has not handled"), std::string::npos) << replay->said();
}

TEST_F(Replay, LosslessReplayToStalledNodeExitsWithOne) {
  Outputs tiles(bus_, {bus::topics::HullTile::name});
  const auto recon = node("recon_node", "recon_a", kKeptDeployment);
  ASSERT_TRUE(eventually(bus_, test::kStart, [&] { return tiles.has_writers(1); }))
      << recon->said();
  const auto replay = this->replay({"--inputs-of", "recon_a", "--lossless", "--rate", "0.2"});
  ASSERT_TRUE(has_arrived(tiles, bus::topics::HullTile::name, 1, 20s)) << replay->said();
  recon->signal(SIGSTOP);
  EXPECT_EQ(end_of(*replay, tiles, 25s), 1) << replay->said();
  EXPECT_NE(replay->said().find("node 'recon_a' has not handled frame"), std::string::npos)
      << replay->said();
}

}  // namespace
}  // namespace fivepipe::test
