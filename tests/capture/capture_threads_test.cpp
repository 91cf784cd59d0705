#include <thread>

#include "capture_node/capture.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/thread_starts.h"

namespace fivepipe::capture {
namespace {

// Starting a thread costs tens of microseconds, so Capture keeps its threads from frame to frame.
TEST(Capture, StartsNoThreadAfterItsConstruction) {
  const int before = test::thread_starts();
  std::thread([] {}).join();
  ASSERT_EQ(test::thread_starts(), before + 1) << "the counter misses std::thread";

  config::Rig rig;
  rig.cameras = {test::table_camera("left", {-1.5, 0.9, 1.3}, 240, 162),
                 test::table_camera("right", {1.5, 0.9, 1.3}, 240, 162)};
  config::CaptureConfig config;
  for (const config::RigCamera& camera : rig.cameras)
    config.sources[camera.name] = config::SyntheticSource{};
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
  Capture capture(rig, viewer, config, 30);
  capture.capture(0, true);
  const int started = test::thread_starts();
  for (int frame = 1; frame <= 10; ++frame) capture.capture(frame, true);
  EXPECT_EQ(test::thread_starts(), started);
}

}  // namespace
}  // namespace fivepipe::capture
