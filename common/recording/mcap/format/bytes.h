// Appends and reads the little-endian fields of MCAP records, with bounds checks.
#pragma once
#include <bit>
#include <concepts>
#include <cstring>
#include <memory>
#include <string_view>

#include "common/recording/mcap/format/mcap.h"

namespace fivepipe::mcap {

static_assert(std::endian::native == std::endian::little,
              "fields are copied as they are stored in memory");

using Bytes = std::vector<std::byte>;
using ByteView = std::span<const std::byte>;

// Uninitialised memory, to be filled at once: a huge length in a damaged file then costs no pages
// until they are written.
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(std::size_t size_bytes)
      : bytes_(std::make_unique_for_overwrite<std::byte[]>(size_bytes)), size_bytes_(size_bytes) {}
  std::span<std::byte> all() { return {bytes_.get(), size_bytes_}; }
  ByteView view() const { return {bytes_.get(), size_bytes_}; }

 private:
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t size_bytes_ = 0;
};

void append(Bytes& to, ByteView raw);
template <std::unsigned_integral T>
void append(Bytes& to, T value) {
  const std::size_t at = to.size();
  to.resize(at + sizeof(T));
  std::memcpy(to.data() + at, &value, sizeof(T));
}
// Appends the length before the content. Throws std::length_error above 4 GiB, the limit of the
// length field.
void append(Bytes& to, std::string_view text);
void append(Bytes& to, const std::map<std::string, std::string>& map);

// File name and byte offset for error messages. Records inside a chunk have the chunk's offset.
struct FileOffset {
  std::string_view file;
  std::uint64_t byte = 0;
  [[noreturn]] void fail(std::string_view what) const;  // throws McapError
};

// Reads fields from the front of a record's content. Throws McapError if a field exceeds the end.
class ByteReader {
 public:
  ByteReader(ByteView content, FileOffset location) : rest_(content), location_(location) {}
  template <std::unsigned_integral T>
  T take() {
    T value;
    std::memcpy(&value, raw(sizeof(T)).data(), sizeof(T));
    return value;
  }
  ByteView raw(std::uint64_t size_bytes);
  std::string text();
  std::map<std::string, std::string> text_map();
  ByteReader part();  // content of an array or a map, preceded by its 32-bit length
  ByteView rest() const { return rest_; }
  bool empty() const { return rest_.empty(); }
  const FileOffset& location() const { return location_; }

 private:
  ByteView rest_;
  FileOffset location_;
};

// CRC-32 of IEEE 802.3, used throughout the format. `initial_crc` is the CRC of the preceding
// bytes.
std::uint32_t crc32_of(ByteView bytes, std::uint32_t initial_crc = 0);

}  // namespace fivepipe::mcap
