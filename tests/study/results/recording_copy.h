// A copy of a recording with another scene.
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

inline void copy_recording(const std::filesystem::path& from, const std::filesystem::path& to,
                           const ChangeFile& change) {
  const recording::Recording source(from);
  recording::RecordingWriter writer(to, "tests", {.sync = false});
  for (const char* name : {recording::kRecordingMetadata, recording::kSettingsMetadata})
    writer.add(mcap::Metadata{name, source.metadata(name)});
  for (const mcap::AttachmentIndex& index : source.mcap().attachments()) {
    mcap::Attachment attachment = source.mcap().read(index);
    if (change) attachment.content = change(attachment.name, attachment.content);
    writer.attach(attachment);
  }
  std::map<mcap::Id, mcap::Id> copies;
  for (const recording::RecordedChannel& channel : source.channels())
    if (!channel.key_states && source.type_differences({channel.id}).empty())
      copies[channel.id] = writer.add_channel(
          channel.topic, channel.type, schema::fivepipe_schema(channel.type), channel.metadata);
  auto messages = source.messages();
  while (const auto message = messages.next())
    if (!message->key_change && copies.contains(message->channel->id))
      writer.add(copies.at(message->channel->id), message->log_stamp_ns, message->source_stamp_ns,
                 message->cdr);
}

}  // namespace fivepipe::test
