// Reads a payload of plain CDR (XCDR1; DDS-RTPS 10.5, DDS-XTypes 7.4.1) from front to back. A
// 4-byte header states the byte order; each primitive is aligned to its size, counted from the
// header's end.
#pragma once
#include <bit>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "common/recording/schema/idl.h"

namespace fivepipe::schema {

struct CdrFault {
  std::size_t offset;  // bytes from the start of the payload, including its header
  std::string what;
};

// Throws CdrFault if the payload does not hold the requested value. The payload must outlive it.
class CdrCursor {
 public:
  explicit CdrCursor(std::span<const std::byte> payload) : payload_(payload) {
    if (payload.size() < kHeaderBytes)
      throw CdrFault{0, "a payload of " + std::to_string(payload.size()) + " bytes has no header"};
    if (payload[0] != std::byte{0} || payload[1] > std::byte{1})
      throw CdrFault{0, "representation " +
                            std::to_string(256 * int(payload[0]) + int(payload[1])) +
                            " is not plain CDR (0 or 1)"};
    swaps_ = (payload[1] == std::byte{1}) != (std::endian::native == std::endian::little);
  }

  std::size_t at() const { return at_; }
  std::size_t left() const { return payload_.size() - at_; }

  template <class T>
  T take() {
    align(sizeof(T));
    T value;
    const std::span<const std::byte> bytes = take_bytes(sizeof(T));
    std::memcpy(&value, bytes.data(), sizeof(T));
    return swaps_ ? swapped(value) : value;
  }

  // Throws if the payload ends before the aligned position.
  void align(std::size_t to_bytes) {
    const std::size_t aligned =
        kHeaderBytes + ((at_ - kHeaderBytes + to_bytes - 1) & ~(to_bytes - 1));
    if (aligned > payload_.size()) too_short(aligned - at_);
    at_ = aligned;
  }

  std::span<const std::byte> take_bytes(std::size_t count) {
    if (count > left()) too_short(count);
    at_ += count;
    return payload_.subspan(at_ - count, count);
  }

  void skip_values(std::uint64_t count, std::size_t value_bytes) {
    if (count == 0) return;
    align(value_bytes);
    if (count > left() / value_bytes)
      beyond_end(at_,
                 std::to_string(count) + " values of " + std::to_string(value_bytes) + " bytes");
    at_ += std::size_t(count) * value_bytes;
  }

  // Returns the string without its terminating zero.
  std::string_view take_string(std::uint32_t bound) {
    const std::size_t start = at_;
    const auto length = take<std::uint32_t>();
    if (length == 0) throw CdrFault{start, "a string of length 0 lacks its terminating zero"};
    if (bound && length - 1 > bound)
      beyond_bound(start, "a string of " + std::to_string(length - 1) + " bytes", bound);
    if (length > left()) beyond_end(start, "a string of " + std::to_string(length - 1) + " bytes");
    const std::string_view text(reinterpret_cast<const char*>(take_bytes(length).data()),
                                length - 1);
    if (text.data()[length - 1] != '\0')
      throw CdrFault{start, "a string is not terminated by a zero"};
    if (text.find('\0') != std::string_view::npos)
      throw CdrFault{start, "a string contains a zero"};
    return text;
  }

  // Returns a sequence's length. Each element takes at least one byte, so a length beyond the
  // remaining bytes is a fault.
  std::uint32_t take_count(std::uint32_t bound) {
    const std::size_t start = at_;
    const auto count = take<std::uint32_t>();
    if (bound && count > bound)
      beyond_bound(start, "a sequence of " + std::to_string(count), bound);
    if (count > left()) beyond_end(start, "a sequence of " + std::to_string(count));
    return count;
  }

  bool take_boolean() {
    const auto value = take<std::uint8_t>();
    if (value > 1)
      throw CdrFault{at_ - 1, "a boolean is " + std::to_string(value) + " instead of 0 or 1"};
    return value == 1;
  }

  const std::string& take_enumerator(const Enum& type) {
    const auto value = take<std::uint32_t>();
    if (value >= type.enumerators.size())
      throw CdrFault{at_ - 4, type.name + " has no value " + std::to_string(value)};
    return type.enumerators[value];
  }

 private:
  static constexpr std::size_t kHeaderBytes = 4;

  [[noreturn]] void too_short(std::size_t needed) const {
    throw CdrFault{at_,
                   std::to_string(needed) + " bytes needed, " + std::to_string(left()) + " left"};
  }

  [[noreturn]] void beyond_end(std::size_t offset, const std::string& what) const {
    throw CdrFault{offset, what + ", only " + std::to_string(left()) + " bytes left"};
  }
  [[noreturn]] static void beyond_bound(std::size_t offset, const std::string& what,
                                        std::uint32_t bound) {
    throw CdrFault{offset, what + ", the bound is " + std::to_string(bound)};
  }

  template <class T>
  static T swapped(T value) {
    std::byte bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
    std::memcpy(&value, bytes, sizeof(T));
    return value;
  }

  std::span<const std::byte> payload_;
  std::size_t at_ = kHeaderBytes;
  bool swaps_ = false;
};

}  // namespace fivepipe::schema
