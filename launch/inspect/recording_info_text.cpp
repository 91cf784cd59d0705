#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/text_table.h"
#include "common/base/timestamp_text.h"
#include "launch/inspect/recording_info.h"
#include "launch/inspect/topic_resolver.h"

namespace fivepipe::launch {
namespace {

constexpr std::size_t kLabelWidth = 13, kWritersWidth = 24, kLineWidth = 120;
// Maximum number of items of one kind; the rest is only counted.
constexpr std::size_t kMaxItemsShown = 10;

std::string megabytes(std::uint64_t bytes) {
  return base::with_decimals(1e-6 * double(bytes), bytes < 100'000 ? 3 : 1) + " MB";
}

std::string line(const std::string& label, const std::string& value) {
  return fmt::format("{:<{}}{}\n", label, kLabelWidth, base::printable(value));
}
// Puts the label before the first value.
std::string lines(const std::string& label, const std::vector<std::string>& values) {
  std::string text;
  for (std::size_t i = 0; i < std::min(values.size(), kMaxItemsShown); ++i)
    text += line(i == 0 ? label : "", values[i]);
  if (values.size() > kMaxItemsShown)
    text += line("", "and " + std::to_string(values.size() - kMaxItemsShown) + " more");
  return text;
}

// Joins the values by commas and wraps the lines.
std::string wrapped(const std::string& label, const std::vector<std::string>& values) {
  std::vector<std::string> all{""};
  for (const std::string& value : values) {
    if (kLabelWidth + all.back().size() + 2 + value.size() > kLineWidth) all.emplace_back();
    all.back() += value + (&value == &values.back() ? "" : ", ");
  }
  std::string text;
  for (std::size_t i = 0; i < all.size(); ++i)
    text += line(i == 0 ? label : "", all[i].substr(0, all[i].find_last_not_of(' ') + 1));
  return text;
}

std::string value_or(const std::map<std::string, std::string>& values, const std::string& key,
                     const std::string& default_value) {
  const auto found = values.find(key);
  return found == values.end() || found->second.empty() ? default_value : found->second;
}

std::string condition_text(const RecordingInfo& info) {
  std::string text;
  if (info.finished()) {
    text += line(
        "file",
        megabytes(info.file_bytes) + ", finished" +
            (info.read_all && info.intact() ? "; all messages were read, none is damaged" : ""));
  } else if (info.being_written) {
    text += line("file", megabytes(info.file_bytes) +
                             ", BEING WRITTEN: a process has it open; it contains so far:");
  } else {
    text += line("file", megabytes(info.file_bytes) + ", NOT FINISHED: no index, " +
                             base::counted(info.damage.truncated_bytes, "byte") +
                             " of an incomplete record at its end");
    text += line("", info.damage.summary);
    text +=
        line("", "all messages listed here can be read; repair it by `fivepipe info --recover " +
                     info.file + "`");
  }
  text += lines("DAMAGED", info.damage.damage_reports);
  text += lines("DAMAGED", info.unreadable);
  if (info.damage.orphaned_messages)
    text +=
        line("", base::counted(info.damage.orphaned_messages, "message") + " without a channel");
  if (!info.damage.damage_reports.empty() || !info.unreadable.empty())
    text += line("", "the damaged records are lost; all others can be read and replayed");
  return text;
}

std::string origin_text(const RecordingInfo& info) {
  const auto& header = info.header;
  if (header.empty())
    return line("made by", "unknown: not recorded by fivepipe, or the metadata is missing");
  const auto known = [&](const char* key) { return value_or(header, key, "?"); };
  std::string text =
      line("made by", "fivepipe " + known("version") + " (" + known("commit") + ", " +
                          known("build_type") + "), domain " + known("domain"));
  text += line("on", known("host") + ", " + known("cpu") + ", " + known("cores") + " cores");
  text +=
      line("deployment",
           value_or(header, "deployment",
                    "none: the recording can be replayed, but does not suffice to start nodes"));
  std::vector<std::string> settings;
  for (const auto& [key, value] : info.settings) settings.push_back(key + "=" + value);
  if (!settings.empty()) text += wrapped("settings", settings);
  return text;
}

std::string content_text(const RecordingInfo& info) {
  if (info.messages == 0) return line("messages", "none");
  std::string text = line("start", base::local_date_and_time(info.start_ns) + "   " +
                                       std::to_string(info.start_ns) + " ns");
  text += line("duration", base::with_decimals(info.duration_s(), 3) + " s");
  std::vector<std::string> chunks;
  for (const auto& [compression, count] : info.chunks)
    chunks.push_back(base::counted(count, "chunk") + " (" +
                     (compression.empty() ? "uncompressed" : compression) + ")");
  const double ratio =
      double(info.uncompressed_bytes) / double(std::max<std::uint64_t>(info.compressed_bytes, 1));
  const std::string sizes = megabytes(info.uncompressed_bytes) + " compressed to " +
                            megabytes(info.compressed_bytes) + " (" +
                            base::with_decimals(ratio, 2) + " : 1)";
  return text + line("messages", std::to_string(info.messages) + " in " +
                                     base::joined(chunks, ", ") + ", " + sizes);
}

// Messages missing according to gaps in the sequence numbers: those that the recorder lost, and
// those in damaged chunks.
std::string missing_text(const RecordingInfo& info, std::uint64_t missing) {
  std::vector<std::string> by_topic;
  for (const TopicInfo& topic : info.topics)
    if (topic.missing)
      by_topic.push_back(base_name(topic.topic) + " " + std::to_string(topic.missing));
  return line("LOST", base::counted(missing, "message") +
                          " missing, according to gaps in the sequence numbers:") +
         wrapped("", by_topic);
}

// Lists one of the recorder's counts by topic: "HullTile 3, .."
std::string by_topic_text(const RecordingInfo& info, std::uint64_t RecorderCounts::*counted) {
  std::vector<std::string> by_topic;
  for (const auto& [topic, count] : *info.counts)
    if (count.*counted) by_topic.push_back(base_name(topic) + " " + std::to_string(count.*counted));
  return wrapped("", by_topic);
}

// A recording without final counts. If it was cut off, messages that the recorder had received were
// in its memory. `gaps`: in the sequence numbers, which also show messages that the recorder lost.
std::string cut_off_text(const RecordingInfo& info, const RecorderCounts& all, std::uint64_t gaps) {
  const std::uint64_t kept = all.received - std::min(all.received, all.lost),
                      not_in_file = kept - std::min(kept, info.messages),
                      not_in_gaps =
                          not_in_file - std::min(not_in_file, gaps - std::min(gaps, all.lost));
  const bool is_damaged = !info.damage.damage_reports.empty() || !info.unreadable.empty();
  std::string text;
  if (gaps > all.lost) text += missing_text(info, gaps);
  if (not_in_gaps > 0)
    text += line("LOST", std::to_string(not_in_gaps) + " of " + std::to_string(all.received) +
                             " received messages are not in the file" +
                             (info.final_counts_damaged ? ""
                              : is_damaged ? ": they waited for the disk or are in damaged chunks"
                                           : ": they waited for the disk"));
  return text + line("losses", (text.empty() && all.lost == 0 ? "none until " : "known until ") +
                                   base::local_date_and_time(*info.counts_stamp_ns) +
                                   "; later ones are unknown, because the " +
                                   (info.final_counts_damaged ? "final counts are damaged"
                                                              : "recorder did not end"));
}

std::string losses_text(const RecordingInfo& info) {
  std::uint64_t gaps = 0;
  for (const TopicInfo& topic : info.topics) gaps += topic.missing;
  if (!info.counts && gaps > 0) return missing_text(info, gaps);
  if (!info.counts)
    return line(
        "losses",
        info.read_all
            ? "none found: sequence numbers have no gaps (the recorder's counts are missing)"
            : "unknown: the recorder's counts are missing");
  RecorderCounts all;
  for (const auto& [topic, count] : *info.counts) {
    all.received += count.received;
    all.lost += count.lost;
    all.sent += count.sent;
    all.missing += count.missing;
  }
  std::string text;
  if (all.missing > 0)
    text += line("LOST", std::to_string(all.missing) + " of " + std::to_string(all.sent) +
                             " messages that nodes sent never reached the recorder") +
            by_topic_text(info, &RecorderCounts::missing);
  if (all.lost > 0)
    text +=
        line("LOST", std::to_string(all.lost) + " of " + std::to_string(all.received) +
                         " received messages were dropped: " +
                         (info.loss_reason.empty() ? "the disk was too slow" : info.loss_reason)) +
        by_topic_text(info, &RecorderCounts::lost);
  if (info.counts_stamp_ns) return text + cut_off_text(info, all, gaps);
  if (gaps > all.lost) text += missing_text(info, gaps);
  return text.empty()
             ? line("losses", "none: " + std::to_string(all.received) + " received, all written")
             : text;
}

std::string types_text(const RecordingInfo& info) {
  if (info.topics.empty()) return "";
  if (info.type_differences.empty()) return line("types", "those of this build");
  return lines("types DIFFER", info.type_differences) +
         line("", "this build can show these topics (`fivepipe echo`), but not replay them");
}

std::string topics_text(const RecordingInfo& info) {
  if (info.topics.empty()) return "";
  base::TextTable table({{"topic"},
                         {"type"},
                         {"messages", true},
                         {"Hz", true},
                         {"MB", true},
                         {"writers", false, kWritersWidth}});
  std::vector<std::string> key_changes;
  for (const TopicInfo& topic : info.topics) {
    table.add({topic.topic, topic.type, std::to_string(topic.messages),
               info.duration_s() > 0 ? base::with_decimals(topic.rate_hz, 2) : "-",
               info.read_all ? base::with_decimals(1e-6 * double(topic.bytes), 3) : "-",
               base::joined({topic.writers.begin(), topic.writers.end()}, ", ")});
    if (topic.key_changes)
      key_changes.push_back(base_name(topic.topic) + " " + std::to_string(topic.key_changes));
  }
  return "\n" + table.text() +
         (key_changes.empty() ? "" : "\n" + wrapped("key changes", key_changes));
}

std::string attachments_text(const RecordingInfo& info) {
  if (info.attachments.empty()) return "";
  base::TextTable table({{"attachment"}, {"bytes", true}, {"media type"}});
  for (const mcap::AttachmentIndex& attachment : info.attachments)
    table.add({attachment.name, std::to_string(attachment.content_bytes), attachment.media_type});
  return "\n" + table.text();
}

}  // namespace

std::string text_of(const RecordingInfo& info) {
  return base::printable(info.file) + "\n" + condition_text(info) + content_text(info) +
         losses_text(info) + types_text(info) + origin_text(info) + topics_text(info) +
         attachments_text(info);
}

std::string text_of(const mcap::Recovery& recovery, const std::string& file) {
  if (recovery.was_finished) return "";
  const mcap::Damage& damage = recovery.damage;
  std::string text = base::printable(file) + " was repaired\n";
  text += line("before", damage.summary);
  text += line("saved", base::counted(recovery.statistics.messages, "message") + " in " +
                            base::counted(recovery.statistics.chunks, "chunk") + ", " +
                            base::counted(recovery.statistics.attachments, "attachment"));
  text += line("lost", damage.truncated_bytes == 0 ? "nothing at the end"
                                                   : base::counted(damage.truncated_bytes, "byte") +
                                                         " of an incomplete record at the end");
  text += lines("lost", damage.damage_reports);
  if (damage.orphaned_messages)
    text += line("lost", base::counted(damage.orphaned_messages, "message") + " without a channel");
  return text;
}

}  // namespace fivepipe::launch
