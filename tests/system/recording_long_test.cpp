// A minute of four cameras' maps and colours at 60 Hz, recorded while the pipeline runs: nothing is
// lost.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/recording/schema/cdr.h"
#include "tests/support/recording/recordings.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using recording::Recording;

constexpr std::size_t kCameras = 4;

class LongRecording : public test::RecordingTest {};

TEST_F(LongRecording, AMinuteOfFourCamerasAtSixtyHertzLosesNothing) {
  const std::string duration_s = std::getenv("FIVEPIPE_LONG") ? "60" : "5";
  const std::filesystem::path file = folder_ / "long.mcap";
  auto statuses = bus_.reader<bus::topics::NodeStatus>();
  test::Deployed deployed(FIVEPIPE_SOURCE_DIR "/tests/system/long_deployment.yaml", domain_,
                          folder_ / "up", {"--duration", duration_s, "--record", file.string()});
  double recorder_cpu_s = 0;
  ASSERT_TRUE(test::eventually(bus_, 160s, [&] {
    for (const auto& sample : statuses.take())
      if (sample.valid() && std::string(sample->node).starts_with("recorder"))
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
  auto cursor = recording.messages();
  std::uint64_t payload_bytes = 0;
  while (const auto message = cursor.next()) {
    payload_bytes += message->cdr.size();
    if (message->channel->topic != bus::topics::ObjectPixelMap::name || message->key_change)
      continue;
    const schema::FieldReader frame(recording.idl(*message->channel), message->channel->type,
                                    "frame");
    ++maps_of_frame[std::get<std::uint64_t>(frame.read(message->cdr).value())];
  }
  for (const auto& [frame, maps] : maps_of_frame) EXPECT_EQ(maps, kCameras) << "frame " << frame;
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
