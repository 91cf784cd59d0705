// Message types, parsed from IDL text (OMG IDL 4.2) of any version and source, so that a recording
// can be decoded by the schema that it carries.
//
// Supported: modules, structs, enums, @final, @key, the primitive types, string, sequence, arrays,
// and references to preceding definitions. Every struct counts as final. Everything else is
// rejected by name. Hostile text takes bounded time, memory and stack.
#pragma once
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace fivepipe::schema {

// The text names line and column, both from 1, and what was expected there; or the unknown type.
struct IdlError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class Kind {
  boolean,
  octet,
  character,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  string,
  enumeration,
  structure,
  sequence
};
constexpr bool is_primitive(Kind kind) { return kind < Kind::string; }
// Size and alignment of a primitive on the wire.
std::size_t size_bytes(Kind primitive);

struct Type {
  Kind kind = Kind::octet;
  // Maximum length of a string (bytes without the terminating zero) or of a sequence (elements);
  // 0: unbounded.
  std::uint32_t bound = 0;
  std::size_t definition = 0;  // index in Idl::enums or Idl::structs
  std::vector<Type> element;   // the element type of a sequence; empty for other kinds
};
struct Member {
  std::string name;
  Type type;
  std::vector<std::uint32_t> dimensions;  // of an array, outermost first; empty: not an array
  bool is_key = false;
};
struct Struct {
  std::string name;                                   // scoped: "fivepipe::v1::HullTile"
  std::vector<Member> members;                        // at least one
  const Member* find(std::string_view member) const;  // nullptr if there is none
};
struct Enum {
  std::string name;
  std::vector<std::string> enumerators;  // by value, from 0
};
// Each definition uses only preceding ones of its kind, so types cannot be recursive.
struct Idl {
  std::vector<Struct> structs;
  std::vector<Enum> enums;
  const Struct* find(std::string_view scoped_name) const;  // nullptr if there is none
  const Struct& at(std::string_view scoped_name) const;    // throws IdlError
};

Idl parse_idl(std::string_view text);  // of at most 1 MiB; throws IdlError

// IDL of the type as seen from inside `module` ("fivepipe::v1"): "sequence<string<32> >".
std::string type_text(const Idl& idl, const Type& type, std::string_view module = "");

// IDL of the struct and of all definitions that it needs, in order of need, inside their modules.
// Equal types give equal text, however their source is formatted, ordered or commented. Throws
// IdlError if the struct does not exist.
std::string self_contained(const Idl& idl, std::string_view scoped_name);

// Describes the first difference of the struct in `a` from that in `b`: "field frame: long instead
// of unsigned long long". Empty if names, types, order and keys are equal, including nested types.
std::string difference(const Idl& a, const Idl& b, std::string_view scoped_name);

}  // namespace fivepipe::schema
