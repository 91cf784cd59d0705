// What a recording holds, and whether it is whole: for people and for programs. Pure.
#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/recording/files/recording.h"
#include "common/recording/mcap/recover.h"

namespace fivepipe::launch {

struct TopicInfo {
  std::string topic, type;
  std::uint64_t messages = 0, key_changes = 0;  // by the file's statistics
  double rate_hz = 0;         // messages over the recording's duration; 0 where that is 0
  std::uint64_t bytes = 0;    // of the payloads; this and the next only where everything was read
  std::uint64_t missing = 0;  // what the sequence numbers leave out
  std::set<std::string> writers;  // nodes' names, or the writer's GUID where it has none
};

// By the recorder's own count, of messages and key changes.
struct RecorderCounts {
  std::uint64_t received = 0, written = 0, lost = 0;
  std::uint64_t sent = 0,
                missing = 0;  // as far as writers told what they sent; missing: never received
};

struct RecordingInfo {
  std::string file;
  std::uint64_t file_bytes = 0;
  bool being_written = false;  // by a process that has it open now: it may still be finished
  mcap::Damage damage;         // damage.summary is empty where the file is finished
  std::vector<std::string> unreadable;    // of what the index tells of: where, and why
  bool read_all = false;                  // every message was read, so that every CRC was checked
  std::int64_t start_ns = 0, end_ns = 0;  // log stamps, CLOCK_REALTIME; 0 without messages
  std::uint64_t messages = 0;             // with key changes
  std::map<std::string, std::uint64_t> chunks;  // by compression; "": none
  std::uint64_t compressed_bytes = 0, uncompressed_bytes = 0;
  std::vector<TopicInfo> topics;  // by name
  std::vector<mcap::AttachmentIndex> attachments;
  std::map<std::string, std::string> header,
      settings;  // version, commit, deployment, ..; the deployment's settings
  std::optional<std::map<std::string, RecorderCounts>>
      counts;               // by topic; none: the recorder did not get to writing them
  std::string loss_reason;  // of what was received and lost; empty: none was, or it is not known
  std::vector<std::string> type_differences;  // what differs from this build's types

  bool finished() const { return damage.summary.empty(); }
  bool whole() const { return finished() && damage.damage_reports.empty() && unreadable.empty(); }
  double duration_s() const { return 1e-9 * double(end_ns - start_ns); }
};

// reads_all: also every message, for the bytes by topic, and to find what is damaged of a finished
// file.
RecordingInfo inspect(const recording::Recording& recording, bool reads_all);

// For a terminal of 120 columns.
std::string text_of(const RecordingInfo& info);
nlohmann::ordered_json json_of(const RecordingInfo& info);

// What mending it has saved and what is lost. Empty for a file that was finished.
std::string text_of(const mcap::Recovery& recovery, const std::string& file);
nlohmann::ordered_json json_of(const mcap::Recovery& recovery);

}  // namespace fivepipe::launch
