// Where the messages of a topic come from, for who looks at one: a recording, or the bus.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/bus/serialized.h"
#include "common/recording/files/recording.h"
#include "launch/inspect/topic_resolver.h"

namespace fivepipe::launch {

// Says on stderr where it was not finished. Throws as Recording does.
recording::Recording opened(const std::filesystem::path& file);
std::vector<std::string> topics_in(const recording::Recording& recording);
// The one whose keys a channel of key states tells of, or itself. Throws recording::RecordingError
// where there is none.
const recording::RecordedChannel& data_channel(const recording::Recording& recording,
                                               const recording::RecordedChannel& channel);

// Messages and key changes of the topic from start_s to end_s after the recording's start, until
// `each` says no. Damaged chunks are told on stderr and passed over; the exit code: 0, or 1 where
// there were some.
int each_message(const recording::Recording& recording, const std::string& topic, double start_s,
                 std::optional<double> end_s,
                 const std::function<bool(const recording::RecordedMessage&)>& each);

// Of those that this build can read from the bus. Throws UsageError as resolve_topic().
bus::topics::Topic live_topic(const std::string& asked);
std::optional<recording::KeyChange> key_change_of(bus::SampleKind kind);

// What a live topic's writers call themselves.
class WriterNames {
 public:
  // Both must outlive it.
  WriterNames(bus::Bus& bus, const bus::SerializedReader& reader) : bus_(bus), reader_(reader) {}
  const std::string& of(
      std::uint64_t writer);  // its node; the start of its participant's GUID where it has no name

 private:
  bus::Bus& bus_;
  const bus::SerializedReader& reader_;
  std::map<std::uint64_t, std::string> known_;
};

}  // namespace fivepipe::launch
