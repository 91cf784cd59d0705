// Takes messages from the bus into a recording.
#pragma once
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/bus/serialized.h"
#include "common/recording/files/recording_writer.h"
#include "common/recording/replay/loss_detector.h"

namespace fivepipe::replay {

// What `fivepipe record` calls itself on the bus, unless it is told otherwise.
inline constexpr const char* kRecorderName = "recorder";

// Why a recording is not to be written there without --force; empty: nothing is there.
std::string refusal_to_overwrite(const std::filesystem::path& file);

// Versions, deployment with its files, and settings, in front of all messages. `deployment` may be
// null: then there are no files.
void write_header(recording::RecordingWriter& recording, const config::Deployment* deployment,
                  const std::map<std::string, std::string>& settings, std::uint32_t domain);

class Recorder {
 public:
  Recorder(bus::Bus& bus, recording::RecordingWriter& recording,
           const std::vector<bus::topics::Topic>& topics);

  // Everything that has arrived, into the recording; to be called often. What this process itself
  // publishes is left out.
  void take();
  // By node and topic that is recorded: what was sent and what came. To be asked after the last
  // take().
  std::vector<SentByNode> compared() const;
  // Whoever wrote something, but told nothing of what it sent, or nothing of late.
  std::set<std::string> unverified_nodes() const;

 private:
  struct Source {
    bus::SerializedReader reader;
    bus::topics::Topic topic;
    std::map<std::uint64_t, std::optional<mcap::Id>> channel_of_writer;  // none: our own
    std::map<mcap::Id, std::string> node_of_channel;
  };
  std::optional<mcap::Id> channel(Source& source, std::uint64_t writer);
  bool is_own(const bus::WriterDescription& writer) const;
  std::string node_of(const bus::WriterDescription& writer);
  void take_statuses();

  bus::Bus& bus_;
  recording::RecordingWriter& recording_;
  std::vector<std::unique_ptr<Source>> sources_;
  bus::Reader<bus::topics::NodeStatus> statuses_;
  std::map<std::string, std::string>
      node_of_participant_;  // by GUID: a process that is gone has left its name
  LossDetector loss_detector_;
};

}  // namespace fivepipe::replay
