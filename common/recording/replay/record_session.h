// Records topics of a domain until a time limit, a signal or a failure of the disk.
#pragma once
#include <chrono>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/bus/profile.h"
#include "common/pipeline/bus/topics.h"
#include "common/recording/files/recording_writer.h"
#include "common/recording/replay/loss_detector.h"

namespace fivepipe::replay {

// Returns the topics of this build whose name matches the regular expression. ReplaySession and
// HostStatus, which describe the replay and the hosts of the present, are included only if the
// expression names them.
// `with_images`: include ObjectColour and HullTile, which show people.
std::vector<bus::topics::Topic> topics_to_record(const std::string& expression, bool with_images);

struct RecordRequest {
  std::filesystem::path file;
  std::vector<bus::topics::Topic> topics;
  recording::WriterOptions writer;
  const config::Deployment* deployment = nullptr;  // attached to the recording; may be null
  std::map<std::string, std::string> settings;     // of the deployment
  std::uint32_t domain = 0;
  bus::Network network = {};
  std::string name;       // of the recorder on the bus
  double duration_s = 0;  // 0: no limit
};

// Times from the first signal. After kWriteTime the recorder drops the messages that are not on the
// disk. After kIndexTime it stops writing the index. Both are shorter than kRecorderGrace, for
// which `fivepipe up` waits.
inline constexpr std::chrono::milliseconds kWriteTime{1000}, kIndexTime{1300};

struct RecordResult {
  std::map<std::string, recording::TopicCounts> counts;  // by topic
  std::uint64_t bytes_written = 0;
  double elapsed_s = 0;
  std::string loss_reason, failure;        // as RecordingWriter's
  bool finished = false, synced = false;   // as RecordingWriter's
  std::vector<SentByNode> sent;            // send counts of nodes with what was received of them
  std::string why_not_admitted;            // Bus::why_not_admitted() if no message arrived
  std::set<std::string> unverified_nodes;  // without recent send counts; "": nodes without a name
  // Returns whether the file has every message that nodes sent, and at least one.
  bool complete() const;
};

// Publishes its counts as a NodeStatus and logs them every 5 s. `signals_received` returns the
// number of termination signals: the first one ends the recording. Then the disk has kWriteTime to
// take the messages in memory, and kIndexTime to take the index too; the recorder drops and counts
// the messages that it has not taken. Another signal ends both times. Throws std::system_error if
// the file cannot be created, ConfigError or std::runtime_error if a file of the deployment cannot
// be read.
RecordResult record(const RecordRequest& request, const std::function<int()>& signals_received);

}  // namespace fivepipe::replay
