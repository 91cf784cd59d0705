#include "common/recording/schema/cdr.h"

#include <cmath>
#include <cstdio>

#include "common/recording/schema/cdr_cursor.h"

namespace fivepipe::schema {
namespace {

using Json = nlohmann::ordered_json;

// DDS pads a payload to a multiple of 4 bytes.
constexpr std::size_t kMaxPadding = 3;

class Decoder {
 public:
  Decoder(const Idl& idl, const DecodeOptions& options) : idl_(idl), options_(options) {}

  Json decode(const Struct& type, std::span<const std::byte> payload) {
    try {
      CdrCursor from(payload);
      Json message = members(type, from);
      if (from.left() > kMaxPadding)
        throw CdrFault{from.at(),
                       std::to_string(from.left()) + " bytes after the end of the message"};
      return message;
    } catch (const CdrFault& fault) {
      throw CdrError(path_text(), fault.offset, fault.what);
    }
  }

 private:
  struct PathStep {
    std::string_view member;  // empty: an element
    std::uint64_t index;
  };

  std::string path_text() const {
    std::string text;
    for (const PathStep& step : path_)
      if (step.member.empty())
        text += "[" + std::to_string(step.index) + "]";
      else
        text += (text.empty() ? "" : ".") + std::string(step.member);
    return text;
  }

  // Leaves path_ unchanged when it throws: path_text() then names the field.
  Json members(const Struct& type, CdrCursor& from) {
    Json object = Json::object();
    for (const Member& member : type.members) {
      path_.push_back({member.name, 0});
      object.push_back({member.name, array(member.type, member.dimensions, from)});
      path_.pop_back();
    }
    return object;
  }

  Json array(const Type& type, std::span<const std::uint32_t> dimensions, CdrCursor& from) {
    if (dimensions.empty()) return value(type, from);
    if (dimensions.size() == 1) return elements(type, dimensions[0], "array", from);
    Json rows = Json::array();
    for (std::uint32_t i = 0; i < dimensions[0]; ++i) {
      path_.push_back({{}, i});
      rows.push_back(array(type, dimensions.subspan(1), from));
      path_.pop_back();
    }
    return rows;
  }

  Json elements(const Type& type, std::uint32_t count, const char* container, CdrCursor& from) {
    if (is_primitive(type.kind)) {
      CdrCursor to_check = from;
      to_check.skip_values(count, size_bytes(type.kind));
      if (count > options_.max_numeric_elements) {
        from = to_check;
        return {{container + ("<" + type_text(idl_, type) + ">"), count}};
      }
    }
    Json list = Json::array();
    if (is_primitive(type.kind)) list.get_ref<Json::array_t&>().reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      path_.push_back({{}, i});
      list.push_back(value(type, from));
      path_.pop_back();
    }
    return list;
  }

  Json value(const Type& type, CdrCursor& from) {
    switch (type.kind) {
      case Kind::boolean: return from.take_boolean();
      case Kind::octet:
      case Kind::uint8: return from.take<std::uint8_t>();
      case Kind::character: return std::string(1, from.take<char>());
      case Kind::int8: return from.take<std::int8_t>();
      case Kind::int16: return from.take<std::int16_t>();
      case Kind::uint16: return from.take<std::uint16_t>();
      case Kind::int32: return from.take<std::int32_t>();
      case Kind::uint32: return from.take<std::uint32_t>();
      case Kind::int64: return from.take<std::int64_t>();
      case Kind::uint64: return from.take<std::uint64_t>();
      case Kind::float32: return number(from.take<float>());
      case Kind::float64: return number(from.take<double>());
      case Kind::string: return std::string(from.take_string(type.bound));
      case Kind::enumeration: return from.take_enumerator(idl_.enums[type.definition]);
      case Kind::structure: return members(idl_.structs[type.definition], from);
      case Kind::sequence:
        return elements(type.element[0], from.take_count(type.bound), "sequence", from);
    }
    return {};
  }

  Json number(double value) const {
    if (options_.floats == FloatFormat::hexadecimal) {
      char text[32];  // at most 24 characters: -0x1.fffffffffffffp-1022
      std::snprintf(text, sizeof text, "%a", value);
      return text;
    }
    if (options_.floats == FloatFormat::number || std::isfinite(value)) return value;
    return std::isnan(value) ? "NaN" : value > 0 ? "Infinity" : "-Infinity";
  }

  const Idl& idl_;
  const DecodeOptions& options_;
  std::vector<PathStep> path_;
};

std::string location_text(const std::string& field, std::size_t offset) {
  return (field.empty() ? "" : field + " ") + "at byte " + std::to_string(offset) + ": ";
}

}  // namespace

CdrError::CdrError(std::string field_path, std::size_t byte_offset, const std::string& what)
    : std::runtime_error(location_text(field_path, byte_offset) + what),
      field(std::move(field_path)),
      offset(byte_offset) {}

Json decode(const Idl& idl, std::string_view scoped_name, std::span<const std::byte> payload,
            const DecodeOptions& options) {
  return Decoder(idl, options).decode(idl.at(scoped_name), payload);
}

}  // namespace fivepipe::schema
