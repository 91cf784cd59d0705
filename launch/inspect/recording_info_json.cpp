#include <nlohmann/json.hpp>

#include "launch/inspect/recording_info.h"

namespace fivepipe::launch {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const TopicInfo& topic, bool read_all) {
  Json json{{"topic", topic.topic},
            {"type", topic.type},
            {"messages", topic.messages},
            {"key_changes", topic.key_changes},
            {"rate_hz", topic.rate_hz}};
  if (read_all) json.update({{"bytes", topic.bytes}, {"missing_sequence_numbers", topic.missing}});
  json["writers"] = topic.writers;
  return json;
}

Json json_of(const mcap::Damage& damage) {
  return {{"summary", damage.summary},
          {"intact_bytes", damage.intact_bytes},
          {"truncated_bytes", damage.truncated_bytes},
          {"damaged_records", damage.damaged_records},
          {"damage_reports", damage.damage_reports},
          {"orphaned_messages", damage.orphaned_messages}};
}

}  // namespace

Json json_of(const RecordingInfo& info) {
  Json json{{"file", info.file},
            {"file_bytes", info.file_bytes},
            {"finished", info.finished()},
            {"being_written", info.being_written},
            {"intact", info.intact()}};
  if (!info.finished()) json["damage"] = json_of(info.damage);
  json["unreadable"] = info.unreadable;
  json.update({{"start_ns", info.start_ns},
               {"end_ns", info.end_ns},
               {"duration_s", info.duration_s()},
               {"messages", info.messages}});
  json["chunks"] = info.chunks;
  json.update({{"compressed_bytes", info.compressed_bytes},
               {"uncompressed_bytes", info.uncompressed_bytes}});
  json["topics"] = Json::array();
  for (const TopicInfo& topic : info.topics)
    json["topics"].push_back(json_of(topic, info.read_all));
  json["counts"] = nullptr;
  if (info.counts)
    for (const auto& [topic, count] : *info.counts) {
      json["counts"][topic] = {
          {"received", count.received}, {"written", count.written}, {"lost", count.lost}};
      if (count.sent > 0)
        json["counts"][topic].update({{"sent", count.sent}, {"missing", count.missing}});
    }
  json["counts_stamp_ns"] = nullptr;
  if (info.counts_stamp_ns) json["counts_stamp_ns"] = *info.counts_stamp_ns;
  if (!info.loss_reason.empty()) json["loss_reason"] = info.loss_reason;
  json["type_differences"] = info.type_differences;
  json["recording"] = info.header;
  json["settings"] = info.settings;
  json["attachments"] = Json::array();
  for (const mcap::AttachmentIndex& attachment : info.attachments)
    json["attachments"].push_back({{"name", attachment.name},
                                   {"bytes", attachment.content_bytes},
                                   {"media_type", attachment.media_type}});
  return json;
}

Json json_of(const mcap::Recovery& recovery) {
  return {{"was_finished", recovery.was_finished},
          {"messages", recovery.statistics.messages},
          {"chunks", recovery.statistics.chunks},
          {"damage", json_of(recovery.damage)}};
}

}  // namespace fivepipe::launch
