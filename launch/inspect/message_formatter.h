// Formats messages as YAML or as lines of JSON. Independent of DDS.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "common/recording/files/recording_writer.h"
#include "common/recording/schema/cdr.h"

namespace fivepipe::launch {

// Path of a field, for example "eye_from_world.translation_m.x" or "objects[2].object".
class FieldPath {
 public:
  // Throws UsageError if the text is not a path.
  explicit FieldPath(const std::string& text);
  bool has_index() const;
  // Returns the field, or null if an index exceeds the sequence. Throws UsageError, which lists the
  // existing fields, if there is no such field.
  nlohmann::ordered_json of(const nlohmann::ordered_json& message) const;

 private:
  std::string text_;
  std::vector<std::variant<std::string, std::size_t>> steps_;
};

struct TextOptions {
  bool json = false;
  bool full = false;  // all values of long sequences of numbers
  bool hex = false;   // floating-point numbers in hexadecimal
  bool bare = false;  // values only: no writers, no times, no key changes
  std::optional<FieldPath> field = std::nullopt;  // show only this field
};

struct ShownMessage {
  std::string topic, writer;
  std::int64_t source_stamp_ns = 0, log_stamp_ns = 0;  // log: when the message was received
  std::optional<recording::KeyChange> key_change;      // if set, `cdr` holds the key only
  std::span<const std::byte> cdr;
};

// Formats the messages of one type.
class MessageFormatter {
 public:
  // Throws schema::IdlError if `idl` does not contain the type.
  MessageFormatter(const schema::Idl& idl, const std::string& type, const TextOptions& options);

  // Returns a YAML document whose first line states source time, writer and latency, or one line of
  // JSON. If the payload cannot be decoded, the text states the reason. Throws UsageError as
  // FieldPath::of() does. Returns an empty text for a key change if the options say `bare`.
  std::string operator()(const ShownMessage& message) const;

 private:
  nlohmann::ordered_json decoded(const schema::Idl& idl, std::span<const std::byte> cdr) const;

  std::string json_line(const ShownMessage& message, const nlohmann::ordered_json& value,
                        const std::string& error) const;
  std::string yaml_document(const ShownMessage& message, const nlohmann::ordered_json& value,
                            const std::string& error) const;

  schema::Idl idl_, key_idl_;  // key_idl_: the type has its key fields only
  std::string type_;
  TextOptions options_;
};

}  // namespace fivepipe::launch
