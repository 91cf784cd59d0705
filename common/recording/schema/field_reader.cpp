#include "common/recording/schema/cdr.h"
#include "common/recording/schema/cdr_cursor.h"

namespace fivepipe::schema {
namespace {

void skip(const Idl& idl, const Type& type, CdrCursor& from);

void skip_elements(const Idl& idl, const Type& type, std::uint64_t count, CdrCursor& from) {
  if (is_primitive(type.kind)) return from.skip_values(count, size_bytes(type.kind));
  for (std::uint64_t i = 0; i < count; ++i) skip(idl, type, from);
}

void skip_member(const Idl& idl, const Member& member, CdrCursor& from) {
  std::uint64_t count = 1;
  for (std::uint32_t size : member.dimensions) count *= size;
  skip_elements(idl, member.type, count, from);
}

void skip(const Idl& idl, const Type& type, CdrCursor& from) {
  if (is_primitive(type.kind))
    from.skip_values(1, size_bytes(type.kind));
  else if (type.kind == Kind::string)
    from.take_string(type.bound);
  else if (type.kind == Kind::enumeration)
    from.take_enumerator(idl.enums[type.definition]);
  else if (type.kind == Kind::sequence)
    skip_elements(idl, type.element[0], from.take_count(type.bound), from);
  else
    for (const Member& member : idl.structs[type.definition].members)
      skip_member(idl, member, from);
}

FieldReader::Value value(const Idl& idl, const Type& type, CdrCursor& from) {
  switch (type.kind) {
    case Kind::boolean: return from.take_boolean();
    case Kind::octet:
    case Kind::uint8: return std::uint64_t(from.take<std::uint8_t>());
    case Kind::int8: return std::int64_t(from.take<std::int8_t>());
    case Kind::int16: return std::int64_t(from.take<std::int16_t>());
    case Kind::uint16: return std::uint64_t(from.take<std::uint16_t>());
    case Kind::int32: return std::int64_t(from.take<std::int32_t>());
    case Kind::uint32: return std::uint64_t(from.take<std::uint32_t>());
    case Kind::int64: return from.take<std::int64_t>();
    case Kind::uint64: return from.take<std::uint64_t>();
    case Kind::string: return std::string(from.take_string(type.bound));
    case Kind::enumeration: return from.take_enumerator(idl.enums[type.definition]);
    default: return {};  // rejected by the constructor
  }
}

bool is_readable(const Member& field) {
  const Kind kind = field.type.kind;
  const bool is_number_or_text = is_primitive(kind) && kind != Kind::character &&
                                 kind != Kind::float32 && kind != Kind::float64;
  return field.dimensions.empty() &&
         (is_number_or_text || kind == Kind::string || kind == Kind::enumeration);
}

}  // namespace

FieldReader::FieldReader(Idl idl, std::string_view scoped_name, std::string_view field)
    : idl_(std::move(idl)) {
  const Struct& type = idl_.at(scoped_name);
  const Member* found = type.find(field);
  if (!found) throw IdlError(type.name + " has no field " + std::string(field));
  if (!is_readable(*found))
    throw IdlError(type.name + "." + found->name + " is not an integer, boolean, string or enum");
  struct_ = std::size_t(&type - idl_.structs.data());
  field_ = std::size_t(found - type.members.data());
}

std::optional<FieldReader::Value> FieldReader::read(std::span<const std::byte> payload) const {
  const std::vector<Member>& members = idl_.structs[struct_].members;
  try {
    CdrCursor from(payload);
    for (std::size_t i = 0; i < field_; ++i) skip_member(idl_, members[i], from);
    return value(idl_, members[field_].type, from);
  } catch (const CdrFault&) {
    return std::nullopt;
  }
}

}  // namespace fivepipe::schema
