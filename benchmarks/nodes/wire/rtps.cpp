#include "benchmarks/nodes/wire/rtps.h"

#include <algorithm>
#include <cstring>
#include <optional>

namespace fivepipe::wire {
namespace {

constexpr std::size_t kHeaderBytes = 20, kGuidPrefixAt = 8, kGuidPrefixBytes = 12, kEntityBytes = 4;
constexpr std::uint8_t kInfoDestination = 0x0e, kData = 0x15, kDataFrag = 0x16;
constexpr std::uint8_t kLittleEndian = 1, kInlineQos = 2, kPayload = 4;  // flags; payload: DATA
constexpr std::uint16_t kSentinel = 1;                                   // ends the inline QoS

// The bytes of one submessage, in its byte order. Reads nullopt beyond the end.
class Bytes {
 public:
  Bytes(std::span<const std::byte> bytes, bool little_endian)
      : bytes_(bytes), little_endian_(little_endian) {}

  template <class Number>
  std::optional<Number> number(std::size_t at) const {
    if (at > bytes_.size() || bytes_.size() - at < sizeof(Number)) return std::nullopt;
    Number value = 0;
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      const std::size_t from = little_endian_ ? sizeof(Number) - 1 - i : i;
      value = Number(value << 8 | std::to_integer<Number>(bytes_[at + from]));
    }
    return value;
  }
  std::span<const std::byte> from(std::size_t at) const {
    return bytes_.subspan(std::min(at, bytes_.size()));
  }

 private:
  std::span<const std::byte> bytes_;
  bool little_endian_;
};

std::string hex(std::span<const std::byte> bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte b : bytes)
    text += {kDigits[std::to_integer<int>(b) >> 4], kDigits[std::to_integer<int>(b) & 15]};
  return text;
}

// Returns the position behind the parameter list that begins at `at`.
std::optional<std::size_t> end_of_inline_qos(const Bytes& bytes, std::size_t at) {
  for (;;) {
    const auto id = bytes.number<std::uint16_t>(at), length = bytes.number<std::uint16_t>(at + 2);
    if (!id || !length) return std::nullopt;
    at += 4;
    if (*id == kSentinel) return at;
    at += *length;
  }
}

// `contents` follows the 4 bytes of the submessage's header.
std::optional<RtpsData> data_of(std::span<const std::byte> guid_prefix, std::uint8_t id,
                                std::uint8_t flags, std::span<const std::byte> contents) {
  // Layout: extraFlags 0, octetsToInlineQos 2, readerId 4, writerId 8, writerSN 12; DATA_FRAG:
  // fragmentStartingNum 20.
  constexpr std::size_t kWriterAt = 8, kNumberAt = 12, kFragmentAt = 20;
  const Bytes bytes(contents, flags & kLittleEndian);
  const auto to_qos = bytes.number<std::uint16_t>(2);
  const auto high = bytes.number<std::uint32_t>(kNumberAt),
             low = bytes.number<std::uint32_t>(kNumberAt + 4);
  if (!to_qos || !high || !low) return std::nullopt;
  RtpsData data;
  data.writer = hex(guid_prefix) + hex(contents.subspan(kWriterAt, kEntityBytes));
  data.sequence_number = std::uint64_t(*high) << 32 | *low;
  if (id == kDataFrag) {
    const auto fragment = bytes.number<std::uint32_t>(kFragmentAt);
    if (!fragment) return std::nullopt;
    data.fragment = *fragment;
  }
  std::optional<std::size_t> at = 4 + std::size_t(*to_qos);
  if (flags & kInlineQos) at = end_of_inline_qos(bytes, *at);
  if (!at) return std::nullopt;
  data.cdr = bytes.from(*at);
  return data;
}

}  // namespace

RtpsDatagram parse_rtps(std::span<const std::byte> datagram) {
  RtpsDatagram found;
  if (datagram.size() < kHeaderBytes || std::memcmp(datagram.data(), "RTPS", 4) != 0) return found;
  const auto guid_prefix = datagram.subspan(kGuidPrefixAt, kGuidPrefixBytes);
  for (auto rest = datagram.subspan(kHeaderBytes); rest.size() >= 4;) {
    const auto id = std::to_integer<std::uint8_t>(rest[0]),
               flags = std::to_integer<std::uint8_t>(rest[1]);
    const std::uint16_t length = *Bytes(rest, flags & kLittleEndian).number<std::uint16_t>(2);
    // Length 0: the submessage extends to the end of the datagram.
    const std::size_t end =
        length == 0 ? rest.size() : std::min<std::size_t>(rest.size(), 4 + std::size_t(length));
    const auto contents = rest.subspan(4, end - 4);
    if (id == kInfoDestination && contents.size() >= kGuidPrefixBytes)
      found.destination = hex(contents.first(kGuidPrefixBytes));
    if (id == kDataFrag || (id == kData && (flags & kPayload))) {
      const auto data = data_of(guid_prefix, id, flags, contents);
      if (!data) break;
      found.data.push_back(*data);
    }
    rest = rest.subspan(end);
  }
  return found;
}

}  // namespace fivepipe::wire
