// Every version reads and replays the recording that version 1 made (tests/recordings/make).
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/config/deployment.h"
#include "common/recording/schema/cdr.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/recording/replayed_nodes.h"

namespace fivepipe::test {
namespace {

using nlohmann::ordered_json;
using recording::Recording;
using Counts = std::map<std::string, std::uint64_t>;

constexpr std::uint64_t kFrames = 33;

class KeptRecording : public test::ReplayedNodesTest {
 protected:
  static ordered_json first_of(const recording::Recording& recording, const std::string& topic) {
    auto cursor = recording.messages();
    while (const auto message = cursor.next())
      if (message->channel->topic == topic && !message->key_change)
        return schema::decode(recording.idl(*message->channel), message->channel->type,
                              message->cdr);
    return nullptr;
  }
};

// FNV-1a, 64 bits.
class Checksum {
 public:
  void add(std::span<const std::byte> bytes) {
    for (const std::byte byte : bytes) sum_ = (sum_ ^ std::uint64_t(byte)) * 0x100000001b3u;
  }
  std::uint64_t value() const { return sum_; }

 private:
  std::uint64_t sum_ = 0xcbf29ce484222325u;
};

TEST_F(KeptRecording, HasItsMessages) {
  const recording::Recording recording(kKeptRecording);
  ASSERT_TRUE(recording.mcap().is_finished()) << recording.mcap().damage().summary;
  EXPECT_EQ(test::counts_by_topic(recording), (Counts{{"fivepipe/v1/CameraInfo", 3},
                                                      {"fivepipe/v1/CollisionResult", 102},
                                                      {"fivepipe/v1/Command", 2},
                                                      {"fivepipe/v1/FrameComposited", kFrames},
                                                      {"fivepipe/v1/FrameTrace", 165},
                                                      {"fivepipe/v1/HeadPose", kFrames},
                                                      {"fivepipe/v1/HullComponents", kFrames},
                                                      {"fivepipe/v1/HullTile", 1584},
                                                      {"fivepipe/v1/NodeStatus", 25},
                                                      {"fivepipe/v1/ObjectColour", 3 * kFrames},
                                                      {"fivepipe/v1/ObjectPixelMap", 3 * kFrames},
                                                      {"fivepipe/v1/ReplaySession", 1},
                                                      {"fivepipe/v1/TileCosts", 66},
                                                      {"fivepipe/v1/ViewInfo", 1},
                                                      {"fivepipe/v1/VirtualState", 34}}));
  Counts key_changes;
  Checksum sum;
  auto cursor = recording.messages();
  while (const auto message = cursor.next()) {
    if (message->key_change) ++key_changes[message->channel->topic];
    sum.add(std::as_bytes(std::span(&message->source_stamp_ns, 1)));
    sum.add(message->cdr);
  }
  EXPECT_EQ(key_changes, (Counts{{"fivepipe/v1/CameraInfo", 3},
                                 {"fivepipe/v1/CollisionResult", 3},
                                 {"fivepipe/v1/Command", 2},
                                 {"fivepipe/v1/FrameComposited", 1},
                                 {"fivepipe/v1/FrameTrace", 5},
                                 {"fivepipe/v1/HeadPose", 1},
                                 {"fivepipe/v1/HullComponents", 1},
                                 {"fivepipe/v1/HullTile", 48},
                                 {"fivepipe/v1/NodeStatus", 5},
                                 {"fivepipe/v1/ObjectColour", 3},
                                 {"fivepipe/v1/ObjectPixelMap", 3},
                                 {"fivepipe/v1/ReplaySession", 1},
                                 {"fivepipe/v1/TileCosts", 2},
                                 {"fivepipe/v1/ViewInfo", 1},
                                 {"fivepipe/v1/VirtualState", 1}}));
  EXPECT_EQ(sum.value(), 16331128358447783367u);
  std::set<std::string> writers;
  for (const recording::RecordedChannel& channel : recording.channels())
    if (!channel.node.empty()) writers.insert(channel.node);
  EXPECT_EQ(writers, (std::set<std::string>{"capture", "recon_a", "recon_b", "simulation",
                                            "rendering", "replay"}));
}

// The expected values are those that @foxglove/omgidl-serialization read when the file was made.
TEST_F(KeptRecording, DecodesToItsValues) {
  const recording::Recording recording(kKeptRecording);
  const auto map = first_of(recording, bus::topics::ObjectPixelMap::name);
  EXPECT_EQ(map["camera"], "left");
  EXPECT_EQ(map["capture_stamp_ns"], 1795372620245587784);
  EXPECT_EQ(map["region"],
            (ordered_json{{"u0_px", 73}, {"v0_px", 51}, {"u1_px", 148}, {"v1_px", 64}}));
  EXPECT_EQ(map["object_pixels"], 415);
  EXPECT_EQ(map["encoding"], "run_lengths");
  EXPECT_EQ(map["payload"].size(), 128u);
  const auto pose = first_of(recording, bus::topics::HeadPose::name);
  EXPECT_EQ(pose["eye_from_world"]["translation_m"]["y"], 0.20327240868142316);
  EXPECT_EQ(pose["tile_owners"].size(), 48u);
  const auto state = first_of(recording, bus::topics::VirtualState::name);
  EXPECT_EQ(state["objects"][0]["warmth"].size(), 60u);
  EXPECT_EQ(state["objects"][1]["object"], "ball");
  EXPECT_EQ(state["objects"][1]["world_from_object"]["translation_m"]["z"], 0.8);
  const auto colour = first_of(recording, bus::topics::ObjectColour::name);
  EXPECT_EQ(colour["bgr"].size(), 3u * 415u);
  const auto components = first_of(recording, bus::topics::HullComponents::name);
  EXPECT_EQ(components["components"][0]["centroid_m"]["x"], 0.14102470141150913);
  const auto session = first_of(recording, bus::topics::ReplaySession::name);
  EXPECT_EQ(session["replay"], "replay");
  EXPECT_EQ(session["lossless"], false);
  EXPECT_EQ(session["rate"], 0.0);
  const auto result = first_of(recording, bus::topics::CollisionResult::name);
  EXPECT_EQ(result["object"], "plate");
  EXPECT_EQ(result["verdict"], "free");
  EXPECT_EQ(result["proximity"][0]["min_m"].size(), 60u);
}

TEST_F(KeptRecording, HasTheTypesOfThisBuildAndItsDeployment) {
  const recording::Recording recording(kKeptRecording);
  std::set<mcap::Id> all;
  for (const recording::RecordedChannel& channel : recording.channels()) all.insert(channel.id);
  EXPECT_EQ(recording.type_differences(all), std::vector<std::string>{});
  const auto file = recording.extract_deployment(folder_ / "deployment");
  ASSERT_TRUE(file);
  const config::Deployment deployment =
      config::load_deployment(*file, recording.metadata("settings"));
  EXPECT_EQ(deployment.name, "small");
  EXPECT_EQ(deployment.nodes.size(), 5u);
  EXPECT_EQ(deployment.rig.cameras.size(), 3u);
}

TEST_F(KeptRecording, IsReplayedLosslessly) {
  const auto recon = replayed(kKeptRecording, {{"recon_node", "recon_a"}},
                              {bus::topics::HullTile::name}, {"--rate", "max"}, kKeptDeployment);
  EXPECT_EQ(recon.counts.at("recon_a").at("frame_sets_complete"), kFrames);
  const auto simulation =
      replayed(kKeptRecording, {{"sim_node", "simulation"}}, {bus::topics::VirtualState::name},
               {"--rate", "max"}, kKeptDeployment);
  EXPECT_EQ(simulation.outputs.at(bus::topics::VirtualState::name).size(), kFrames);
}

}  // namespace
}  // namespace fivepipe::test
