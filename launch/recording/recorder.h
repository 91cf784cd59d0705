// Takes messages from the bus into a recording.
#pragma once
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/bus/serialized.h"
#include "common/recording/recording_writer.h"
#include "common/scene/deployment.h"

namespace fivepipe {

// Versions, deployment with its files, and settings, in front of all messages. `deployment` may be null: then there are no files.
void write_header(recording::RecordingWriter& recording, const Deployment* deployment, const std::map<std::string, std::string>& settings, std::uint32_t domain);

// Of a node that was heard from its start: how many messages it sent of a topic, by its own count, and how many of these came here.
struct Shortfall {
  std::string node, topic;
  std::uint64_t sent = 0, received = 0;
};

class Recorder {
 public:
  Recorder(Bus& bus, recording::RecordingWriter& recording, const std::vector<topics::Topic>& topics);

  // Everything that has arrived, into the recording; to be called often. What this process itself publishes is left out.
  void take();
  // Nodes that sent more than came. To be asked after the last take(): a node's count is as old as its last status.
  std::vector<Shortfall> shortfalls() const;

 private:
  struct Source {
    SerializedReader reader;
    topics::Topic topic;
    std::map<std::uint64_t, std::optional<mcap::Id>> channel_of_writer;  // none: our own
    std::map<mcap::Id, std::string> node_of_channel;
  };
  std::optional<mcap::Id> channel(Source& source, std::uint64_t writer);
  void take_statuses();
  bool writes_statuses(const std::string& node) const;

  Bus& bus_;
  recording::RecordingWriter& recording_;
  std::vector<std::unique_ptr<Source>> sources_;
  Reader<topics::NodeStatus> statuses_;
  struct SentBy {
    bool from_the_start = false;  // its first status said that nothing had been sent yet
    std::map<std::string, std::uint64_t> sent;  // by topic
  };
  std::map<std::uint64_t, std::pair<std::string, SentBy>> processes_;          // by writer: node and what it sent
  std::map<std::string, std::map<std::string, std::uint64_t>> received_;       // by node and topic
};

}  // namespace fivepipe
