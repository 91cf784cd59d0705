// Random payloads (seeded) of any type of an IDL, with the values that they contain.
#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "common/recording/schema/idl.h"

namespace fivepipe::test {

using namespace schema;

struct Payload {
  std::vector<std::byte> bytes;
  nlohmann::ordered_json values;
};

class PayloadMaker {
 public:
  PayloadMaker(const schema::Idl& idl, std::endian order, std::uint32_t seed)
      : idl_(idl), order_(order), random_(seed) {}

  Payload make(std::string_view scoped_name) {
    bytes_ = {std::byte{0}, order_ == std::endian::little ? std::byte{1} : std::byte{0},
              std::byte{0}, std::byte{0}};
    nlohmann::ordered_json values = members(idl_.at(scoped_name));
    // The header states the number of padding bytes (DDS-XTypes 7.6.3.1.2).
    const std::size_t padding = (4 - bytes_.size() % 4) % 4;
    bytes_.resize(bytes_.size() + padding);
    bytes_[3] = std::byte(padding);
    return {bytes_, values};
  }

 private:
  template <class T>
  T put(T value) {
    while ((bytes_.size() - 4) % sizeof(T)) bytes_.push_back(std::byte{0});
    std::byte raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (order_ != std::endian::native) std::reverse(raw, raw + sizeof(T));
    bytes_.insert(bytes_.end(), raw, raw + sizeof(T));
    return value;
  }

  template <class T>
  T put_random() {
    std::uint64_t bits = random_();
    T value;
    std::memcpy(&value, &bits, sizeof(T));
    return put(value);
  }

  std::uint32_t below(std::uint32_t count) { return std::uint32_t(random_() % count); }
  double finite() {
    const double mantissa = double(random_()) - 0x1p63;
    return std::ldexp(mantissa, int(below(60)) - 90);
  }

  nlohmann::ordered_json members(const schema::Struct& type) {
    nlohmann::ordered_json object = nlohmann::ordered_json::object();
    for (const schema::Member& member : type.members)
      object[member.name] = array(member.type, member.dimensions, 0);
    return object;
  }

  nlohmann::ordered_json array(const schema::Type& type,
                               const std::vector<std::uint32_t>& dimensions, std::size_t from) {
    if (from == dimensions.size()) return value(type);
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (std::uint32_t i = 0; i < dimensions[from]; ++i)
      list.push_back(array(type, dimensions, from + 1));
    return list;
  }

  nlohmann::ordered_json text(const schema::Type& type) {
    const std::uint32_t length = below((type.bound ? std::min(type.bound, 300u) : 20) + 1);
    std::string text;
    for (std::uint32_t i = 0; i < length; ++i) text += char('!' + below(90));
    put(length + 1);
    for (char c : text) put(c);
    put('\0');
    return text;
  }

  nlohmann::ordered_json sequence(const schema::Type& type) {
    const std::uint32_t count = put(below((type.bound ? std::min(type.bound, 5u) : 5) + 1));
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (std::uint32_t i = 0; i < count; ++i) list.push_back(value(type.element[0]));
    return list;
  }

  nlohmann::ordered_json enumerator(const schema::Enum& type) {
    return type.enumerators[put(below(std::uint32_t(type.enumerators.size())))];
  }

  nlohmann::ordered_json value(const schema::Type& type) {
    switch (type.kind) {
      case schema::Kind::boolean: return bool(put(std::uint8_t(below(2))));
      case schema::Kind::octet:
      case schema::Kind::uint8: return put_random<std::uint8_t>();
      case schema::Kind::character: return std::string(1, put(char('a' + below(26))));
      case schema::Kind::int8: return put_random<std::int8_t>();
      case schema::Kind::int16: return put_random<std::int16_t>();
      case schema::Kind::uint16: return put_random<std::uint16_t>();
      case schema::Kind::int32: return put_random<std::int32_t>();
      case schema::Kind::uint32: return put_random<std::uint32_t>();
      case schema::Kind::int64: return put_random<std::int64_t>();
      case schema::Kind::uint64: return put_random<std::uint64_t>();
      case schema::Kind::float32: return put(float(finite()));
      case schema::Kind::float64: return put(finite());
      case schema::Kind::string: return text(type);
      case schema::Kind::enumeration: return enumerator(idl_.enums[type.definition]);
      case schema::Kind::structure: return members(idl_.structs[type.definition]);
      case schema::Kind::sequence: return sequence(type);
    }
    return {};
  }

  const schema::Idl& idl_;
  std::endian order_;
  std::mt19937_64 random_;
  std::vector<std::byte> bytes_;
};

}  // namespace fivepipe::test
