// Content and condition of a recording, as text and as JSON. Independent of DDS.
#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/realtime.h"
#include "common/recording/files/recording.h"
#include "common/recording/mcap/recover.h"

namespace fivepipe::launch {

struct TopicInfo {
  std::string topic, type;
  std::uint64_t messages = 0, key_changes = 0;  // from the file's statistics
  double rate_hz = 0;  // messages over the recording's duration; 0 if that is 0
  // Known only if all messages were read: payload, and gaps in the sequence numbers.
  std::uint64_t bytes = 0;
  std::uint64_t missing = 0;
  std::set<std::string> writers;  // node names; the writer's GUID if the node is unknown
};

// Counts of messages and key changes that the recorder stored.
struct RecorderCounts {
  std::uint64_t received = 0, written = 0, lost = 0;
  // According to the writers' send counts; missing: sent, but never received.
  std::uint64_t sent = 0, missing = 0;
};

struct RecordingInfo {
  std::string file;
  std::uint64_t file_bytes = 0;
  bool being_written = false;             // a process has the file open for writing
  mcap::Damage damage;                    // damage.summary is empty if the file is finished
  std::vector<std::string> unreadable;    // indexed records that cannot be read: where, and why
  bool read_all = false;                  // every message was read, and every CRC checked
  std::int64_t start_ns = 0, end_ns = 0;  // log stamps, CLOCK_REALTIME; 0 without messages
  std::uint64_t messages = 0;             // including key changes
  std::map<std::string, std::uint64_t> chunks;  // by compression; "": uncompressed
  std::uint64_t compressed_bytes = 0, uncompressed_bytes = 0;
  std::vector<TopicInfo> topics;  // by name
  std::vector<mcap::AttachmentIndex> attachments;
  // header: version, commit, machine, deployment; settings: of the deployment.
  std::map<std::string, std::string> header, settings;
  // By topic; nullopt if the recorder did not write them.
  std::optional<std::map<std::string, RecorderCounts>> counts;
  // If the recorder did not end, or its final counts are damaged: CLOCK_REALTIME at which it wrote
  // `counts`. Otherwise they are final.
  std::optional<std::int64_t> counts_stamp_ns;
  bool final_counts_damaged = false;
  std::string loss_reason;  // why received messages were lost; empty if none were, or unknown
  std::vector<std::string> type_differences;  // from the types of this build

  bool finished() const { return damage.summary.empty(); }
  bool intact() const { return finished() && damage.damage_reports.empty() && unreadable.empty(); }
  double duration_s() const { return base::difference_s(end_ns, start_ns); }
};

// Reads the index. If `reads_all`, also reads every message, to determine bytes by topic and damage
// in a finished file.
RecordingInfo inspect(const recording::Recording& recording, bool reads_all);

// Formats the information for a terminal with 120 columns.
std::string text_of(const RecordingInfo& info);
nlohmann::ordered_json json_of(const RecordingInfo& info);

// What the repair saved and what is lost. Empty if the file was finished.
std::string text_of(const mcap::Recovery& recovery, const std::string& file);
nlohmann::ordered_json json_of(const mcap::Recovery& recovery);

}  // namespace fivepipe::launch
