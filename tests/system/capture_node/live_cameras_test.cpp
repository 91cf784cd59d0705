// Two GigE Vision cameras on the loopback interface and two files in one deployment. A camera is
// unplugged and plugged in again while the deployment runs.
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>

#include "capture_node/sources/stream_modules.h"
#include "common/pipeline/messages/bad_message.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/capture/loopback_cameras.h"
#include "tests/support/capture/own_network.h"
#include "tests/support/capture/pictures.h"
#include "tests/support/deployments.h"
#include "tests/support/optional_package.h"
#include "tests/support/process/memory.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::milliseconds;

const std::string kFirst = "127.0.0.1", kSecond = "127.0.0.2";
// Time for the processes to start on a busy machine.
constexpr auto kStart = 60s;
// The source waits half a second for an image.
constexpr Milliseconds kNamed = 1s * kSlowdown;
constexpr auto kUndisturbed = 5s;

class LiveCameras : public testing::Test {
 protected:
  // Before the bus is made, because its threads belong to the network of the thread that makes
  // them.
  static void SetUpTestSuite() {
    has_own_network_ =
        base::exists(capture::kGenicamModule) && enter_own_network({kFirst, kSecond});
  }
  void SetUp() override {
    if (!base::exists(capture::kGenicamModule))
      FIVEPIPE_SKIP_WITHOUT_PACKAGE("built without Aravis (libaravis-dev)");
    if (!has_own_network_)
      FIVEPIPE_SKIP_WITHOUT_PACKAGE("CAP_SYS_ADMIN (root), to give the test a network of its own");
    cameras_.start(kFirst, "A1", 90);
    cameras_.start(kSecond, "B2", 180);
    for (const char* camera : {"right", "above"}) write_pictures(folder_.path / camera, 40);
    const std::string files = "{video: CAMERA/f%d.ppm, background: CAMERA/f0.ppm, first_frame: 1}";
    deployment_ = changed_deployment(
        folder_.path, "sources: synthetic, synthetic: {seed: 1, period_s: 4.0}",
        "lost_camera: continue, sources: {left: {genicam: A1, chroma_key: {}}, far: {genicam: B2, "
        "chroma_key: {}}, right: " +
            replaced_all(files, "CAMERA", "right") +
            ", above: " + replaced_all(files, "CAMERA", "above") + "}",
        "  - name: above\n    image_size_px: [180, 122]\n    horizontal_fov_deg: 58\n    look_at: "
        "{eye_m: [0.3, -0.4, 2.2], target_m: [0, 0, 0.3]}\n");
  }

  void listen() {
    for (const auto& sample : composited_.take()) frames_ += sample.valid();
    for (const auto& sample : statuses_.take()) {
      if (!sample.valid()) continue;
      auto& drops = drops_[sample->node];
      for (const fivepipe_v1_DropCount& drop : messages::span_of(sample->drops))
        drops[messages::text_of({drop.reason, drop.subject, drop.detail})] = drop.count;
      auto& diagnostics = diagnostics_[sample->node];
      diagnostics.clear();
      for (const auto& diagnostic : messages::span_of(sample->diagnostics))
        diagnostics[diagnostic.subject] = diagnostic.text;
    }
  }
  bool within(Milliseconds timeout, const std::function<bool()>& condition) {
    return eventually(bus_, timeout, [&] {
      listen();
      return condition();
    });
  }
  bool more_frames(std::uint64_t more, Milliseconds timeout) {
    return within(timeout, [&, target = frames_ + more] { return frames_ >= target; });
  }
  // What capture_node says about the camera; empty: nothing.
  std::string said_of(const std::string& camera) const {
    const auto of_capture = diagnostics_.find("capture");
    if (of_capture == diagnostics_.end()) return "";
    const auto found = of_capture->second.find("camera " + camera);
    return found == of_capture->second.end() ? "" : found->second;
  }
  // Not only late, which a camera can be for an image on a busy machine.
  bool is_lost(const std::string& camera) const {
    return said_of(camera).find("the hull goes on without it") != std::string::npos;
  }
  // Drops of sets and of their maps, without those of the unplugged camera, and without frames that
  // came while a node was still busy.
  std::map<std::string, std::uint64_t> losses() const {
    std::map<std::string, std::uint64_t> result;
    for (const char* node : {"capture", "recon_a", "recon_b"})
      if (const auto drops = drops_.find(node); drops != drops_.end())
        for (const auto& [what, count] : drops->second)
          if (what.rfind("pipeline_busy", 0) != 0 && what != "missing_image: far")
            result[drops->first + ": " + what] = count;
    return result;
  }

  TestFolder folder_;
  LoopbackCameras cameras_{folder_.path, LoopbackCameras::Image::square};
  std::string deployment_;
  std::uint32_t domain_ = own_domain();
  bus::Bus bus_{{domain_}};
  bus::Reader<bus::topics::FrameComposited> composited_ =
      bus_.reader<bus::topics::FrameComposited>();
  bus::Reader<bus::topics::NodeStatus> statuses_ = bus_.reader<bus::topics::NodeStatus>();
  std::uint64_t frames_ = 0;
  std::map<std::string, std::map<std::string, std::uint64_t>> drops_;      // by node and text
  std::map<std::string, std::map<std::string, std::string>> diagnostics_;  // by node and subject

 private:
  static inline bool has_own_network_ = false;
};

TEST_F(LiveCameras, AnUnpluggedCameraIsNamedAndComesBackAndNothingElseIsLost) {
  Deployed deployed(deployment_, domain_, folder_.path / "out");
  ASSERT_TRUE(more_frames(20, kStart)) << deployed.said();
  // Nodes may drop frames while others start.
  const auto at_start = losses();
  const std::uint64_t frames_at_start = frames_;
  within(kUndisturbed, [] { return false; });
  EXPECT_EQ(losses(), at_start);
  for (const char* camera : {"left", "far", "right", "above"})
    ASSERT_FALSE(is_lost(camera)) << said_of(camera);
  if (!kHasSanitizer) {
    EXPECT_GE(frames_ - frames_at_start, 90u) << "20 Hz for 5 s";
  }
  std::map<std::string, std::size_t> first_round_bytes;  // by node
  const int rounds = std::getenv("FIVEPIPE_LONG") ? 8 : 2;
  for (int round = 0; round < rounds; ++round) {
    SCOPED_TRACE(round);
    cameras_.kill("B2");
    const auto killed = Clock::now();
    EXPECT_TRUE(within(5 * kNamed, [&] { return is_lost("far"); }));
    const auto named_ms = std::chrono::duration_cast<Milliseconds>(Clock::now() - killed);
    std::cout << "named after " << named_ms.count() << " ms: " << said_of("far") << '\n';
    EXPECT_LE(named_ms, kNamed);
    EXPECT_TRUE(more_frames(20, 5s * kSlowdown)) << "without the camera";
    EXPECT_FALSE(is_lost("left") || is_lost("right") || is_lost("above"));
    cameras_.start(kSecond, "B2", 180);
    EXPECT_TRUE(within(kCameraIsBack * kSlowdown, [&] { return !is_lost("far"); }))
        << said_of("far");
    EXPECT_TRUE(more_frames(20, 5s * kSlowdown)) << "with the camera again";
    for (const std::string& node : kNodes) {
      const std::size_t bytes = resident_bytes(deployed.pid_of(node).value_or(0));
      EXPECT_GT(bytes, 0u) << node;
      const std::size_t first_bytes = first_round_bytes.emplace(node, bytes).first->second;
      // Aravis reads the description of the camera, 100 KB, and makes 10 threads in each round.
      if (!kHasSanitizer) {
        EXPECT_LT(bytes, first_bytes + 20'000'000) << node;
      }
    }
  }
  EXPECT_EQ(losses(), at_start);
}

}  // namespace
}  // namespace fivepipe::test
