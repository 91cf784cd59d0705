// Reads the messages of a topic from a recording or from the bus.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/containers/bounded_map.h"
#include "common/pipeline/bus/serialized.h"
#include "common/recording/files/recording.h"
#include "launch/inspect/topic_resolver.h"

namespace fivepipe::launch {

// Reports on stderr if the recording is not finished. Throws as Recording does.
recording::Recording opened(const std::filesystem::path& file);
// Names of the topics, sorted.
std::vector<std::string> topics_in(const recording::Recording& recording);
// Returns the channel whose keys the given channel of key states describes, or the channel itself
// if it holds messages. Throws recording::RecordingError if there is none.
const recording::RecordedChannel& data_channel(const recording::Recording& recording,
                                               const recording::RecordedChannel& channel);

// Calls `each` for messages and key changes of the topic from start_s to end_s after the
// recording's start, until it returns false. Reports damaged chunks on stderr and skips them.
// Returns the exit code: 1 if there were any, else 0.
int each_message(const recording::Recording& recording, const std::string& topic, double start_s,
                 std::optional<double> end_s,
                 const std::function<bool(const recording::RecordedMessage&)>& each);

// Resolves a topic of this build. Throws UsageError as resolve_topic() does.
bus::topics::Topic live_topic(const std::string& text);
// Returns nullopt for a sample with data.
std::optional<recording::KeyChange> key_change_of(bus::SampleKind kind);

// Names of a live topic's writers.
class WriterNames {
 public:
  // Both arguments must outlive this object.
  WriterNames(bus::Bus& bus, const bus::SerializedReader& reader) : bus_(bus), reader_(reader) {}
  // Returns the writer's node; if it has no name, the first digits of its participant's GUID. The
  // reference is valid until the next call.
  const std::string& of(std::uint64_t writer);

 private:
  static constexpr std::size_t kMaxWriters = 4096;  // the oldest are forgotten

  bus::Bus& bus_;
  const bus::SerializedReader& reader_;
  base::BoundedMap<std::uint64_t, std::string> known_{kMaxWriters};
};

}  // namespace fivepipe::launch
