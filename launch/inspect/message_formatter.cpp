#include "launch/inspect/message_formatter.h"

#include <algorithm>
#include <charconv>

#include "common/base/realtime.h"
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
  constexpr std::byte kCdr2BigEndian{6}, kCdr2LittleEndian{7};
  std::vector<std::byte> bytes(key.begin(), key.end());
  const bool same_layout =
      std::all_of(type.members.begin(), type.members.end(), [](const schema::Member& member) {
        const schema::Kind kind = member.type.kind;
        return kind == schema::Kind::string || kind == schema::Kind::enumeration ||
               (schema::is_primitive(kind) && schema::size_bytes(kind) <= 4);
      });
  if (!same_layout || bytes.size() < 2) return bytes;
  if (bytes[1] == kCdr2BigEndian) bytes[1] = std::byte{0};
  if (bytes[1] == kCdr2LittleEndian) bytes[1] = std::byte{1};
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

// Appends a comment, unless it is empty, to the document's first line, which begins with "---".
std::string with_comment(const Json& value, const std::string& comment) {
  const std::string suffix = comment.empty() ? "" : "  # " + comment;
  std::string text = schema::to_yaml(value);
  if (value.is_structured() && !value.empty()) return text.insert(3, suffix);
  text[3] = ' ';  // a scalar follows on the same line
  return text.insert(text.size() - 1, suffix);
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
        "'" + text + "' is not a field path; examples: frame, region.u0_px, objects[0].object");
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
                               "] needs a sequence before it");
      if (*index >= value->size()) return nullptr;
      value = &(*value)[*index];
      continue;
    }
    const auto& name = std::get<std::string>(step);
    if (!value->is_object())
      throw base::UsageError(
          "--field " + text_ + ": " + name + " needs a value with fields before it" +
          (value->is_array() ? "; use [0], [1] .. for the elements of a sequence" : ""));
    const auto found = value->find(name);
    if (found == value->end())
      throw base::UsageError("--field " + text_ + ": no field " + name +
                             "; the fields are: " + keys_of(*value));
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
  schema::DecodeOptions decode;
  if (!options_.full && !(options_.field && options_.field->has_index()))
    decode.max_numeric_elements = kMaxNumericElements;
  if (options_.json) decode.floats = schema::FloatFormat::finite_number;
  if (options_.hex) decode.floats = schema::FloatFormat::hexadecimal;
  return schema::decode(idl, type_, cdr, decode);
}

std::string MessageFormatter::operator()(const ShownMessage& message) const {
  if (options_.bare && message.key_change) return "";
  Json value;
  std::string error;
  try {
    if (message.key_change) {
      value = decoded(key_idl_, as_cdr1(message.cdr, key_idl_.at(type_)));
    } else {
      value = decoded(idl_, message.cdr);
      if (options_.field) value = options_.field->of(value);
    }
  } catch (const schema::CdrError& cdr_error) {
    error = cdr_error.what();
  }
  return options_.json ? json_line(message, value, error) : yaml_document(message, value, error);
}

std::string MessageFormatter::json_line(const ShownMessage& message, const Json& value,
                                        const std::string& error) const {
  Json line = Json::object();
  if (!options_.bare)
    line = {{"topic", message.topic},
            {"writer", message.writer},
            {"source_stamp_ns", message.source_stamp_ns},
            {"log_stamp_ns", message.log_stamp_ns}};
  if (message.key_change) line["key_change"] = name_of(*message.key_change);
  const char* name = message.key_change ? "key" : options_.field ? "value" : "message";
  if (!error.empty())
    line["error"] = error;
  else
    line[name] = value;
  return (options_.bare && error.empty() ? value : line)
             .dump(-1, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

std::string MessageFormatter::yaml_document(const ShownMessage& message, const Json& value,
                                            const std::string& error) const {
  std::string comment =
      base::local_time_of_day(message.source_stamp_ns) + " " +
      (message.writer.empty() ? "(unknown writer)" : base::printable(message.writer));
  if (message.key_change)
    return with_comment({{"key_change", name_of(*message.key_change)},
                         {"key", error.empty() ? value : Json(error)}},
                        comment);
  comment +=
      ", latency " +
      base::with_decimals(
          1e-6 * double(base::difference_ns(message.log_stamp_ns, message.source_stamp_ns)), 2) +
      " ms";
  const Json shown =
      error.empty() ? value : Json{{"not_decoded", error}, {"bytes", message.cdr.size()}};
  return with_comment(shown, options_.bare ? "" : comment);
}

}  // namespace fivepipe::launch
