// Messages as files of a fuzzer: a header of numbers and names, then the sequences.
#pragma once
#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "common/pipeline/messages/wire_conversions.h"
#include "tests/fuzz/mutations.h"

namespace fivepipe::fuzz {

inline std::string bytes_of_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

template <typename T>
void append_object(std::string& bytes, const T& object) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&object), sizeof object);
}

template <typename T>
void append_elements(std::string& bytes, std::span<const T> elements) {
  bytes.append(reinterpret_cast<const char*>(elements.data()), elements.size_bytes());
}

// Removes up to `count` elements from the front of `bytes`.
template <typename T>
std::vector<T> take_elements(std::string_view& bytes, std::size_t count) {
  std::vector<T> elements(std::min(count, bytes.size() / sizeof(T)));
  if (!elements.empty()) std::memcpy(elements.data(), bytes.data(), elements.size() * sizeof(T));
  bytes.remove_prefix(elements.size() * sizeof(T));
  return elements;
}

// Removes an object from the front; the missing end of a truncated one is zero.
template <typename T>
T take_object(std::string_view& bytes) {
  T object{};
  const std::size_t size = std::min(sizeof object, bytes.size());
  std::memcpy(&object, bytes.data(), size);
  bytes.remove_prefix(size);
  return object;
}

// Overwrites a number of the header that begins at `at`. All fields are 4 or 8 bytes long.
inline void mutate_field(Random& random, std::string& bytes, std::size_t at,
                         std::size_t header_bytes) {
  at += 4 * below(random, header_bytes / 4);
  if (at >= bytes.size()) return;
  const std::size_t room = bytes.size() - at;
  std::int32_t near = 0;
  std::memcpy(&near, bytes.data() + at, std::min(sizeof near, room));
  near = std::int32_t(std::uint32_t(near) + std::uint32_t(below(random, 5)) - 2);
  const double number = interesting_double(random);
  const std::uint64_t integer = interesting_integer(random);
  switch (below(random, 4)) {
    case 0: std::memcpy(bytes.data() + at, &near, std::min(sizeof near, room)); break;
    case 1: std::memcpy(bytes.data() + at, &number, std::min(sizeof number, room)); break;
    case 2: std::memcpy(bytes.data() + at, &integer, std::min(sizeof integer, room)); break;
    default: std::memcpy(bytes.data() + at, &integer, std::min(sizeof near, room)); break;
  }
}

// The text of a name field; Cyclone DDS guarantees its end.
template <std::size_t N>
void set_name(char (&field)[N], const char* text, std::size_t text_bytes) {
  std::memset(field, 0, N);
  std::memcpy(field, text, std::min(text_bytes, N - 1));
}

}  // namespace fivepipe::fuzz
