// Hosts whose clocks and files differ.
#include <cmath>
#include <cstdint>
#include <iostream>
#include <map>

#include "capture_node/sources/stream_modules.h"
#include "common/pipeline/bus/bus.h"
#include "tests/support/optional_package.h"
#include "tests/system/hosts/two_hosts.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

class HostClocks : public TwoHosts {
 protected:
  // The clocks are compared before the first frame.
  static constexpr int kDuration_s = kHasSanitizer ? 6 : 4;
  // Runs both hosts with the clock of alpha, which captures, ahead by clock_ms. Returns the report
  // of beta.
  json run(int clock_ms, const std::vector<std::string>& more) {
    const std::string file = deployment();
    std::vector<std::string> of_beta = more;
    of_beta.insert(of_beta.end(), {"--duration", std::to_string(kDuration_s)});
    const auto alpha = up(0, file, more, clock_ms), beta = up(1, file, of_beta);
    EXPECT_EQ(beta->wait_for_end(90s * kSlowdown), 0) << beta->said() << alpha->said();
    alpha->signal(SIGINT);
    EXPECT_EQ(alpha->wait_for_end(5s * kSlowdown), 130) << alpha->said();
    said_ = beta->said();
    return json::parse(std::ifstream(folder_.path / "beta/report.json"));
  }
  // The clock that beta has measured, and the latencies and the rate of its report.
  static void expect_right(const json& report, int clock_ms) {
    const json& alpha = report["hosts"]["alpha"];
    std::cout << "set " << clock_ms << " ms, measured " << alpha.dump() << ", latency "
              << report["latency_ms"].dump() << '\n';
    ASSERT_TRUE(alpha["clock_offset_ms"].is_number()) << alpha;
    const double offset_ms = alpha["clock_offset_ms"], error_ms = alpha["clock_error_ms"];
    EXPECT_NEAR(offset_ms, clock_ms, error_ms);
    EXPECT_TRUE(kHasSanitizer || std::abs(offset_ms - clock_ms) < 1) << alpha;
    // Uncorrected, they would be negative.
    ASSERT_FALSE(report["latency_ms"].is_null());
    EXPECT_GT(report["latency_ms"]["p50"].get<double>(), 0);
    EXPECT_LT(report["latency_ms"]["p50"].get<double>(), 150 * kSlowdown);
    for (const auto& [name, node] : report["nodes"].items())
      for (const auto& [latency, ms] : node["latencies_ms"].items())
        if (latency == "capture_to_tiles" || latency == "capture_to_composite") {
          EXPECT_GT(ms["p50"].get<double>(), 0) << name;
          EXPECT_LT(ms["p99"].get<double>(), 1000 * kSlowdown) << name;
        }
    const double rate_hz = report["frame_rate_hz"];
    // The deployment has 20 Hz.
    EXPECT_GT(rate_hz, kHasSanitizer ? 2 : 15);
    EXPECT_LT(rate_hz, 22);
    // The time of the run begins with the first composited frame, by the clock of beta.
    const double frames = report["frames"]["composited"];
    EXPECT_NEAR((frames - 1) / rate_hz, kDuration_s, kHasSanitizer ? 3 : 0.5);
    for (const auto& [name, node] : report["nodes"].items())
      EXPECT_LT(node.value("cpu_percent", 0.0), kHasSanitizer ? 150 : 110) << name;
  }
  std::string said_;  // by beta
};

TEST_F(HostClocks, EqualClocksAreNotWorthALine) {
  expect_right(run(0, {}), 0);
  EXPECT_FALSE(contains(said_, "the clock of host")) << said_;
}

TEST_F(HostClocks, FiveMillisecondsAreAWarning) {
  expect_right(run(5, {}), 5);
  EXPECT_TRUE(kHasSanitizer || contains(said_, "the clock of host alpha is ")) << said_;
}

TEST_F(HostClocks, AHundredAndFiftyMillisecondsAreRefusedUnlessAllowed) {
  const std::string file = deployment();
  {
    const auto alpha = up(0, file, {}, 150), beta = up(1, file);
    // The one that has measured first ends, so that the other one may never know.
    const auto refuses = [](Program& host, const std::string& text) {
      return host.wait_for_end(0s) == 2 && contains(host.said(), text) &&
             contains(host.said(), "start with --allow-clock-offset");
    };
    EXPECT_TRUE(holds(20s,
                      [&] {
                        return refuses(*alpha, " ms behind (error at most") ||
                               refuses(*beta, " ms ahead (error at most");
                      }))
        << alpha->said() << beta->said();
  }
  expect_right(run(150, {"--allow-clock-offset"}), 150);
}

TEST_F(HostClocks, TwoSecondsAreCorrectedIfAllowed) {
  expect_right(run(2000, {"--allow-clock-offset"}), 2000);
  expect_right(run(-2000, {"--allow-clock-offset"}), -2000);
}

// A host that runs goes on when another joins it whose clock is wrong: that one ends.
TEST_F(HostClocks, AHostThatJoinsLaterGivesWay) {
  const std::string file = deployment();
  const auto beta = up(1, file);
  ASSERT_TRUE(holds(kStart, [&] { return contains(beta->said(), "waiting for host alpha"); }))
      << beta->said();
  std::this_thread::sleep_for(11s);
  const auto alpha = up(0, file, {}, 150);
  EXPECT_EQ(alpha->wait_for_end(20s * kSlowdown), 2) << alpha->said();
  EXPECT_EQ(beta->wait_for_end(1s), std::nullopt) << beta->said();
}

TEST_F(HostClocks, ARigThatDiffersIsNamedWithBothSides) {
  const std::string file = deployment();
  const std::filesystem::path other = folder_.path / "other";
  std::filesystem::copy(folder_.path / "files", other);
  std::ofstream(other / "rig.yaml", std::ios::app) << "# calibrated again\n";
  const auto alpha = up(0, (other / "lab.yaml").string()), beta = up(1, file);
  EXPECT_TRUE(
      holds(kStart,
            [&] {
              return contains(beta->said(), "rig.yaml is not the same on host alpha (machine ") &&
                     contains(alpha->said(), "rig.yaml is not the same on host beta (machine ");
            }))
      << alpha->said() << beta->said();
  EXPECT_FALSE(contains(beta->said(), "lab.yaml is not the same")) << beta->said();
}

// Cameras with a clock of their own, on both hosts.
TEST_F(HostClocks, StampsOfASecondCaptureHostAreByTheClockOfTheFirst) {
  if (!base::exists(capture::kGstreamerModule))
    FIVEPIPE_SKIP_WITHOUT_PACKAGE("built without GStreamer (libgstreamer1.0-dev)");
  const std::string live =
      "{gstreamer: \"videotestsrc is-live=true ! "
      "video/x-raw,width=180,height=122,framerate=20/1\", "
      "chroma_key: {}}";
  const std::string file = (folder_.path / "files" / "live.yaml").string(),
                    synthetic = deployment();
  std::ofstream(file) << replaced(
      text_of(synthetic), "sources: synthetic, synthetic: {seed: 1, period_s: 4.0}}",
      "sources: {left: " + live + ", right: " + live +
          "}}\n  - {name: capture_b, program: capture_node, host: beta, sources: {far: " + live +
          "}}");
  bus::Bus bus({0, observer_network()});
  auto maps = bus.reader<bus::topics::ObjectPixelMap>();
  const auto alpha = up(0, file, {"--allow-clock-offset"}, 2000),
             beta = up(1, file, {"--allow-clock-offset"});
  std::map<std::uint64_t, std::map<std::string, std::int64_t>> stamps_of;  // by frame and camera
  int sets = 0;  // with stamps that fit, one after the other
  EXPECT_TRUE(holds(kStart,
                    [&] {
                      for (const auto& sample : maps.take()) {
                        if (!sample.valid()) continue;
                        auto& stamps = stamps_of[sample->frame];
                        stamps[sample->camera] = sample->capture_stamp_ns;
                        if (!stamps.contains("left") || !stamps.contains("far")) continue;
                        sets =
                            std::abs(stamps["left"] - stamps["far"]) < 500'000'000 ? sets + 1 : 0;
                      }
                      return sets > 20;
                    }))
      << alpha->said() << beta->said();
}

class DoctorOnTwoHosts : public TwoHosts {
 protected:
  std::unique_ptr<Program> doctor(int host, const std::string& file, const std::string& wait_s,
                                  int clock_ms = 0) {
    return fivepipe(host, {"doctor", "--deployment", file, "--domain", "0", "--wait", wait_s},
                    clock_ms);
  }
};

TEST_F(DoctorOnTwoHosts, ComparesThem) {
  const std::string file = deployment();
  const auto alpha = doctor(0, file, "60"), beta = doctor(1, file, "60");
  EXPECT_EQ(alpha->wait_for_end(30s * kSlowdown), 0) << alpha->said();
  EXPECT_EQ(beta->wait_for_end(30s * kSlowdown), 0) << beta->said();
  for (const char* text :
       {"ok    interface of host alpha: eth0 (10.77.0.1)",
        "ok    host beta (10.77.0.2): answers; packets of 1500 bytes arrive (MTU)",
        "ok    version and files of host beta: the same", "ok    multicast of host beta: arrives",
        " MB/s in the working folder; a recording "
        "of small needs "})
    EXPECT_TRUE(contains(alpha->said(), text)) << text << '\n' << alpha->said();
  EXPECT_TRUE(kHasSanitizer || contains(alpha->said(), "ok    clock of host beta: "))
      << alpha->said();
}

TEST_F(DoctorOnTwoHosts, NamesMulticastThatDoesNotArrive) {
  const std::string file = deployment();
  hosts_.drop_multicast(0);
  ASSERT_EQ(hosts_.why_not(), "");
  const auto alpha = doctor(0, file, "60"), beta = doctor(1, file, "60");
  EXPECT_EQ(alpha->wait_for_end(30s * kSlowdown), 0) << alpha->said();
  EXPECT_EQ(beta->wait_for_end(30s * kSlowdown), 0) << beta->said();
  EXPECT_TRUE(contains(alpha->said(), "warn  multicast of host beta: does not arrive"))
      << alpha->said();
  EXPECT_TRUE(contains(beta->said(), "ok    multicast of host alpha: arrives")) << beta->said();
}

TEST_F(DoctorOnTwoHosts, FindsWhatIsWrong) {
  const std::string file = deployment();
  // Else it would end because of this clock, perhaps before doctor knows it.
  const auto beta = up(1, file, {"--allow-clock-offset"});
  const auto alpha = doctor(0, file, "30", 150);
  EXPECT_EQ(alpha->wait_for_end(60s * kSlowdown), 3) << alpha->said();
  for (const char* text : {"FAIL  clock of host beta: 1", " ms behind (error at most"})
    EXPECT_TRUE(contains(alpha->said(), text)) << text << '\n' << alpha->said() << beta->said();
}

// Large messages of DDS do not arrive either, so nothing is compared.
TEST_F(DoctorOnTwoHosts, NamesPacketsThatAreTooLarge) {
  const std::string file = deployment();
  hosts_.set_mtu(1, 1400);
  ASSERT_EQ(hosts_.why_not(), "");
  const auto alpha = doctor(0, file, "0");
  EXPECT_EQ(alpha->wait_for_end(30s * kSlowdown), 0) << alpha->said();
  EXPECT_TRUE(contains(alpha->said(),
                       "warn  host beta (10.77.0.2): small packets arrive, packets "
                       "of 1500 bytes do not"))
      << alpha->said();
}

TEST_F(DoctorOnTwoHosts, MeasuresPacketsByEchoIfAFirewallDropsTheOthers) {
  const std::string file = deployment();
  hosts_.drop_udp(1, 9);
  hosts_.set_mtu(1, 1400);
  const auto limited = doctor(0, file, "0");
  EXPECT_EQ(limited->wait_for_end(30s * kSlowdown), 0) << limited->said();
  EXPECT_TRUE(contains(limited->said(),
                       "ok    host beta (10.77.0.2): answers; the size of packets "
                       "could not be tested"))
      << limited->said();
  hosts_.allow_echo(0);
  ASSERT_EQ(hosts_.why_not(), "");
  for (const auto& [mtu, text] :
       {std::pair{1400,
                  "warn  host beta (10.77.0.2): small packets arrive, packets of 1500 bytes "
                  "do not"},
        std::pair{1500, "ok    host beta (10.77.0.2): answers; packets of 1500 bytes arrive"}}) {
    hosts_.set_mtu(1, mtu);
    const auto permitted = doctor(0, file, "0");
    EXPECT_EQ(permitted->wait_for_end(30s * kSlowdown), 0) << permitted->said();
    EXPECT_TRUE(contains(permitted->said(), text)) << permitted->said();
  }
}

// A router on the path could fragment them, and would hide that they are too large.
TEST_F(DoctorOnTwoHosts, SendsPacketsThatNobodyMayFragment) {
  const std::string file = deployment();
  hosts_.drop_fragmentable(1, 9);
  ASSERT_EQ(hosts_.why_not(), "");
  const auto alpha = doctor(0, file, "0");
  EXPECT_EQ(alpha->wait_for_end(30s * kSlowdown), 0) << alpha->said();
  EXPECT_TRUE(
      contains(alpha->said(), "ok    host beta (10.77.0.2): answers; packets of 1500 bytes arrive"))
      << alpha->said();
}

// The kernel reports the error of a connection once.
TEST_F(DoctorOnTwoHosts, AHostThatRefusesAllDoesNotAnswer) {
  const std::string file = deployment();
  hosts_.refuse_all(1);
  ASSERT_EQ(hosts_.why_not(), "");
  const auto alpha = doctor(0, file, "0");
  EXPECT_EQ(alpha->wait_for_end(30s * kSlowdown), 0) << alpha->said();
  EXPECT_TRUE(contains(alpha->said(), "warn  host beta (10.77.0.2): no answer")) << alpha->said();
}

TEST_F(DoctorOnTwoHosts, NamesAHostThatIsMissing) {
  const std::string file = deployment();
  hosts_.set_link(1, false);
  const auto alpha = doctor(0, file, "1");
  EXPECT_EQ(alpha->wait_for_end(30s * kSlowdown), 0) << alpha->said();
  EXPECT_TRUE(contains(alpha->said(), "warn  host beta (10.77.0.2): no answer")) << alpha->said();
  EXPECT_TRUE(contains(alpha->said(), "warn  no fivepipe program answers on host beta"))
      << alpha->said();
}

// One machine that is off takes seconds.
TEST_F(DoctorOnTwoHosts, AsksAllHostsAtOnce) {
  const std::string one = deployment(), many = (folder_.path / "files" / "many.yaml").string();
  std::string hosts = "hosts:\n";
  for (int i = 0; i < 5; ++i)
    hosts += "  off_" + std::to_string(i) + ": {address: " + TestHosts::address(10 + i) + "}\n";
  std::ofstream(many) << replaced(text_of(one), "hosts:\n", hosts);
  hosts_.set_link(1, false);
  const auto seconds = [&](const std::string& file) {
    const auto start = std::chrono::steady_clock::now();
    const auto alpha = doctor(0, file, "0");
    EXPECT_EQ(alpha->wait_for_end(90s * kSlowdown), 0) << alpha->said();
    EXPECT_TRUE(contains(alpha->said(), "warn  host beta (10.77.0.2): no answer")) << alpha->said();
    EXPECT_EQ(contains(alpha->said(), "warn  host off_4 (10.77.0.15): no answer"), file == many)
        << alpha->said();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  const double of_one_s = seconds(one), of_six_s = seconds(many);
  EXPECT_LT(of_six_s, 2 * of_one_s + 1);
}

TEST_F(DoctorOnTwoHosts, NamesAHostWithoutARoute) {
  const std::string file = (folder_.path / "files" / "other.yaml").string();
  const std::string text = text_of(deployment());
  std::ofstream(file) << replaced(text, TestHosts::address(1), "10.78.0.2");
  const auto alpha = doctor(0, file, "0");
  EXPECT_EQ(alpha->wait_for_end(30s * kSlowdown), 3) << alpha->said();
  EXPECT_TRUE(contains(alpha->said(), "FAIL  host beta (10.78.0.2): this machine has no route"))
      << alpha->said();
}

}  // namespace
}  // namespace fivepipe::test
