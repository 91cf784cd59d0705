// Converts the types that several messages share: poses, pinholes, rectangles, texts, sequences.
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"
#include "common/pipeline/bus/topics.h"

namespace fivepipe::messages {

fivepipe_v1_Vec3 to_wire(const Eigen::Vector3d& v);
fivepipe_v1_Pose to_wire(const Eigen::Isometry3d& pose);
fivepipe_v1_Pinhole to_wire(const geometry::Pinhole& pinhole);
fivepipe_v1_PixelRect to_wire(const hull::PixelRect& rect);

Eigen::Vector3d from_wire(const fivepipe_v1_Vec3& v);
geometry::Pinhole from_wire(const fivepipe_v1_Pinhole& pinhole);
hull::PixelRect from_wire(const fivepipe_v1_PixelRect& rect);
// The same message gives the same bits on every host. Returns nullopt if a number is not finite or
// the quaternion's length differs from 1 by more than kMaxQuaternionError.
std::optional<Eigen::Isometry3d> from_wire(const fivepipe_v1_Pose& pose);
inline constexpr double kMaxQuaternionError = 1e-6;

// Limits of what a message may state, far beyond every true value. Within them, the difference of
// two stamps does not overflow, and a frame number is exact as a double and as int64.
inline constexpr std::uint64_t kMaxFrame = std::uint64_t(1) << 53;       // 285,000 years at 1 kHz
inline constexpr std::int64_t kMaxStamp_ns = 7'258'118'400'000'000'000;  // the year 2200
// Returns why a frame number or a stamp is invalid: above the limit, or before 1970. Returns
// nullopt if both are valid.
std::optional<std::string> why_implausible(std::uint64_t frame, std::int64_t stamp_ns);

// Copies the text. Throws std::length_error with the text if it does not fit. Names come from the
// configuration, which bounds their length.
template <std::size_t N>
void set_text(char (&field)[N], const std::string& text) {
  if (text.size() >= N)
    throw std::length_error("'" + text + "' is longer than " + std::to_string(N - 1) +
                            " characters");
  text.copy(field, text.size());
  field[text.size()] = '\0';
}

// Copies as much of the text as fits, for texts that people read.
template <std::size_t N>
void set_truncated(char (&field)[N], const std::string& text) {
  const std::size_t n = std::min(text.size(), N - 1);
  text.copy(field, n);
  field[n] = '\0';
}

// Points a sequence to `storage`, which must outlive the message.
template <class Sequence, class Element>
void borrow(Sequence& sequence, std::vector<Element>& storage) {
  sequence._length = sequence._maximum = std::uint32_t(storage.size());
  sequence._buffer = storage.data();
  sequence._release = false;
}

template <class Sequence>
auto span_of(const Sequence& sequence) {
  return std::span(sequence._buffer, sequence._length);
}

}  // namespace fivepipe::messages
