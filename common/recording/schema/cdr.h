// Decodes payloads of plain CDR (XCDR1, both byte orders, with the 4-byte header) by types that are
// known only at run time.
//
// fivepipe decodes payloads itself because generated code knows only the types of its own build,
// while a recording carries the types that it was made with.
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

// The text names the field, the byte and the defect, for example
// "eye_from_world.translation_m.x at byte 40: 8 bytes needed, 3 left".
struct CdrError : std::runtime_error {
  CdrError(std::string field_path, std::size_t byte_offset, const std::string& what);
  std::string field;   // "objects[2].object"; empty: the message as a whole
  std::size_t offset;  // bytes from the start of the payload, including its header
};

enum class FloatFormat {
  number,
  // NaN and infinities as "NaN", "Infinity" and "-Infinity": JSON text has no such numbers.
  finite_number,
  hexadecimal,  // strings as printf's %a: "0x1.8p+1", exact and the same on every run
};

struct DecodeOptions {
  // Longer sequences and arrays of numbers are replaced by their type and length:
  // {"sequence<octet>": 44123}.
  std::size_t max_numeric_elements = std::numeric_limits<std::size_t>::max();
  FloatFormat floats = FloatFormat::number;
};

// Returns the fields in the type's order; enums by name, 64-bit integers exactly, char as a string
// of one byte. Throws CdrError if the payload is too short, or too long by more than its padding (3
// bytes); if a length is impossible or exceeds its bound; if a string is not terminated; if a
// boolean or an enum has an undefined value. Throws IdlError if the type does not exist. Takes time
// and memory proportional to the payload.
nlohmann::ordered_json decode(const Idl& idl, std::string_view scoped_name,
                              std::span<const std::byte> payload,
                              const DecodeOptions& options = {});

// Reads one field of a top-level struct without decoding the fields before it.
class FieldReader {
 public:
  using Value =
      std::variant<bool, std::int64_t, std::uint64_t, std::string>;  // string: also enums, by name

  // Throws IdlError if the type or the field does not exist, or the field is not an integer,
  // boolean, string or enum.
  FieldReader(Idl idl, std::string_view scoped_name, std::string_view field);
  // Returns nullopt if the payload is damaged before the field's end; ignores the bytes after it.
  std::optional<Value> read(std::span<const std::byte> payload) const;

 private:
  Idl idl_;
  std::size_t struct_ = 0, field_ = 0;
};

}  // namespace fivepipe::schema
