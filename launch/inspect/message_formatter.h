// Messages as text: YAML for people, lines of JSON for programs. Pure.
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

// "eye_from_world.translation_m.x", "objects[2].object"
class FieldPath {
 public:
  // Throws UsageError where it can't be one.
  explicit FieldPath(const std::string& text);
  bool has_index() const;
  // Null where an index is beyond the end. Throws UsageError, with the fields that there are, where
  // there is no such field.
  nlohmann::ordered_json of(const nlohmann::ordered_json& message) const;

 private:
  std::string text_;
  std::vector<std::variant<std::string, std::size_t>> steps_;
};

struct TextOptions {
  bool json = false;
  bool full = false;                              // long sequences of numbers with all their values
  std::optional<FieldPath> field = std::nullopt;  // this one alone
};

struct ShownMessage {
  std::string topic, writer;
  std::int64_t source_stamp_ns = 0,
               log_stamp_ns = 0;  // log: when it was taken, here or by the recorder
  std::optional<recording::KeyChange> key_change;  // `cdr` then holds the key alone
  std::span<const std::byte> cdr;
};

// Of one type.
class MessageFormatter {
 public:
  // Throws schema::IdlError where `idl` has no such type.
  MessageFormatter(const schema::Idl& idl, const std::string& type, const TextOptions& options);

  // A YAML document whose first line states source time, writer and latency, or one line of JSON. A
  // payload that can't be decoded is told as such, with its reason. Throws UsageError as
  // FieldPath::of().
  std::string operator()(const ShownMessage& message) const;

 private:
  nlohmann::ordered_json decoded(const schema::Idl& idl, std::span<const std::byte> cdr) const;

  schema::Idl idl_, key_idl_;  // key_idl_: the same with the type's key fields alone
  std::string type_;
  TextOptions options_;
};

}  // namespace fivepipe::launch
