// Four prerendered cameras of 720x486 at 60 Hz on one core (launch/deployments/table4_60hz.yaml).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "common/pipeline/bus/topics.h"
#include "tests/support/optional_package.h"
#include "tests/support/process.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;

constexpr double kRate_Hz = 60;
constexpr int kCameras = 4;

bool is_long() { return std::getenv("FIVEPIPE_LONG") != nullptr; }
// Of the time from the capture of an image until capture_node writes its map. The short run must
// hold on a machine that other work disturbs.
double max_p99_ms() { return is_long() ? 8 : 1000 / kRate_Hz; }

struct Measured {
  nlohmann::json frames;       // of report.json
  std::vector<double> age_ms;  // of each map, ascending
  int dropped = 0;
};

Measured run_for(int seconds) {
  Measured run;
  const std::uint32_t domain = own_domain();
  bus::Bus bus({domain});
  auto maps = bus.reader<bus::topics::ObjectPixelMap>();
  const TestFolder folder;
  Deployed deployed(FIVEPIPE_SOURCE_DIR "/launch/deployments/table4_60hz.yaml", domain,
                    folder.path / "out", {"--duration", std::to_string(seconds)});
  std::optional<int> exit_code;
  EXPECT_TRUE(eventually(bus, 60s, [&] {
    for (const auto& sample : maps.take())
      if (sample.valid())
        run.age_ms.push_back(double(sample.source_stamp_ns() - sample->capture_stamp_ns) / 1e6);
    return (exit_code = deployed.wait_for_end(0ms)).has_value();
  }));
  EXPECT_EQ(exit_code, 0) << deployed.said();
  std::sort(run.age_ms.begin(), run.age_ms.end());
  if (exit_code != 0) return run;
  run.frames = nlohmann::json::parse(std::ifstream(folder.path / "out/report.json"))["frames"];
  for (const auto& [reason, count] : run.frames["dropped"].items()) run.dropped += int(count);
  return run;
}

TEST(SixtyHz, NoSetIsLostAndMapsAreOnTime) {
  if (kHasSanitizer) GTEST_SKIP() << "a sanitizer takes too much time for 60 Hz";
  if (std::thread::hardware_concurrency() < 2) FIVEPIPE_SKIP_WITHOUT_PACKAGE("needs two cores");
  const int seconds = is_long() ? 20 : 4;
  const auto max_dropped = [](const Measured& run) {
    return is_long() ? 0 : int(run.frames["captured"]) / 50;
  };
  Measured run = run_for(seconds);
  ASSERT_FALSE(run.frames.is_null());
  // In the short run, a pause of the machine of 0.3 s is too much. It drops frames once; a pipeline
  // that is too slow drops them again.
  if (!is_long() && run.dropped > max_dropped(run)) {
    std::cout << "repeated: " << run.frames.dump() << '\n';
    run = run_for(seconds);
    ASSERT_FALSE(run.frames.is_null());
  }
  const auto& [frames, age_ms, dropped] = run;
  const int captured = frames["captured"], in_flight = captured - int(frames["composited"]);
  ASSERT_GE(std::ssize(age_ms), kCameras * captured * 9 / 10) << frames;
  const double p99_ms = age_ms[age_ms.size() * 99 / 100];
  std::cout << frames.dump() << "\ncapture to published map: median " << age_ms[age_ms.size() / 2]
            << ", p99 " << p99_ms << ", worst " << age_ms.back() << " ms\n";
  EXPECT_LE(p99_ms, max_p99_ms());
  EXPECT_LE(dropped, max_dropped(run)) << frames;
  // Up to 7 are in flight when the deployment ends.
  EXPECT_LE(in_flight, 7 + dropped) << frames;
  EXPECT_GE(captured, int(0.96 * kRate_Hz * seconds)) << frames;
}

}  // namespace
}  // namespace fivepipe::test
