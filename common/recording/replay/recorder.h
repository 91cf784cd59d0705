// Records messages from the bus.
#pragma once
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/bus/serialized.h"
#include "common/recording/files/recording_writer.h"
#include "common/recording/replay/loss_detector.h"

namespace fivepipe::replay {

// Default name of `fivepipe record` on the bus.
inline constexpr const char* kRecorderName = "recorder";

// Why the file must not be overwritten without --force; empty if it does not exist.
std::string refusal_to_overwrite(const std::filesystem::path& file);

// Writes versions, the deployment with its files, and the settings; call it before the first
// message. If `deployment` is null, writes the versions only.
void write_header(recording::RecordingWriter& recording, const config::Deployment* deployment,
                  const std::map<std::string, std::string>& settings, std::uint32_t domain);

class Recorder {
 public:
  // The bus and the recording must outlive this object.
  Recorder(bus::Bus& bus, recording::RecordingWriter& recording,
           const std::vector<bus::topics::Topic>& topics);

  // Moves all received messages into the recording, except those of this process. Call it often:
  // the readers' queues are bounded.
  void take();
  // Sent and received messages by node and recorded topic. Call it after the last take().
  std::vector<SentByNode> compared() const;
  // Nodes whose messages were recorded but whose recent send counts are missing.
  std::set<std::string> unverified_nodes() const;

 private:
  struct Source {
    bus::SerializedReader reader;
    bus::topics::Topic topic;
    // By writer; nullopt for a writer of this process.
    std::map<std::uint64_t, std::optional<mcap::Id>> channel_of_writer;
    std::map<mcap::Id, std::string> node_of_channel;
  };
  // Returns nullopt if the writer is of this process, or if no channel is left for it.
  std::optional<mcap::Id> channel(Source& source, const bus::SerializedSample& sample);
  void drop_without_channel(const std::string& topic, std::size_t bytes);
  bool is_own(const bus::WriterDescription& writer) const;
  std::string node_of(const bus::WriterDescription& writer);
  void take_statuses();
  bool is_recorded(const std::string& topic) const;
  bool is_participant(const std::string& node);

  bus::Bus& bus_;
  recording::RecordingWriter& recording_;
  std::vector<std::unique_ptr<Source>> sources_;
  bus::Reader<bus::topics::NodeStatus> statuses_;
  // By GUID; remembers the names of processes that have ended.
  std::map<std::string, std::string> node_of_participant_;
  // Names: of the participants that discovery found last, and of those that sent a status, which
  // may have ended since.
  std::set<std::string> participants_, reporting_;
  std::optional<std::chrono::steady_clock::time_point> participants_read_;
  LossDetector loss_detector_;
  std::map<std::string, std::size_t> channels_of_participant_;  // by name
  std::string full_reason_;                                     // once no channel is left
};

}  // namespace fivepipe::replay
