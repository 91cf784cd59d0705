// Payloads of plain CDR (XCDR1, both byte orders, with their 4-byte header) by the types that stand
// with them.
#pragma once
#include <cstddef>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "common/recording/schema/idl.h"

namespace fivepipe::schema {

// "eye_from_world.translation_m.x at byte 40: 8 bytes needed, 3 left".
struct CdrError : std::runtime_error {
  CdrError(std::string field_path, std::size_t byte_offset, const std::string& what);
  std::string field;   // "objects[2].object"; empty: the message as a whole
  std::size_t offset;  // bytes from the start of the payload, its header included
};

struct DecodeOptions {
  // Longer sequences and arrays of numbers are only counted, for people: {"sequence<octet>":
  // 44123}.
  std::size_t max_numeric_elements = std::numeric_limits<std::size_t>::max();
  // JSON text has neither NaN nor infinity: as "NaN", "Infinity" and "-Infinity". Otherwise they
  // stay numbers of the value returned.
  bool non_finite_as_text = false;
};

// Fields in the type's order; enums by name, 64-bit integers exact, char as a string of one byte.
// Throws CdrError where the payload is too short, or longer by more than its padding (3 bytes), a
// length is absurd or beyond its bound, a string is not closed, a boolean or an enum has no such
// value; IdlError where there is no such type. Takes time and memory in proportion to the payload.
nlohmann::ordered_json decode(const Idl& idl, std::string_view scoped_name,
                              std::span<const std::byte> payload,
                              const DecodeOptions& options = {});

// One field of the top-level struct, without building what stands before it. Keeps what it needs of
// the types.
class FieldReader {
 public:
  using Value =
      std::variant<bool, std::int64_t, std::uint64_t, std::string>;  // string: also enums, by name

  // Throws IdlError where there is no such type or field, or it is neither an integer, boolean,
  // string nor enum.
  FieldReader(Idl idl, std::string_view scoped_name, std::string_view field);
  // Nothing where the payload is damaged up to there; behind the field it is not looked at.
  std::optional<Value> read(std::span<const std::byte> payload) const;

 private:
  Idl idl_;
  std::size_t struct_ = 0, field_ = 0;
};

}  // namespace fivepipe::schema
