// A minute of the pipeline with four cameras at 60 Hz and at the paper's sizes, recorded: every
// topic keeps its rate, the composites too, and nothing is lost. The machine of a quick run may be
// too slow to composite each frame; then render_node counts the frames that it drops.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/recording/schema/cdr.h"
#include "tests/support/recording/recordings.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using recording::Recording;

constexpr std::size_t kCameras = 4;
constexpr double kFrameRate_Hz = 60;
// Messages per frame of each topic that nodes write for every frame.
struct ExpectedRate {
  const char* topic;
  double messages_per_frame;
  double not_of_incomplete = 0;  // of them, those that a frame without all its tiles lacks
};
constexpr ExpectedRate kExpected[] = {
    {bus::topics::HeadPose::name, 1},
    {bus::topics::ObjectColour::name, kCameras},
    {bus::topics::ObjectPixelMap::name, kCameras},
    {bus::topics::CollisionResult::name, 7},  // objects of the scene with a reaction
    {bus::topics::VirtualState::name, 1},
    {bus::topics::SimulationMetrics::name, 1},  // the scene has a ball that moves
    {bus::topics::TileCosts::name, 2},          // reconstruction nodes
    {bus::topics::HullTile::name, 48},
    {bus::topics::FrameComposited::name, 1, 1},
    {bus::topics::FrameTrace::name, 5, 1},  // nodes, one of them render_node
};

bool is_long() { return std::getenv("FIVEPIPE_LONG") != nullptr; }

// `counts` are messages by topic, in `seconds` of maps of `frames` frames, of which render_node
// counted `incomplete` as dropped.
void expect_rates(std::map<std::string, std::uint64_t> counts, std::size_t frames,
                  std::uint64_t incomplete, double seconds) {
  // capture_node skips a frame if it is late for it, and other processes of the machine may
  // delay a node. In a short run the start weighs more.
  const double tolerance = is_long() ? 0.05 : 0.3;
  const double missing = is_long() ? 0 : double(incomplete) / double(frames);
  EXPECT_LT(missing, 0.5);
  for (const ExpectedRate& expected : kExpected) {
    const double count = double(counts[expected.topic]),
                 per_frame = expected.messages_per_frame - missing * expected.not_of_incomplete;
    EXPECT_NEAR(count / (per_frame * double(frames)), 1, tolerance)
        << expected.topic << ": " << count << " messages of " << frames << " frames, " << incomplete
        << " of which are incomplete";
    if (is_long()) {  // the machine of a quick run may be too slow for the frame rate
      EXPECT_NEAR(count / seconds / (per_frame * kFrameRate_Hz), 1, tolerance)
          << expected.topic << ": " << count / seconds << " Hz";
    }
    counts.erase(expected.topic);
  }
  // The five nodes publish their status twice a second, also before the first and after the last
  // map.
  EXPECT_GE(double(counts[bus::topics::NodeStatus::name]), 2 * 5 * seconds * (1 - tolerance));
  counts.erase(bus::topics::NodeStatus::name);
  EXPECT_EQ(counts, (std::map<std::string, std::uint64_t>{{bus::topics::CameraInfo::name, 4},
                                                          {bus::topics::ViewInfo::name, 1}}))
      << "topics that the table of this test does not list";
}

std::uint64_t incomplete_hulls(const nlohmann::ordered_json& status) {
  std::uint64_t count = 0;
  for (const auto& drop : status["drops"])
    if (drop["reason"] == "incomplete_hull") count += drop["count"].get<std::uint64_t>();
  return count;
}

class LongRecording : public test::RecordingTest {};

TEST_F(LongRecording, AMinuteAtSixtyHertzKeepsEveryRateAndLosesNothing) {
  // A sanitizer leaves too little time for 60 Hz, so there the test only checks that the recording
  // has every message. capture_node needs most of that time for its backgrounds; it
  // precomputes few frames.
  const std::string duration_s = is_long() ? "60" : kHasSanitizer ? "90" : "5";
  const std::filesystem::path file = folder_ / "long.mcap";
  auto statuses = bus_.reader<bus::topics::NodeStatus>();
  test::Deployed deployed(FIVEPIPE_SOURCE_DIR "/tests/system/long_deployment.yaml", domain_,
                          folder_ / "up",
                          {"--duration", duration_s, "--record", file.string(), "--set",
                           is_long() ? "in_flight=0" : "in_flight=3", "--set",
                           kHasSanitizer ? "precomputed=6" : "precomputed=60"});
  double recorder_cpu_s = 0;
  ASSERT_TRUE(test::eventually(bus_,
                               is_long()       ? 160s
                               : kHasSanitizer ? 300s
                                               : 90s,
                               [&] {
                                 for (const auto& sample : statuses.take())
                                   if (sample.valid() &&
                                       std::string(sample->node).starts_with("recorder"))
                                     recorder_cpu_s = sample->cpu_s;
                                 return deployed.wait_for_end(0ms).has_value();
                               }));
  ASSERT_EQ(deployed.wait_for_end(0ms), 0) << deployed.said();

  const recording::Recording recording(file);
  const auto in_file = test::counts_by_topic(recording);
  const auto counts = recording.metadata("counts");
  const auto last = test::final_statuses(recording);
  for (const auto& [topic, count] : test::sent_by_topic(last)) {
    EXPECT_EQ(in_file.at(topic), count) << topic;
    EXPECT_EQ(counts.at(topic + " received"), std::to_string(count)) << topic;
    EXPECT_EQ(counts.at(topic + " lost"), "0") << topic;
  }
  // The recording has each captured frame four times, once per camera.
  std::map<std::uint64_t, std::size_t> maps_of_frame;
  std::int64_t first_map_ns = 0, last_map_ns = 0;
  auto cursor = recording.messages();
  std::uint64_t payload_bytes = 0;
  while (const auto message = cursor.next()) {
    payload_bytes += message->cdr.size();
    if (message->channel->topic != bus::topics::ObjectPixelMap::name || message->key_change)
      continue;
    const schema::FieldReader frame(recording.idl(*message->channel), message->channel->type,
                                    "frame");
    last_map_ns = message->source_stamp_ns;
    if (first_map_ns == 0) first_map_ns = last_map_ns;
    ++maps_of_frame[std::get<std::uint64_t>(frame.read(message->cdr).value())];
  }
  for (const auto& [frame, maps] : maps_of_frame) EXPECT_EQ(maps, kCameras) << "frame " << frame;
  ASSERT_FALSE(maps_of_frame.empty());
  if (!kHasSanitizer)
    expect_rates(in_file, maps_of_frame.size(), incomplete_hulls(last.at("rendering")),
                 1e-9 * double(last_map_ns - first_map_ns) + 1 / kFrameRate_Hz);
  const std::uint64_t frames = maps_of_frame.rbegin()->first - maps_of_frame.begin()->first + 1;
  std::uint64_t dropped = 0;
  for (const auto& drop : last.at("capture")["drops"])
    dropped += drop["count"].get<std::uint64_t>();
  EXPECT_EQ(frames, maps_of_frame.size() + dropped);
  const double seconds = 1e-9 * double(recording.end_ns() - recording.start_ns());
  std::cout << maps_of_frame.size() << " frames of " << frames << " in " << seconds << " s, "
            << 1e-6 * double(payload_bytes) / seconds << " MB/s of payload, "
            << 1e-6 * double(std::filesystem::file_size(file)) / seconds
            << " MB/s written, recorder " << recorder_cpu_s << " s CPU\n"
            << deployed.said();
}

}  // namespace
}  // namespace fivepipe::test
