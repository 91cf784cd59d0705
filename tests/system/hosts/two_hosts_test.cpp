// A deployment on two hosts, each with its own `fivepipe up`.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <set>

#include "common/config/deployment.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/system/hosts/two_hosts.h"
#include "tests/system/security/secured.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;

// At 20 Hz, with a margin for a busy machine. A sanitizer is slower.
const std::regex kFullRate(std::string("frames composited, now ") +
                           (kHasSanitizer ? "(0\\.[1-9]|[1-9])" : "(1[0-9]|2[0-9])\\."));

// The hosts start in any order; each finds its name by its address.
TEST_F(TwoHosts, FramesGoThroughBoth) {
  const std::string file = deployment();
  const auto beta = up(1, file);
  ASSERT_TRUE(holds(kStart, [&] { return contains(beta->said(), "waiting for host alpha"); }))
      << beta->said();
  const auto alpha = up(0, file);
  // The rate is that of the render_node, on whatever host it is.
  for (const Program* of_host : {alpha.get(), beta.get()})
    EXPECT_TRUE(holds(kStart, [&] { return std::regex_search(of_host->said(), kFullRate); }))
        << of_host->said();
  for (const auto& host : {beta.get(), alpha.get()}) {
    host->signal(SIGINT);
    EXPECT_EQ(host->wait_for_end(5s * kSlowdown), 130) << host->said();
  }
  const auto report = nlohmann::json::parse(std::ifstream(folder_.path / "beta/report.json"));
  EXPECT_GE(report["frames"]["composited"].get<int>(), kHasSanitizer ? 10 : 40) << beta->said();
}

// A machine with the addresses of both.
TEST_F(TwoHosts, TheHostOfTheOptionChoosesTheNodes) {
  const std::string further = "10.77.0.3";
  hosts_.add_address(0, further);
  ASSERT_EQ(hosts_.why_not(), "");
  const std::string text = replaced(text_of(deployment()), TestHosts::address(1), further);
  const std::filesystem::path file = folder_.path / "files" / "one_machine.yaml";
  std::ofstream(file) << text;
  const auto start = [&](const std::string& host, const std::string& log) {
    return std::make_unique<Program>(
        hosts_.in(0, {FIVEPIPE_BINARY_DIR "/fivepipe", "up", file.string(), "--domain", "0",
                      "--host", host, "--out", (folder_.path / log).string()}),
        folder_.path / (log + ".log"));
  };
  const auto wrong = start("gamma", "wrong");
  EXPECT_EQ(wrong->wait_for_end(kStart), 2);
  EXPECT_TRUE(contains(wrong->said(), "alpha (10.77.0.1), beta (10.77.0.3)")) << wrong->said();
  const auto beta = start("beta", "beta"), alpha = start("alpha", "alpha");
  EXPECT_TRUE(holds(kStart, [&] { return std::regex_search(beta->said(), kFullRate); }))
      << beta->said() << alpha->said();
  for (const auto& [host, program] : {std::pair{"alpha", &alpha}, {"beta", &beta}}) {
    (*program)->signal(SIGINT);
    EXPECT_EQ((*program)->wait_for_end(5s * kSlowdown), 130) << (*program)->said();
    const auto report = nlohmann::json::parse(std::ifstream(folder_.path / host / "report.json"));
    for (const std::string& node : kNodes)
      EXPECT_EQ(report["nodes"][node]["pids"].size(),
                (node == "capture") == (host == std::string("alpha")) ? 1u : 0u)
          << host << node;
  }
}

// Another process of the deployment on another host has an old rig. Its CameraInfos arrive at each
// node before any other, and stay latched beyond its end.
TEST_F(TwoHosts, AnOldRigOfTheDeploymentStopsNoFrame) {
  const std::string file = deployment();
  config::Rig old_rig = config::load_deployment(file).rig;
  bus::Bus bus({0, observer_network(), "old", "small"});
  auto infos = std::make_optional(bus.writer<bus::topics::CameraInfo>());
  auto composites = bus.reader<bus::topics::FrameComposited>();
  for (config::RigCamera& camera : old_rig.cameras) {
    camera.published.fx_px += 1;
    infos->write(messages::camera_info_message(camera));
  }
  const auto beta = up(1, file);
  // Two recon_nodes and sim_node.
  ASSERT_TRUE(holds(kStart, [&] { return infos->readers() == 3; })) << beta->said();
  ASSERT_TRUE(infos->wait_for_delivery(10s));
  const auto alpha = up(0, file);
  for (const bool is_there : {true, false}) {
    std::size_t frames = 0;
    EXPECT_TRUE(holds(kStart, [&] { return (frames += composites.take().size()) >= 20; }))
        << is_there << ' ' << frames << beta->said() << alpha->said();
    infos.reset();
  }
  beta->signal(SIGINT);
  EXPECT_EQ(beta->wait_for_end(5s * kSlowdown), 130) << beta->said();
  const auto report = nlohmann::json::parse(std::ifstream(folder_.path / "beta/report.json"));
  const std::string of_test = bus::text_of(bus::this_process());
  EXPECT_TRUE(report["refused_from"].contains(of_test)) << report["refused_from"];
  for (const std::string node : {"recon_a", "recon_b", "simulation"})
    EXPECT_TRUE(contains(report["nodes"][node]["diagnostics"].dump(), ": " + of_test + ": "))
        << report["nodes"][node]["diagnostics"];
}

TEST_F(TwoHosts, AMissingHostIsNamed) {
  const auto beta = up(1, deployment());
  const std::string waits = "waiting for host alpha (10.77.0.1): ";
  EXPECT_TRUE(holds(kStart, [&] { return contains(beta->said(), waits + "the machine answers"); }))
      << beta->said();
  hosts_.set_link(0, false);
  EXPECT_TRUE(holds(kStart, [&] { return contains(beta->said(), waits + "no answer: it is off"); }))
      << beta->said();
}

TEST_F(TwoHosts, EncryptedFramesGoThroughBoth) {
  make_small_keys(folder_.path / "files/keys", 0);
  for (const std::string profile : {"lan", "lossy"}) {
    const std::string file = deployment("", profile);
    std::ofstream(file, std::ios::app) << "security: {keys: keys}\n";
    constexpr int kDuration_s = kHasSanitizer ? 10 : 4;
    const nlohmann::json report = report_of_run(file, kDuration_s);
    // At 20 Hz.
    EXPECT_GE(report["frames"]["composited"].get<int>(), kHasSanitizer ? 20 : 15 * kDuration_s)
        << profile << report["frames"];
    EXPECT_TRUE(report["hosts"]["alpha"]["clock_offset_ms"].is_number()) << report["hosts"];
    EXPECT_FALSE(report["latency_ms"].is_null()) << report;
  }
}

TEST_F(TwoHosts, OnePercentOfLostPacketsLosesNoFrame) {
  const std::string file = deployment("", "lossy");
  constexpr int kDuration_s = kHasSanitizer ? 10 : 6;
  const nlohmann::json before = report_of_run(file, kDuration_s);
  hosts_.lose_one_in(100, 0);
  hosts_.lose_one_in(100, 1);
  ASSERT_EQ(hosts_.why_not(), "");
  const nlohmann::json after = report_of_run(file, kDuration_s);
  EXPECT_GT(hosts_.lost(0), 10);
  EXPECT_GT(hosts_.lost(1), 10);
  for (const nlohmann::json& report : {before, after}) {
    std::cout << report["frames"].dump() << report["latency_ms"].dump() << '\n';
    // A frame that misses a map or a tile is dropped with a reason. A late state loses no frame:
    // the objects are drawn as in the frame before. A sanitizer is slower than the rate of the
    // deployment.
    for (const auto& [reason, count] : report["frames"]["dropped"].items())
      EXPECT_TRUE((reason == "late_state" && (kHasSanitizer || report == after)) ||
                  (kHasSanitizer && (reason == "pipeline_busy" || reason == "video_frame")))
          << reason << report["frames"];
    // At the end, a recon_node finishes up to three frames that are assigned to it. capture_node no
    // longer waits for a frame that takes too long, as with a sanitizer.
    EXPECT_LE(report["frames"]["complete"].get<int>() - report["frames"]["composited"].get<int>(),
              kHasSanitizer ? 15 : 5);
    // The first and the last half second of a run may miss a part of the frames of 20 Hz.
    constexpr int kMaxMissing = 10;
    EXPECT_GE(report["frames"]["composited"].get<int>(),
              kHasSanitizer ? 20 : 20 * kDuration_s - kMaxMissing);
  }
  if (kHasSanitizer) return;
  EXPECT_LT(after["latency_ms"]["p99"].get<double>(),
            before["latency_ms"]["p99"].get<double>() + 50);
}

// FIVEPIPE_ROUNDS: how often.
TEST_F(TwoHosts, AReconstructionNodeIsAddedAndRemovedWithoutALostFrame) {
  const char* const rounds = std::getenv("FIVEPIPE_ROUNDS");
  const std::string file = deployment("", "lan", {"capture", "recon_a", "simulation", "rendering"});
  bus::Bus bus({0, observer_network()});
  auto poses = bus.reader<bus::topics::HeadPose>();
  auto composites = bus.reader<bus::topics::FrameComposited>();
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  std::set<std::uint64_t> sent, composited;  // frames
  bool owns = false;                         // recon_b has a tile of the newest frame
  // When recon_b has started, and when the first frame arrived of which it has a tile.
  std::int64_t start_ns = 0;
  std::optional<std::int64_t> owns_since_ns;
  const auto owns_tiles = [&](bool expected, std::chrono::seconds timeout) {
    return holds(timeout, [&] {
      for (const auto& sample : composites.take())
        if (sample.valid()) composited.insert(sample->frame);
      for (const auto& sample : statuses.take())
        if (sample.valid() && sample->node == std::string("recon_b"))
          start_ns = sample->start_stamp_ns;
      for (const auto& sample : poses.take()) {
        if (!sample.valid()) continue;
        owns = std::ranges::count(messages::span_of(sample->tile_owners), 1) > 0;
        if (owns && !owns_since_ns) owns_since_ns = sample.arrived_ns();
        sent.insert(sample->frame);
      }
      return owns == expected;
    });
  };
  const auto alpha = up(0, file);
  ASSERT_TRUE(holds(kStart, [&] { return contains(alpha->said(), "frames composited"); }))
      << alpha->said();
  ASSERT_TRUE(owns_tiles(false, 5s)) << "recon_b does not run";
  sent.clear();
  for (int i = 0; i < (rounds ? std::atoi(rounds) : 2); ++i) {
    owns_since_ns.reset();
    const std::int64_t before_ns = base::now_realtime_ns();
    const auto beta = up(1, file);
    ASSERT_TRUE(owns_tiles(true, 20s)) << i << beta->said();
    EXPECT_FALSE(owns_tiles(false, 1s)) << i << "it keeps them";
    ASSERT_TRUE(holds(5s, [&] { return owns_tiles(true, 0s) && start_ns > before_ns; })) << i;
    const double join_s = base::difference_s(*owns_since_ns, start_ns);
    std::cout << "recon_b gets tiles " << join_s << " s after its start\n";
    EXPECT_LT(join_s, 1 * kSlowdown) << i;
    beta->signal(SIGINT);
    EXPECT_TRUE(owns_tiles(false, 1s)) << i << beta->said();
    EXPECT_EQ(beta->wait_for_end(5s * kSlowdown), 130) << beta->said();
  }
  EXPECT_FALSE(owns_tiles(true, 1s));
  ASSERT_GT(sent.size(), 50u);
  for (const std::uint64_t frame : sent)
    EXPECT_TRUE(frame + 5 > *sent.rbegin() || composited.contains(frame)) << frame;
  alpha->signal(SIGINT);
  EXPECT_EQ(alpha->wait_for_end(5s * kSlowdown), 130) << alpha->said();
  EXPECT_FALSE(contains(alpha->said(), "died")) << alpha->said();
}

// Longer than the lease: each host takes the other one's processes for gone, and finds them again.
TEST_F(TwoHosts, AProcessThatWasOutOfReachIsTheSameProcess) {
  const std::string file = deployment();
  const auto beta = up(1, file), alpha = up(0, file);
  const auto composites = [&] { return contains(beta->said(), "frames composited, now "); };
  ASSERT_TRUE(holds(kStart, composites)) << beta->said();
  hosts_.set_link(0, false);
  ASSERT_TRUE(holds(30s, [&] {
    return contains(beta->said(), "capture: out of reach, no status from host alpha for ");
  })) << beta->said();
  std::this_thread::sleep_for(12s);
  hosts_.set_link(0, true);
  const std::size_t before = beta->said().size();
  EXPECT_TRUE(holds(30s, [&] {
    return contains(beta->said().substr(before), "frames composited, now 2") ||
           contains(beta->said().substr(before), "frames composited, now 1");
  })) << beta->said();
  beta->signal(SIGINT);
  EXPECT_EQ(beta->wait_for_end(5s * kSlowdown), 130) << beta->said();
  for (const Program* of_host : {alpha.get(), beta.get()})
    for (const char* text :
         {"another deployment runs", "processes publish as", " is stalled: ", "frames of both mix"})
      EXPECT_FALSE(contains(of_host->said(), text)) << of_host->said();
  const auto report = nlohmann::json::parse(std::ifstream(folder_.path / "beta/report.json"));
  // Each frame counts once.
  EXPECT_LE(report["frames"]["composited"].get<int>(), report["frames"]["captured"].get<int>());
}

TEST_F(TwoHosts, TopShowsMissingAndSilentOnes) {
  const std::string file = deployment();
  const auto beta = up(1, file);
  const Program top(
      hosts_.in(1, {FIVEPIPE_BINARY_DIR "/fivepipe", "top", "--domain", "0", "--deployment", file}),
      folder_.path / "top.log");
  const auto shows = [&](std::size_t from, const std::string& line) {
    return holds(kStart, [&] {
      return std::regex_search(top.said().substr(from), std::regex("(^|\n)" + line));
    });
  };
  EXPECT_TRUE(shows(0, "alpha +missing +-")) << top.said();
  EXPECT_TRUE(shows(0, "capture +alpha +no status +-")) << top.said();
  EXPECT_TRUE(shows(0, "beta +running ")) << top.said();
  EXPECT_TRUE(shows(0, "rendering +beta +running ")) << top.said();
  const auto alpha = up(0, file);
  EXPECT_TRUE(shows(0, "alpha +running ")) << top.said();
  EXPECT_TRUE(shows(0, "capture +alpha +running ")) << top.said();
  hosts_.set_link(0, false);
  EXPECT_TRUE(shows(0, "capture +alpha +silent ")) << top.said();
  EXPECT_TRUE(shows(0, "alpha +silent ")) << top.said();
  hosts_.set_link(0, true);
  const std::size_t before = top.said().size();
  EXPECT_TRUE(shows(before, "capture +alpha +running ")) << top.said();
  EXPECT_TRUE(shows(before, "alpha +running ")) << top.said();
}

// The frames of both would mix on every machine.
TEST_F(TwoHosts, ASecondDeploymentInTheDomainIsRefused) {
  const std::string file = deployment();
  const auto alpha = up(0, file);
  ASSERT_TRUE(holds(kStart, [&] { return contains(alpha->said(), "waiting for host beta"); }))
      << alpha->said();
  const std::filesystem::path other = folder_.path / "files" / "other.yaml";
  std::ofstream(other) << replaced(text_of(file), "name: ", "name: other_");
  const auto beta = up(1, other.string());
  EXPECT_EQ(beta->wait_for_end(20s * kSlowdown), 2) << beta->said();
  EXPECT_TRUE(contains(beta->said(), "runs in domain 0; stop it, or choose another --domain"))
      << beta->said();
  EXPECT_EQ(alpha->wait_for_end(1s), std::nullopt) << "it goes on: " << alpha->said();
  EXPECT_FALSE(contains(alpha->said(), "frames of both mix")) << alpha->said();
  EXPECT_FALSE(std::filesystem::exists(folder_.path / "beta/log")) << "it has started no node";
}

// Cyclone DDS waits for a packet to itself when it ends, and none arrives.
TEST_F(TwoHosts, EndsWithinTwoSecondsWithoutItsNetworkAdapter) {
  const auto alpha = up(0, deployment());
  ASSERT_TRUE(holds(kStart, [&] { return contains(alpha->said(), "waiting for host beta"); }))
      << alpha->said();
  hosts_.remove_interface(0);
  alpha->signal(SIGTERM);
  EXPECT_EQ(alpha->wait_for_end(2s * kSlowdown), 130) << alpha->said();
  EXPECT_TRUE(kHasSanitizer || !contains(alpha->said(), "is killed")) << alpha->said();
}

TEST_F(TwoHosts, AWrongInterfaceIsNamedWithTheExistingOnes) {
  const auto alpha = up(0, deployment(", interface: eth7"));
  EXPECT_EQ(alpha->wait_for_end(kStart), 2) << alpha->said();
  EXPECT_TRUE(contains(alpha->said(),
                       "this machine has no network interface 'eth7'; it has lo "
                       "(127.0.0.1), eth0 (10.77.0.1)"))
      << alpha->said();
}

TEST_F(TwoHosts, AMachineThatIsNoneOfThemIsToldTheNames) {
  std::string text = text_of(deployment());
  const std::filesystem::path file = folder_.path / "files" / "other.yaml";
  std::ofstream(file) << replaced(text, TestHosts::address(0), "10.77.0.9");
  const auto alpha = up(0, file.string());
  EXPECT_EQ(alpha->wait_for_end(kStart), 2) << alpha->said();
  EXPECT_TRUE(contains(alpha->said(),
                       "is none of the deployment's hosts; choose one of them with --host: alpha "
                       "(10.77.0.9), beta (10.77.0.2)"))
      << alpha->said();
}

}  // namespace
}  // namespace fivepipe::test
