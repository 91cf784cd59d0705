#include "launch/inspect/message_formatter.h"

#include <algorithm>
#include <charconv>

#include "common/base/text_table.h"
#include "common/base/timestamp_text.h"
#include "common/base/usage_error.h"
#include "common/recording/schema/yaml_text.h"

namespace fivepipe::launch {
namespace {

using Json = nlohmann::ordered_json;

// Longer sequences of numbers are abbreviated: a pose and a pinhole fit, a map does not.
constexpr std::size_t kMaxNumericElements = 16;

// Reduces the type to its key fields: a serialised key has the layout of a struct of these.
schema::Idl with_keys_only(schema::Idl idl, const std::string& type) {
  for (schema::Struct& definition : idl.structs)
    if (definition.name == type)
      std::erase_if(definition.members,
                    [](const schema::Member& member) { return !member.is_key; });
  return idl;
}

// Cyclone DDS returns keys as CDR 2 (DDS-XTypes 7.4.2), which has the layout of CDR 1 for values of
// up to 4 bytes, enums and strings. Other keys keep their header, and the decoder rejects them.
std::vector<std::byte> as_cdr1(std::span<const std::byte> key, const schema::Struct& type) {
  constexpr std::byte big_endian_2{6}, little_endian_2{7};
  std::vector<std::byte> bytes(key.begin(), key.end());
  const bool same_layout =
      std::all_of(type.members.begin(), type.members.end(), [](const schema::Member& member) {
        const schema::Kind kind = member.type.kind;
        return kind == schema::Kind::string || kind == schema::Kind::enumeration ||
               (schema::is_primitive(kind) && schema::size_bytes(kind) <= 4);
      });
  if (!same_layout || bytes.size() < 2) return bytes;
  if (bytes[1] == big_endian_2) bytes[1] = std::byte{0};
  if (bytes[1] == little_endian_2) bytes[1] = std::byte{1};
  return bytes;
}

const char* name_of(recording::KeyChange change) {
  return change == recording::KeyChange::disposed ? "disposed" : "unregistered";
}

std::string keys_of(const Json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  return base::joined(keys, ", ");
}

// Appends a comment to the document's first line, which begins with "---".
std::string with_comment(const Json& value, const std::string& comment) {
  if (!value.is_structured() || value.empty()) {
    std::string text = schema::to_yaml(value);
    text[3] = ' ';
    return text.insert(text.size() - 1, "  # " + comment);
  }
  return schema::to_yaml(value).insert(3, "  # " + comment);
}

}  // namespace

FieldPath::FieldPath(const std::string& text) : text_(text) {
  std::size_t at = 0;
  const auto is_name = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
  while (at < text.size()) {
    if (text[at] == '[' && !steps_.empty()) {
      std::size_t index = 0;
      const auto [end, error] =
          std::from_chars(text.data() + at + 1, text.data() + text.size(), index);
      if (error != std::errc() || end == text.data() + text.size() || *end != ']') break;
      steps_.emplace_back(index);
      at = std::size_t(end - text.data()) + 1;
      continue;
    }
    if (!steps_.empty() && text[at++] != '.') break;
    const std::size_t start = at;
    while (at < text.size() && is_name(static_cast<unsigned char>(text[at]))) ++at;
    if (at == start) break;
    steps_.emplace_back(text.substr(start, at - start));
    if (at == text.size()) return;
  }
  if (at != text.size() || steps_.empty() || text.back() != ']')
    throw base::UsageError(
        "'" + text + "' is no field; expected as in frame, region.u0_px or objects[0].object");
}

bool FieldPath::has_index() const {
  return std::any_of(steps_.begin(), steps_.end(),
                     [](const auto& step) { return std::holds_alternative<std::size_t>(step); });
}

Json FieldPath::of(const Json& message) const {
  const Json* value = &message;
  for (const auto& step : steps_) {
    if (const auto* index = std::get_if<std::size_t>(&step)) {
      if (!value->is_array())
        throw base::UsageError("--field " + text_ + ": [" + std::to_string(*index) +
                               "] is asked of what is no sequence");
      if (*index >= value->size()) return nullptr;
      value = &(*value)[*index];
      continue;
    }
    const auto& name = std::get<std::string>(step);
    if (!value->is_object())
      throw base::UsageError("--field " + text_ + ": " + name + " is asked of what has no fields" +
                             (value->is_array() ? "; of a sequence say [0], [1] .." : ""));
    const auto found = value->find(name);
    if (found == value->end())
      throw base::UsageError("--field " + text_ + ": there is no " + name +
                             "; there are: " + keys_of(*value));
    value = &*found;
  }
  return *value;
}

MessageFormatter::MessageFormatter(const schema::Idl& idl, const std::string& type,
                                   const TextOptions& options)
    : idl_(idl), key_idl_(with_keys_only(idl, type)), type_(type), options_(options) {
  idl_.at(type);
}

Json MessageFormatter::decoded(const schema::Idl& idl, std::span<const std::byte> cdr) const {
  schema::DecodeOptions how;
  if (!options_.full && !(options_.field && options_.field->has_index()))
    how.max_numeric_elements = kMaxNumericElements;
  how.non_finite_as_text = options_.json;
  return schema::decode(idl, type_, cdr, how);
}

std::string MessageFormatter::operator()(const ShownMessage& message) const {
  Json value;
  std::string name = options_.field ? "value" : "message", error;
  try {
    if (message.key_change) {
      name = "key";
      value = decoded(key_idl_, as_cdr1(message.cdr, key_idl_.at(type_)));
    } else {
      value = decoded(idl_, message.cdr);
      if (options_.field) value = options_.field->of(value);
    }
  } catch (const schema::CdrError& cdr_error) {
    error = cdr_error.what();
  }
  if (options_.json) {
    Json line{{"topic", message.topic},
              {"writer", message.writer},
              {"source_stamp_ns", message.source_stamp_ns},
              {"log_stamp_ns", message.log_stamp_ns}};
    if (message.key_change) line["key_change"] = name_of(*message.key_change);
    line[error.empty() ? name : "error"] = error.empty() ? value : Json(error);
    return line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  }
  std::string comment =
      base::local_time_of_day(message.source_stamp_ns) + " " +
      (message.writer.empty() ? "(unknown writer)" : base::printable(message.writer));
  if (message.key_change)
    return with_comment({{"key_change", name_of(*message.key_change)},
                         {"key", error.empty() ? value : Json(error)}},
                        comment);
  comment += ", latency " +
             base::with_decimals(1e-6 * double(message.log_stamp_ns - message.source_stamp_ns), 2) +
             " ms";
  if (!error.empty())
    return with_comment({{"not_decoded", error}, {"bytes", message.cdr.size()}}, comment);
  return with_comment(value, comment);
}

}  // namespace fivepipe::launch
