#include "common/pipeline/node/frame_set_reader.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "common/pipeline/messages/camera_messages.h"
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
  // Publishes `left` with NaN.
  test::Program peer({FIVEPIPE_BINARY_DIR "/hostile_peer", std::to_string(test::own_domain()), "3",
                      "100", "CameraInfo"},
                     std::filesystem::path(testing::TempDir()) / "frame_set_reader_test.log");
  bool peer_ended = false;
  ASSERT_TRUE(test::eventually(bus, 20s, [&] {
    reader.take();
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
    reader.take();
    take_statuses();
    return diagnostics.contains("camera right");
  }));
  EXPECT_EQ(diagnostics["camera left"].substr(0, of_peer.size()), of_peer);
  const std::string of_test = bus::text_of(bus::this_process());
  EXPECT_EQ(diagnostics["camera right"].substr(0, of_test.size()), of_test);

  infos.write(messages::camera_info_message(rig.cameras[1]));
  EXPECT_TRUE(test::eventually(bus, 20s, [&] {
    reader.take();
    take_statuses();
    return !diagnostics.contains("camera right");
  }));
}

}  // namespace
}  // namespace fivepipe::node
