// A deployment on four hosts at 1 Gb/s: two capture, one reconstructs and simulates, one renders.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "common/config/deployment.h"
#include "tests/support/deployments.h"
#include "tests/support/optional_package.h"
#include "tests/support/process/test_hosts.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr int kHosts = 4, kPictures = 8;
constexpr double kCovered = 0.15;  // of each image
const std::vector<std::string> kNames{"alpha", "beta", "gamma", "delta"};

bool is_long() { return std::getenv("FIVEPIPE_LONG") != nullptr; }

class FourHosts : public testing::Test {
 protected:
  void SetUp() override {
    if (!hosts_.why_not().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE(hosts_.why_not());
    for (int host = 0; host < kHosts; ++host) hosts_.limit_rate(host, "1gbit");
    ASSERT_EQ(hosts_.why_not(), "");
  }

  // Writes what each camera sees of a ball above the table: a disc that covers kCovered of the
  // image and moves by two pixels from picture to picture. Picture 0 is empty.
  void write_pictures(const config::Rig& rig) const {
    for (const config::RigCamera& camera : rig.cameras) {
      const auto centre = geometry::project(config::published_camera(camera), {0, 0, 0.3});
      ASSERT_TRUE(centre) << camera.name;
      const int width = camera.source.width_px, height = camera.source.height_px;
      const double radius_px = std::sqrt(kCovered * width * height / M_PI);
      std::filesystem::create_directories(folder_.path / camera.name);
      for (int i = 0; i <= kPictures; ++i) {
        std::string pixels(std::size_t(3 * width * height), '\x40');
        const double x = centre->x() + 2 * (i - kPictures / 2.0);
        for (int v = 0; v < height && i > 0; ++v)
          for (int u = 0; u < width; ++u)
            if (std::hypot(u - x, v - centre->y()) < radius_px)
              pixels.replace(3 * (std::size_t(v) * std::size_t(width) + std::size_t(u)), 3,
                             "\xc0\xd0\xe0");
        std::ofstream(folder_.path / camera.name / ("f" + std::to_string(i) + ".ppm"),
                      std::ios::binary)
            << "P6 " << width << ' ' << height << " 255\n"
            << pixels;
      }
    }
  }
  std::string deployment(int rate_hz) const {
    const std::string rig = FIVEPIPE_SOURCE_DIR "/scenes/rigs/table4.yaml";
    std::string text = "name: four\nrig: " + rig +
                       "\nscene: " FIVEPIPE_SOURCE_DIR "/scenes/demo/scene.yaml\nframe_rate_hz: " +
                       std::to_string(rate_hz) + "\nhosts:\n";
    for (int host = 0; host < kHosts; ++host)
      text += "  " + kNames[std::size_t(host)] + ": {address: " + TestHosts::address(host) + "}\n";
    text +=
        "viewer:\n  path:\n    - {t_s: 0, eye_m: [0.0, -0.75, 0.55], target_m: [0.0, 0.05, 0.2]}\n"
        "  horizontal_fov_deg: 65\n  render_size_px: [640, 480]\n  recon_size_px: [640, 480]\n"
        "nodes:\n";
    const auto capture = [&](const std::string& name, const std::string& host,
                             const std::vector<std::string>& cameras) {
      std::string sources;
      for (const std::string& camera : cameras)
        sources += (sources.empty() ? "" : ", ") + camera + ": {video: " + camera +
                   "/f%d.ppm, background: " + camera + "/f0.ppm, first_frame: 1}";
      text += "  - {name: " + name + ", program: capture_node, host: " + host +
              ", precomputed_frames: " + std::to_string(kPictures) + ", sources: {" + sources +
              "}}\n";
    };
    capture("capture_a", "alpha", {"up_left", "up_far"});
    capture("capture_b", "beta", {"up_right", "table_height"});
    text +=
        "  - {name: recon_a, program: recon_node, host: gamma, worker: 0, workers: 2}\n"
        "  - {name: recon_b, program: recon_node, host: gamma, worker: 1, workers: 2}\n"
        "  - {name: simulation, program: sim_node, host: gamma}\n"
        "  - {name: rendering, program: render_node, host: delta, video: false}\n";
    const std::filesystem::path file = folder_.path / "four.yaml";
    std::ofstream(file) << text;
    write_pictures(config::load_deployment(rig_only(rig)).rig);
    return file.string();
  }
  // The smallest deployment with the rig, to load it.
  std::string rig_only(const std::string& rig) const {
    return changed_deployment(folder_.path / "rig_only", "rig: rig.yaml", "rig: " + rig);
  }

  std::unique_ptr<Program> run(int host, std::vector<std::string> words,
                               const std::string& log) const {
    return std::make_unique<Program>(host < 0 ? std::move(words) : hosts_.in(host, words),
                                     folder_.path / (log + ".log"));
  }
  // Composited frames per second on the four hosts, or on one (--local), of one run.
  double rate(const std::string& file, bool local) {
    const auto up = [&](int host, const std::string& name, std::vector<std::string> more) {
      std::vector<std::string> words{FIVEPIPE_BINARY_DIR "/fivepipe", "up", file, "--out",
                                     (folder_.path / name).string()};
      words.insert(words.end(), more.begin(), more.end());
      return run(host, words, name);
    };
    const TestHosts::Traffic before = local ? TestHosts::Traffic{} : total();
    std::vector<std::unique_ptr<Program>> others;
    if (!local)
      for (int host = 0; host < kHosts - 1; ++host)
        others.push_back(up(host, kNames[std::size_t(host)], {}));
    const std::string name = local ? "local" : "delta";
    std::vector<std::string> more{"--duration", is_long() || kHasSanitizer ? "8" : "4"};
    if (local) more.push_back("--local");
    const auto last = up(local ? -1 : kHosts - 1, name, more);
    EXPECT_EQ(last->wait_for_end(120s * kSlowdown), 0) << last->said();
    for (const auto& other : others) other->signal(SIGINT);
    for (const auto& other : others)
      EXPECT_EQ(other->wait_for_end(5s * kSlowdown), 130) << other->said();
    const json report = json::parse(std::ifstream(folder_.path / name / "report.json"));
    std::cout << name << ": " << report["frame_rate_hz"] << " frames/s, latency "
              << report["latency_ms"].dump() << ' ' << report["rate_bound"] << '\n';
    if (!local)  // maps, tiles, colour and all other topics
      std::cout << "all hosts together sent "
                << 8e-6 * double(total().sent_bytes - before.sent_bytes) /
                       report["frames"]["composited"].get<double>()
                << " Mb per composited frame\n";
    return report["frame_rate_hz"];
  }
  // The profile lan, for a program without a deployment.
  static std::string configuration(int host) {
    std::string peers;
    for (int i = 0; i < kHosts; ++i) peers += "<Peer Address=\"" + TestHosts::address(i) + "\"/>";
    return replaced(
        replaced(text_of(FIVEPIPE_SOURCE_DIR "/launch/profiles/lan.xml"),
                 "<Interfaces>${interface}",
                 "<Interfaces><NetworkInterface address=\"" + TestHosts::address(host) + "\"/>"),
        "<Peers>${peers}", "<Peers>" + peers);
  }
  // What all hosts together have sent and received.
  TestHosts::Traffic total() const {
    TestHosts::Traffic sum;
    for (int host = 0; host < kHosts; ++host) {
      const TestHosts::Traffic of_host = hosts_.traffic(host);
      sum.sent_bytes += of_host.sent_bytes;
      sum.received_bytes += of_host.received_bytes;
    }
    return sum;
  }

  // Measures for `seconds` what all hosts together send and receive [Mb/s].
  std::pair<double, double> mbit_per_s(int seconds) const {
    const TestHosts::Traffic before = total();
    std::this_thread::sleep_for(std::chrono::seconds(seconds));
    const TestHosts::Traffic after = total();
    return {8e-6 * double(after.sent_bytes - before.sent_bytes) / seconds,
            8e-6 * double(after.received_bytes - before.received_bytes) / seconds};
  }

  const TestFolder folder_;
  TestHosts hosts_{kHosts, folder_.path};
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

// The rates on four hosts divided by the mean rate of the runs on one host before and after each,
// because the speed of a machine drifts. All hosts share the cores of this machine, so what the
// network costs is the time in which its kernel handles packets; jumbo frames need fewer.
TEST_F(FourHosts, TheNetworkCostsLittleOfTheRate) {
  const std::string file = deployment(240);
  const std::vector<int> mtus = is_long() ? std::vector{1500, 9000} : std::vector{1500};
  std::map<int, std::vector<double>> ratios;  // by MTU [bytes]
  double before = rate(file, true);
  for (int i = 0; i < (is_long() ? 5 : 1); ++i)
    for (const int mtu : mtus) {
      hosts_.set_mtu_of_all(mtu);
      const double on_four = rate(file, false), after = rate(file, true);
      ratios[mtu].push_back(2 * on_four / (before + after));
      before = after;
    }
  ASSERT_EQ(hosts_.why_not(), "");
  for (const auto& [mtu, of_mtu] : ratios)
    std::cout << "four hosts, MTU " << mtu << ": " << median(of_mtu) << " of the rate on one host, "
              << *std::ranges::min_element(of_mtu) << " to " << *std::ranges::max_element(of_mtu)
              << '\n';
  if (kHasSanitizer) return;
  // One run of each is no measurement: it shows only that frames go through all hosts.
  EXPECT_GT(median(ratios[1500]), is_long() ? 0.85 : 0.4);
  if (is_long()) {
    EXPECT_GT(median(ratios[9000]), 0.9);
  }
}

// The nodes that read object-pixel maps run on one host or on several: a map is sent once.
TEST_F(FourHosts, AMapIsSentOnceForAllReaders) {
  const std::string file = deployment(60);
  const auto of_readers = [&](const std::vector<int>& readers_on) {
    std::vector<std::unique_ptr<Program>> programs, readers;
    for (const int host : {0, 1})
      programs.push_back(run(host,
                             {FIVEPIPE_BINARY_DIR "/capture_node", "--deployment", file, "--node",
                              host == 0 ? "capture_a" : "capture_b"},
                             "capture" + std::to_string(host)));
    for (std::size_t i = 0; i < readers_on.size(); ++i)
      readers.push_back(run(readers_on[i],
                            {"/usr/bin/env", "CYCLONEDDS_URI=" + configuration(readers_on[i]),
                             FIVEPIPE_MAP_READER, "0"},
                            "reader" + std::to_string(i)));
    const auto end = std::chrono::steady_clock::now() + 60s * kSlowdown;
    for (const auto& reader : readers) {
      while (!contains(reader->said(), "reads") && std::chrono::steady_clock::now() < end)
        std::this_thread::sleep_for(20ms);
      EXPECT_TRUE(contains(reader->said(), "reads")) << programs[0]->said() << programs[1]->said();
    }
    // The packets of discovery are no maps. After 2 s they were once 2 of 8 Mb/s.
    std::this_thread::sleep_for(5s * kSlowdown);
    const auto [sent, received] = mbit_per_s(5);
    for (const auto& program : programs) program->signal(SIGKILL);
    for (const auto& reader : readers) reader->signal(SIGKILL);
    EXPECT_LT(sent, 15);
    EXPECT_LT(received, 15);
    std::cout << readers_on.size() << " readers: hosts send " << sent << " Mb/s, receive "
              << received << " Mb/s\n";
    return std::pair(sent, received);
  };
  const auto one = of_readers({2}), apart = of_readers({2, 2, 3});
  EXPECT_GT(one.first, 1);
  EXPECT_LT(apart.first, 1.2 * one.first);  // received by two hosts
  if (!is_long()) return;
  const auto three = of_readers({2, 2, 2});
  EXPECT_LT(three.first, 1.2 * one.first);
  EXPECT_LT(three.second, 1.2 * one.second);
}

}  // namespace
}  // namespace fivepipe::test
