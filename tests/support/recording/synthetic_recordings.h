// Types and payloads for tests of recordings.
#pragma once
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "common/recording/files/recording.h"
#include "common/recording/schema/wire_types.h"
#include "tests/support/recording/mcap_files.h"

namespace fivepipe::test {

// The log stamp of the first message and the period of the frames in synthetic recordings.
inline constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000, kFrame_ns = 16'000'000;

// The fields by which a type belongs to a frame; HeadPose and others have more.
inline constexpr const char* kFramedType = "made_up::Framed";
inline constexpr const char* kFramedIdl =
    "module made_up { @final struct Framed { unsigned long long frame; long long capture_stamp_ns; "
    "unsigned long number; }; };";
inline constexpr const char* kFramelessType = "made_up::Frameless";
// Like NodeStatus, names a frame but does not belong to one.
inline constexpr const char* kFramelessIdl =
    "module made_up { @final struct Frameless { unsigned long long frame; unsigned long number; }; "
    "};";

template <class Value>
void append_value(std::vector<std::byte>& to, Value value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  to.insert(to.end(), bytes.begin(), bytes.end());
}
inline std::vector<std::byte> cdr_header() {
  return {std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
}

inline std::vector<std::byte> framed(std::uint64_t frame, std::uint32_t number,
                                     std::int64_t capture_stamp_ns = 0) {
  std::vector<std::byte> cdr = cdr_header();
  append_value(cdr, frame);
  append_value(cdr, capture_stamp_ns);
  append_value(cdr, number);
  return cdr;
}
inline std::vector<std::byte> frameless(std::uint64_t frame, std::uint32_t number) {
  std::vector<std::byte> cdr = cdr_header();
  append_value(cdr, frame);
  append_value(cdr, number);
  return cdr;
}
// The last field of both types.
inline std::uint32_t number_of(std::span<const std::byte> cdr) {
  std::uint32_t number;
  std::memcpy(&number, cdr.data() + cdr.size() - sizeof number, sizeof number);
  return number;
}

}  // namespace fivepipe::test
