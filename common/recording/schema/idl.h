// Message types as IDL text states them (OMG IDL 4.2), of any version and from any source. Pure:
// what a recording carries is enough to decode it. Read are modules, structs, enums, @final, @key,
// the primitive types, string, sequence, arrays and references to what stands before; every struct
// counts as final. All else is refused by its name. Hostile text costs bounded time, memory and
// stack.
#pragma once
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace fivepipe::schema {

// Names line and column, both from 1, and what was expected there; or the type that is not known.
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
// Of a primitive, on the wire: its size and its alignment.
std::size_t size_bytes(Kind primitive);

struct Type {
  Kind kind = Kind::octet;
  std::uint32_t bound =
      0;  // of a string, in bytes without the closing zero; of a sequence, in elements; 0: none
  std::size_t definition = 0;  // index in Idl::enums or Idl::structs
  std::vector<Type> element;   // of a sequence: one
};
struct Member {
  std::string name;
  Type type;
  std::vector<std::uint32_t> dimensions;  // of an array, outermost first; none: no array
  bool is_key = false;
};
struct Struct {
  std::string name;             // scoped: "fivepipe::v1::HullTile"
  std::vector<Member> members;  // at least one
  const Member* find(std::string_view member) const;
};
struct Enum {
  std::string name;
  std::vector<std::string> enumerators;  // by value, from 0
};
// Each definition uses only those before it of its kind: nothing is recursive.
struct Idl {
  std::vector<Struct> structs;
  std::vector<Enum> enums;
  const Struct* find(std::string_view scoped_name) const;  // nullptr: there is none
  const Struct& at(std::string_view scoped_name) const;    // throws IdlError
};

Idl parse_idl(std::string_view text);  // at most 1 MiB of it; throws IdlError

// As IDL, for a reader inside `module` ("fivepipe::v1"): "sequence<string<32> >".
std::string type_text(const Idl& idl, const Type& type, std::string_view module = "");

// The struct and all that it needs, in order of need, inside its modules: the same text for the
// same types, however their source is laid out, ordered or commented. Throws IdlError where there
// is no such struct.
std::string self_contained(const Idl& idl, std::string_view scoped_name);

// The first difference of the struct in `a` from that in `b`, for people: "field frame: long
// instead of unsigned long long". Empty where names, types, order and keys are the same, all the
// way down.
std::string difference(const Idl& a, const Idl& b, std::string_view scoped_name);
bool same_type(const Idl& a, const Idl& b, std::string_view scoped_name);

}  // namespace fivepipe::schema
