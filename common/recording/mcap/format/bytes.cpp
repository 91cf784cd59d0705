#include "common/recording/mcap/format/bytes.h"

#include <zlib.h>

#include <limits>

namespace fivepipe::mcap {
namespace {

std::uint32_t length_of(std::size_t size_bytes) {
  if (size_bytes > std::numeric_limits<std::uint32_t>::max())
    throw std::length_error("a field of an MCAP record exceeds 4 GiB");
  return std::uint32_t(size_bytes);
}

}  // namespace

void append(Bytes& to, ByteView raw) { to.insert(to.end(), raw.begin(), raw.end()); }

void append(Bytes& to, std::string_view text) {
  append(to, length_of(text.size()));
  append(to, std::as_bytes(std::span(text)));
}

void append(Bytes& to, const std::map<std::string, std::string>& map) {
  Bytes entries;
  for (const auto& [key, value] : map) {
    append(entries, std::string_view(key));
    append(entries, std::string_view(value));
  }
  append(to, length_of(entries.size()));
  append(to, ByteView(entries));
}

void FileOffset::fail(std::string_view what) const {
  throw McapError(std::string(file) + ": byte " + std::to_string(byte) + ": " + std::string(what));
}

ByteView ByteReader::raw(std::uint64_t size_bytes) {
  if (size_bytes > rest_.size()) location_.fail("a field exceeds the end of its record");
  const ByteView taken = rest_.first(size_bytes);
  rest_ = rest_.subspan(size_bytes);
  return taken;
}

std::string ByteReader::text() {
  const ByteView bytes = raw(take<std::uint32_t>());
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

ByteReader ByteReader::part() { return {raw(take<std::uint32_t>()), location_}; }

std::map<std::string, std::string> ByteReader::text_map() {
  std::map<std::string, std::string> map;
  for (ByteReader entries = part(); !entries.empty();) {
    std::string key = entries.text();
    map.insert_or_assign(std::move(key), entries.text());
  }
  return map;
}

std::uint32_t crc32_of(ByteView bytes, std::uint32_t initial_crc) {
  return std::uint32_t(
      crc32_z(initial_crc, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

}  // namespace fivepipe::mcap
