#include "common/recording/files/recording.h"

#include <algorithm>
#include <fstream>

#include "common/recording/files/format.h"
#include "common/recording/schema/cdr_cursor.h"
#include "common/recording/schema/wire_types.h"

namespace fivepipe::recording {
namespace {

std::string value_or_empty(const std::map<std::string, std::string>& values,
                           const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? "" : found->second;
}

// Decodes a KeyState payload: sets `key_change` and reduces `cdr` to the key.
void read_key_state(RecordedMessage& message) {
  schema::CdrCursor cursor(message.cdr);
  message.key_change =
      cursor.take<std::uint32_t>() == 0 ? KeyChange::disposed : KeyChange::unregistered;
  message.cdr = cursor.take_bytes(cursor.take_count(0));
}

// True if the path stays inside the folder that it is appended to.
bool is_safe(const std::filesystem::path& relative) {
  if (relative.empty() || relative.is_absolute()) return false;
  for (const auto& part : relative)
    if (part == "..") return false;
  return true;
}

}  // namespace

Recording::Recording(const std::filesystem::path& file)
    : file_(file), reader_(std::make_unique<mcap::Reader>(file)) {
  const auto& counts = reader_->statistics().channel_messages;
  for (const auto& [id, channel] : reader_->channels()) {
    RecordedChannel recorded{id,
                             channel.topic,
                             "",
                             channel.topic.ends_with(kKeyStateSuffix),
                             value_or_empty(channel.metadata, "writer"),
                             value_or_empty(channel.metadata, "node"),
                             channel.metadata,
                             0};
    if (recorded.key_states)
      recorded.topic.resize(recorded.topic.size() - std::string(kKeyStateSuffix).size());
    if (const auto schema = reader_->schemas().find(channel.schema);
        schema != reader_->schemas().end())
      recorded.type = schema->second.name;
    if (const auto count = counts.find(id); count != counts.end())
      recorded.messages = count->second;
    index_of_[id] = channels_.size();
    channels_.push_back(std::move(recorded));
  }
}

const RecordedChannel* Recording::channel(mcap::Id id) const {
  const auto found = index_of_.find(id);
  return found == index_of_.end() ? nullptr : &channels_[found->second];
}

const schema::Idl& Recording::idl(const RecordedChannel& channel) const {
  if (const auto known = idls_.find(channel.id); known != idls_.end()) return known->second;
  const auto& schemas = reader_->schemas();
  const auto schema = schemas.find(reader_->channels().at(channel.id).schema);
  const std::string where = file_.string() + ": topic " + channel.topic + ": ";
  if (schema == schemas.end()) throw RecordingError(where + "the topic has no schema");
  if (schema->second.encoding != kSchemaEncoding)
    throw RecordingError(where + "the schema's encoding is '" + schema->second.encoding +
                         "', not " + kSchemaEncoding);
  try {
    return idls_[channel.id] = schema::parse_idl(schema->second.text);
  } catch (const schema::IdlError& error) {
    throw RecordingError(where + error.what());
  }
}

std::vector<std::string> Recording::type_differences(const std::set<mcap::Id>& channels) const {
  std::map<std::string, std::string> why_of_topic;
  for (const RecordedChannel& channel : channels_) {
    if (!channels.contains(channel.id) || channel.key_states ||
        why_of_topic.contains(channel.topic))
      continue;
    if (!schema::fivepipe_idl().find(channel.type))
      why_of_topic[channel.topic] = "this build does not know its type " + channel.type;
    else if (const std::string differs =
                 schema::difference(idl(channel), schema::fivepipe_idl(), channel.type);
             !differs.empty())
      why_of_topic[channel.topic] =
          "the recorded type " + channel.type + " differs from this build's: " + differs;
  }
  std::vector<std::string> problems;
  for (const auto& [topic, why] : why_of_topic)
    problems.push_back(file_.string() + ": " + topic + ": " + why);
  return problems;
}

std::map<std::string, std::string> Recording::metadata(const std::string& name) const {
  const auto& all = reader_->metadata();
  const auto last = std::find_if(all.rbegin(), all.rend(), [&](const mcap::MetadataIndex& index) {
    return index.name == name;
  });
  return last == all.rend() ? std::map<std::string, std::string>() : reader_->read(*last).values;
}

std::optional<std::filesystem::path> Recording::extract_deployment(
    const std::filesystem::path& folder) const {
  const std::string deployment = value_or_empty(metadata(kRecordingMetadata), kDeploymentFileKey);
  if (deployment.empty()) return std::nullopt;
  for (const mcap::AttachmentIndex& index : reader_->attachments()) {
    if (!index.name.starts_with(kDeploymentFolder)) continue;
    const std::filesystem::path relative = index.name.substr(std::string(kDeploymentFolder).size());
    if (!is_safe(relative))
      throw RecordingError(file_.string() + ": the attachment " + index.name +
                           " would be extracted outside of " + folder.string());
    std::filesystem::create_directories((folder / relative).parent_path());
    std::ofstream out(folder / relative, std::ios::binary);
    out << reader_->read(index).content << std::flush;
    if (!out) throw RecordingError((folder / relative).string() + " cannot be written");
  }
  if (!is_safe(deployment) || !std::filesystem::exists(folder / deployment))
    throw RecordingError(file_.string() + ": the attachments lack its deployment file " +
                         deployment);
  return folder / deployment;
}

std::optional<RecordedMessage> Recording::Cursor::next() {
  while (const auto message = cursor_.next()) {
    const RecordedChannel* channel = recording_->channel(message->channel);
    if (!channel) continue;
    RecordedMessage recorded{channel,
                             message->sequence,
                             std::int64_t(message->log_stamp_ns),
                             std::int64_t(message->publish_stamp_ns),
                             {},
                             message->payload};
    if (channel->key_states) try {
        read_key_state(recorded);
      } catch (const schema::CdrFault&) {
        continue;  // not a payload that fivepipe wrote
      }
    return recorded;
  }
  return std::nullopt;
}

Recording::Cursor Recording::messages(std::int64_t start_ns, std::int64_t end_ns,
                                      const std::set<mcap::Id>& channels) const {
  return {*this, reader_->messages(std::uint64_t(std::max<std::int64_t>(start_ns, 0)),
                                   std::uint64_t(std::max<std::int64_t>(end_ns, 0)), channels)};
}

Recording::Cursor Recording::messages() const { return {*this, reader_->messages()}; }

}  // namespace fivepipe::recording
