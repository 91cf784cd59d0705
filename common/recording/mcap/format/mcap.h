// Content of an MCAP file (https://mcap.dev/spec) as plain data. This library knows neither DDS nor
// fivepipe's messages.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace fivepipe::mcap {

using Id = std::uint16_t;

struct Schema {
  std::string name, encoding;  // "fivepipe::v1::HullTile", "omgidl"
  std::string text;
  bool operator==(const Schema&) const = default;
};
struct Channel {
  Id schema = 0;
  std::string topic, message_encoding;  // "cdr"
  std::map<std::string, std::string> metadata;
  bool operator==(const Channel&) const = default;
};
struct Message {
  Id channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_stamp_ns = 0;      // when it was recorded; the messages' order in the file
  std::uint64_t publish_stamp_ns = 0;  // when its source wrote it
  std::span<const std::byte> payload;  // lifetime: see the function that returns the message
};
struct Attachment {
  std::uint64_t log_stamp_ns = 0, create_stamp_ns = 0;
  std::string name, media_type;
  std::string content;
};
struct Metadata {
  std::string name;
  std::map<std::string, std::string> values;
};

enum class Compression { none, lz4, zstd };

// The file is not an MCAP file, ends early or is damaged. The text names the file and the byte.
struct McapError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace fivepipe::mcap
