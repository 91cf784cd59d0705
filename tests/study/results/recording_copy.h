// A copy of a recording with another scene, or without some of its messages.
#pragma once
#include <functional>
#include <map>
#include <string>

#include "common/recording/files/format.h"
#include "common/recording/files/recording.h"
#include "common/recording/schema/wire_types.h"

namespace fivepipe::test {

// Returns the text of a file of the deployment, by its name in the recording; empty: as it is.
using ChangeFile = std::function<std::string(const std::string& name, const std::string& text)>;

// Returns whether the copy has the message.
using KeepMessage = std::function<bool(const recording::RecordedMessage& message)>;

inline void copy_recording(const std::filesystem::path& from, const std::filesystem::path& to,
                           const ChangeFile& change, const KeepMessage& keep = nullptr) {
  const recording::Recording source(from);
  recording::RecordingWriter writer(to, "tests", {.sync = false});
  for (const char* name : {recording::kRecordingMetadata, recording::kSettingsMetadata})
    writer.add(mcap::Metadata{name, source.metadata(name)});
  for (const mcap::AttachmentIndex& index : source.mcap().attachments()) {
    mcap::Attachment attachment = source.mcap().read(index);
    if (change) attachment.content = change(attachment.name, attachment.content);
    writer.attach(attachment);
  }
  // By channel of the source. Types of another version are not copied.
  std::map<mcap::Id, std::optional<mcap::Id>> copies;
  const auto copy_of = [&](const recording::RecordedChannel& channel) {
    const auto [copy, is_new] = copies.try_emplace(channel.id);
    if (is_new && source.type_differences({channel.id}).empty())
      copy->second = writer.add_channel(channel.topic, channel.type,
                                        schema::fivepipe_schema(channel.type), channel.metadata);
    return copy->second;
  };
  auto messages = source.messages();
  while (const auto message = messages.next()) {
    if (message->key_change || (keep && !keep(*message))) continue;
    if (const auto copy = copy_of(*message->channel))
      writer.add(*copy, message->log_stamp_ns, message->source_stamp_ns, message->cdr);
  }
}

}  // namespace fivepipe::test
