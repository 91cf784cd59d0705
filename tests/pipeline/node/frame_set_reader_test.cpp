#include "common/pipeline/node/frame_set_reader.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <optional>

#include "common/base/realtime.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/node/status_names.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::node {
namespace {

using namespace std::chrono_literals;

config::Rig rig_of(const std::vector<std::string>& cameras) {
  config::Rig rig;
  for (const std::string& name : cameras) {
    config::RigCamera camera;
    camera.name = name;
    camera.source = camera.published = {4, 4, 4, 4, 2, 2};
    rig.cameras.push_back(camera);
  }
  return rig;
}

// What the final status of a node states.
struct Stated {
  std::map<std::string, std::uint64_t> counts, drops, empty_cameras;
  std::map<std::string, double> max_latencies_ms;
  std::map<std::string, std::string> diagnostics;
};

Stated stated_by(const fivepipe_v1_NodeStatus& status) {
  Stated got;
  for (const auto& count : messages::span_of(status.counts)) got.counts[count.name] = count.count;
  for (const auto& drop : messages::span_of(status.drops))
    got.drops[messages::text_of({drop.reason, drop.subject, drop.detail})] = drop.count;
  for (const auto& empty : messages::span_of(status.empty_cameras))
    got.empty_cameras[empty.camera] = empty.frames;
  for (const auto& latency : messages::span_of(status.latencies))
    got.max_latencies_ms[latency.name] = latency.max_ms;
  for (const auto& diagnostic : messages::span_of(status.diagnostics))
    got.diagnostics[diagnostic.subject] = diagnostic.text;
  return got;
}

// A reader of frame sets, and a process that publishes the cameras c0, c1, ... and their maps.
class FrameSetReaderTest : public testing::Test {
 protected:
  explicit FrameSetReaderTest(std::size_t cameras = 2) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < cameras; ++i) names.push_back("c" + std::to_string(i));
    rig_ = rig_of(names);
    reader_.emplace(bus_, rig_, *status_);
    EXPECT_TRUE(test::eventually(bus_, 10s, [&] {
      return infos_.readers() == 1 && maps_.readers() == 1 && statuses_.writers() == 1;
    }));
  }
  void publish_camera(std::size_t camera, double fx_px) {
    config::RigCamera model = rig_.cameras[camera];
    model.published.fx_px = fx_px;
    infos_.write(messages::camera_info_message(model));
  }
  void publish_map(std::size_t camera, std::uint64_t frame, std::int64_t stamp_ns = 1'000'000,
                   bool with_object = true) {
    hull::ObjectPixels pixels(4, 4);
    if (with_object) pixels.set(1, 2);
    const std::string name = "c" + std::to_string(camera);
    maps_.write(messages::map_message(name, frame, stamp_ns, pixels).message());
  }
  // Takes until the reader returns the set of this frame.
  frames::FrameSet take_frame(std::uint64_t frame) {
    std::optional<frames::FrameSet> found;
    EXPECT_TRUE(test::eventually(bus_, 10s, [&] {
      for (frames::FrameSet& set : reader_->take(replay_))
        if (set.frame == frame) found = std::move(set);
      return found.has_value();
    })) << frame;
    return found.value();
  }
  // Ends the node.
  Stated final_status() {
    reader_.reset();
    status_.reset();
    std::optional<Stated> last;
    EXPECT_TRUE(test::eventually(bus_, 10s, [&] {
      for (const auto& sample : statuses_.take())
        if (sample.valid() && sample->final_report) last = stated_by(*sample);
      return last.has_value();
    }));
    return last.value();
  }

  using Counts = std::map<std::string, std::uint64_t>;
  using Texts = std::map<std::string, std::string>;
  bus::Bus bus_{{test::own_domain()}};
  bus::Reader<bus::topics::NodeStatus> statuses_ = bus_.reader<bus::topics::NodeStatus>();
  bus::Writer<bus::topics::CameraInfo> infos_ = bus_.writer<bus::topics::CameraInfo>();
  bus::Writer<bus::topics::ObjectPixelMap> maps_ = bus_.writer<bus::topics::ObjectPixelMap>();
  config::Rig rig_;
  std::optional<NodeStatusReporter> status_{std::in_place, bus_, "node"};
  std::optional<FrameSetReader> reader_;
  ReplayMonitor replay_{bus_, *status_, [this] { reader_->reset(); }};
};

TEST_F(FrameSetReaderTest, ReportsEachCompleteSet) {
  const std::int64_t before_ns = base::now_realtime_ns();
  publish_map(0, 1, 5'000'000);
  publish_map(1, 1, 7'000'000, false);
  const frames::FrameSet first = take_frame(1);
  EXPECT_GE(first.first_received_ns, before_ns);
  EXPECT_LE(first.last_received_ns, base::now_realtime_ns());
  for (const std::size_t camera : {0, 1}) publish_map(camera, 2, 9'000'000, false);
  take_frame(2);
  publish_map(0, 2, 9'000'000);
  publish_map(0, 3, 9'000'000);
  publish_map(1, 3, 9'000'000, false);
  take_frame(3);
  const Stated last = final_status();
  EXPECT_EQ(last.counts, (Counts{{kFrameSetsComplete, 3}}));
  EXPECT_EQ(last.drops, (Counts{{"late_map", 1}}));
  EXPECT_EQ(last.empty_cameras, (Counts{{"c0", 1}, {"c1", 3}}));
  EXPECT_EQ(last.max_latencies_ms, (std::map<std::string, double>{{"set_skew", 2}}));
  EXPECT_EQ(last.diagnostics, (Texts{{"hull", "empty: no object pixel in camera c1"}}));
}

// Coverage of another frame, or of another image of the same number, is not taken for that of a
// map. A map without coverage has an empty outline.
TEST_F(FrameSetReaderTest, JoinsTheCoverageOfTheSameImage) {
  reader_.emplace(bus_, rig_, *status_, FrameSetOptions{{}, true, {}});
  auto coverages = bus_.writer<bus::topics::ObjectCoverage>();
  EXPECT_TRUE(test::eventually(bus_, 10s,
                               [&] { return coverages.readers() == 1 && maps_.readers() == 1; }));
  const auto outline = [&](std::uint8_t coverage) {
    hull::CoverageOutline of{hull::ObjectPixels(4, 4), {coverage}};
    of.pixels.set(1, 1);
    return of;
  };
  const auto publish = [&](const char* camera, std::uint64_t frame, std::int64_t stamp_ns,
                           std::uint8_t coverage) {
    coverages.write(
        messages::coverage_message(camera, frame, stamp_ns, outline(coverage)).message());
  };
  publish("c0", 1, 1'000'000, 100);
  publish("c1", 1, 1'000'000, 200);
  for (const std::size_t camera : {0, 1}) publish_map(camera, 1);
  const frames::FrameSet first = take_frame(1);
  EXPECT_EQ(first.outlines, (std::vector<hull::CoverageOutline>{outline(100), outline(200)}));
  publish("c0", 2, 1'000'000, 100);
  publish("c1", 2, 999'999, 200);
  for (const std::size_t camera : {0, 1}) publish_map(camera, 2);
  const hull::CoverageOutline none{hull::ObjectPixels(4, 4), {}};
  EXPECT_EQ(take_frame(2).outlines, (std::vector<hull::CoverageOutline>{outline(100), none}));
  hull::CoverageOutline bad = outline(3);
  bad.coverage.push_back(4);
  coverages.write(messages::coverage_message("c1", 3, 1'000'000, bad).message());
  publish("c0", 3, 1'000'000, 5);
  for (const std::size_t camera : {1, 0}) publish_map(camera, 3);
  EXPECT_EQ(take_frame(3).outlines, (std::vector<hull::CoverageOutline>{outline(5), none}));
  // The coverage may come after its map, but not after the set is complete.
  publish_map(0, 4);
  EXPECT_TRUE(reader_->take(replay_).empty());
  publish("c0", 4, 1'000'000, 6);
  publish("c1", 4, 1'000'000, 7);
  publish_map(1, 4);
  EXPECT_EQ(take_frame(4).outlines, (std::vector<hull::CoverageOutline>{outline(6), outline(7)}));
  for (const std::size_t camera : {0, 1}) publish_map(camera, 5);
  EXPECT_TRUE(take_frame(5).outlines.empty());
  EXPECT_EQ(final_status().drops, (Counts{{"bad_coverage: c1: not as many coverages as pixels", 1},
                                          {"missing_coverage: c0", 1},
                                          {"missing_coverage: c1", 3}}));
}

// The node was busy when the replay began. A process receives its own messages during write().
TEST_F(FrameSetReaderTest, ReturnsNoMapOrCoverageThatArrivedBeforeTheReplay) {
  reader_.emplace(bus_, rig_, *status_, FrameSetOptions{{}, true, {}});
  auto sessions = bus_.writer<bus::topics::ReplaySession>();
  auto coverages = bus_.writer<bus::topics::ObjectCoverage>();
  ASSERT_TRUE(test::eventually(bus_, 10s, [&] {
    return sessions.readers() == 1 && coverages.readers() == 1 && maps_.readers() == 1;
  }));
  const auto publish_frame = [&](std::uint64_t frame) {
    for (const std::size_t camera : {0, 1}) publish_map(camera, frame);
  };
  publish_frame(100);
  hull::CoverageOutline outline{hull::ObjectPixels(4, 4), {100}};
  outline.pixels.set(1, 1);
  coverages.write(messages::coverage_message("c0", 1, 1'000'000, outline).message());
  fivepipe_v1_ReplaySession session{};
  messages::set_text(session.replay, "replay");
  sessions.write(session);
  publish_frame(1);
  const std::vector<frames::FrameSet> sets = reader_->take(replay_);
  ASSERT_EQ(sets.size(), 1u);
  EXPECT_EQ(sets[0].frame, 1u);
  EXPECT_TRUE(sets[0].outlines.empty());
}

struct ThreeCameras : FrameSetReaderTest {
  ThreeCameras() : FrameSetReaderTest(3) {}
};

TEST_F(ThreeCameras, NamesALostCameraUntilItReturns) {
  for (const bool returns : {false, true}) {
    status_.emplace(bus_, "node");
    reader_.emplace(bus_, rig_, *status_, FrameSetOptions{{}, false, {"c1"}});
    for (std::uint64_t frame = 0; frame < 16; ++frame) {
      for (const std::size_t camera : {0, 2}) publish_map(camera, frame, 1'000'000, false);
      reader_->take(replay_);
    }
    for (const std::size_t camera : {0, 2}) publish_map(camera, 16, 1'000'000);
    EXPECT_EQ(take_frame(16).lost_cameras, std::vector<std::string>{"c1"});
    if (returns)
      for (const std::size_t camera : {1, 2, 0}) {
        publish_map(camera, 17);
        EXPECT_EQ(reader_->take(replay_).size(), camera == 0 ? 1u : 0u);
      }
    EXPECT_EQ(
        final_status().diagnostics,
        returns ? Texts{} : (Texts{{"lost cameras", "c1; the hull uses only the other cameras"}}));
  }
}

// Two cameras that see a point and their object there suffice for a hull.
TEST_F(ThreeCameras, AnEmptyCameraEmptiesNoHullOfTwoOthersThatSeeIt) {
  reader_.emplace(bus_, rig_, *status_, FrameSetOptions{{hull::Limits::seen, 2}, false, {}});
  for (const std::size_t camera : {0, 1, 2}) publish_map(camera, 0, 1'000'000, camera != 1);
  EXPECT_EQ(take_frame(0).empty_cameras, std::vector<std::string>{"c1"});
  const Stated stated = final_status();
  EXPECT_EQ(stated.diagnostics, Texts{});
  EXPECT_EQ(stated.empty_cameras, Counts{});
}

TEST_F(ThreeCameras, NamesALostCameraWithoutWhichNoSetIsComplete) {
  reader_.emplace(bus_, rig_, *status_, FrameSetOptions{{}, false, {"c1"}});
  for (std::uint64_t frame = 0; frame < 20; ++frame) {
    publish_map(0, frame);
    EXPECT_TRUE(reader_->take(replay_).empty());
  }
  // The last of these maps may not have arrived.
  EXPECT_TRUE(test::eventually(bus_, 10s, [&] {
    EXPECT_TRUE(reader_->take(replay_).empty());
    bool is_named = false;
    for (const auto& sample : statuses_.take())
      if (sample.valid()) is_named = stated_by(*sample).diagnostics.contains("lost cameras");
    return is_named;
  }));
  EXPECT_EQ(final_status().diagnostics,
            (Texts{{"lost cameras",
                    "c1, c2; frames without the object pixels of c2 are dropped, because "
                    "their capture_node has no `lost_camera: continue`"}}));
}

TEST_F(FrameSetReaderTest, DropsMessagesThatDoNotFitTheRigAndNamesTheirSender) {
  publish_camera(0, 5);
  fivepipe_v1_CameraInfo unknown = messages::camera_info_message(rig_.cameras[0]);
  messages::set_text(unknown.camera, "c9");
  infos_.write(unknown);
  publish_map(0, 1);
  maps_.write(messages::map_message("c1", 1, 1'000'000, hull::ObjectPixels(4, 3)).message());
  publish_map(1, 1);
  EXPECT_TRUE(reader_->take(replay_).empty()) << "the map of c0 is dropped";
  publish_camera(0, rig_.cameras[0].published.fx_px);
  for (const std::size_t camera : {0, 1}) publish_map(camera, 2);
  take_frame(2);
  const Stated last = final_status();
  EXPECT_EQ(last.drops, (Counts{{"bad_camera_info: c9: published, but not in the rig ''", 1},
                                {"bad_map: c0: published camera model differs from the rig", 1},
                                {"bad_map: c1: wrong image size", 1},
                                {"incomplete_set", 1}}));
  const std::string sender = kRefusedFrom + bus::text_of(bus::this_process());
  EXPECT_EQ(last.counts, (Counts{{kFrameSetsComplete, 1}, {sender, 4}}));
  EXPECT_TRUE(last.diagnostics.empty()) << "the model is right now";
}

struct FrameSetReaderOf257Cameras : FrameSetReaderTest {
  FrameSetReaderOf257Cameras() : FrameSetReaderTest(257) {}
};

// Peers choose how many processes publish a camera.
TEST_F(FrameSetReaderOf257Cameras, RemembersTheNewest256WrongModels) {
  for (std::size_t camera = 0; camera < 257; ++camera) {
    publish_camera(camera, 5);
    reader_->take(replay_);
  }
  for (const std::size_t camera : {0, 1}) publish_map(camera, 1);
  reader_->take(replay_);
  EXPECT_EQ(final_status().drops,
            (Counts{{"bad_map: c1: published camera model differs from the rig", 1}}));
}

// Two processes publish the camera `left`. The maps of the first one are still dropped.
TEST(FrameSetReader, ARightModelOfOneProcessKeepsTheDiagnosticAboutAnother) {
  bus::Bus bus({test::own_domain()});
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  auto infos = bus.writer<bus::topics::CameraInfo>();
  const config::Rig rig = rig_of({"left", "right"});
  std::map<std::string, std::string> diagnostics;
  const auto take_statuses = [&] {
    for (const auto& sample : statuses.take()) {
      if (!sample.valid()) continue;
      diagnostics.clear();
      for (const auto& diagnostic : messages::span_of(sample->diagnostics))
        diagnostics[diagnostic.subject] = diagnostic.text;
    }
  };
  NodeStatusReporter status(bus, "node");
  FrameSetReader reader(bus, rig, status);
  ReplayMonitor replay(bus, status, [] {});
  // Publishes `left` with NaN.
  test::Program peer({FIVEPIPE_BINARY_DIR "/hostile_peer", std::to_string(test::own_domain()), "3",
                      "100", "CameraInfo"},
                     std::filesystem::path(testing::TempDir()) / "frame_set_reader_test.log");
  bool peer_ended = false;
  ASSERT_TRUE(test::eventually(bus, 20s, [&] {
    reader.take(replay);
    take_statuses();
    peer_ended = peer_ended || peer.wait_for_end(0ms).has_value();
    return peer_ended && diagnostics.contains("camera left");
  })) << peer.said();
  const std::string of_peer = "process " + std::to_string(peer.pid()) + " on host ";
  EXPECT_EQ(diagnostics["camera left"].substr(0, of_peer.size()), of_peer);

  infos.write(messages::camera_info_message(rig.cameras[0]));
  config::RigCamera wrong = rig.cameras[1];
  wrong.published.fx_px = 5;
  infos.write(messages::camera_info_message(wrong));
  ASSERT_TRUE(test::eventually(bus, 20s, [&] {
    reader.take(replay);
    take_statuses();
    return diagnostics.contains("camera right");
  }));
  EXPECT_EQ(diagnostics["camera left"].substr(0, of_peer.size()), of_peer);
  const std::string of_test = bus::text_of(bus::this_process());
  EXPECT_EQ(diagnostics["camera right"].substr(0, of_test.size()), of_test);

  infos.write(messages::camera_info_message(rig.cameras[1]));
  EXPECT_TRUE(test::eventually(bus, 20s, [&] {
    reader.take(replay);
    take_statuses();
    return !diagnostics.contains("camera right");
  }));
}

}  // namespace
}  // namespace fivepipe::node
