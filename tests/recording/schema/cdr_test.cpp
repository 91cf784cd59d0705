#include "common/recording/schema/cdr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "common/recording/schema/wire_types.h"
#include "tests/support/recording/schema_payloads.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::schema {
namespace {

using Json = nlohmann::ordered_json;
using Bytes = std::vector<std::byte>;

// Covers every construct and every pair of successive alignments.
const Idl& all_constructs() {
  static const Idl idl = parse_idl(R"(module m {
    enum Colour { red, green, blue };
    struct Small { octet a; double b; boolean c; };
    struct All {
      char c; int8 i8; uint8 u8; short s; octet o; unsigned short us; octet o2; long l; octet o3;
      unsigned long ul; octet o4; long long ll;
      boolean truth; unsigned long long ull; octet o5; float f; octet o6; double d; string text;
      octet o7; string<5> bounded; Colour colour;
      Small small; octet o8; Small pair[2]; octet grid[2][3]; octet behind_grid; double wide[2];
      string<3> names[2]; Colour colours[2];
      sequence<octet> octets; sequence<double> doubles; octet o9; sequence<short, 3> shorts;
      sequence<Small> smalls; sequence<string> texts;
      sequence<sequence<long long> > rows; sequence<Colour, 2> hues; sequence<boolean> truths;
      long long last;
    };
  };)");
  return idl;
}

Bytes bytes_of(std::initializer_list<int> values) {
  Bytes bytes;
  for (int value : values) bytes.push_back(std::byte(value));
  return bytes;
}

TEST(SchemaCdr, DecodesEveryConstructInBothByteOrders) {
  for (const std::endian order : {std::endian::little, std::endian::big})
    for (std::uint32_t seed = 1; seed <= 200; ++seed) {
      const test::Payload made = test::PayloadMaker(all_constructs(), order, seed).make("m::All");
      // Compares text, because JSON's == equates 2^63 and the nearest double.
      EXPECT_EQ(decode(all_constructs(), "m::All", made.bytes).dump(), made.values.dump())
          << "seed " << seed;
    }
}

TEST(SchemaCdr, DecodesTheDeepestSupportedType) {
  std::string text = "struct S1 { octet x; };";
  for (int i = 2; i <= 64; ++i)
    text += "struct S" + std::to_string(i) + " { S" + std::to_string(i - 1) +
            " x[1][1][1][1][1][1][1][1]; };";
  const Json deepest = decode(parse_idl(text), "S64", bytes_of({0, 1, 0, 0, 42}));
  const std::string dumped = deepest.dump();
  EXPECT_NE(dumped.find("{\"x\":42}"), std::string::npos);
  EXPECT_EQ(std::count(dumped.begin(), dumped.end(), '['), 63 * 8);
  EXPECT_THROW(parse_idl(text + "struct S65 { S64 x; };"), IdlError);
}

// Bytes assembled from the tables of DDS-XTypes 7.4.1. Offsets after the header: o 0, s 2, e 4, l
// 8, t 16, f 24.
TEST(SchemaCdr, DecodesBytesAssembledByHand) {
  const Idl idl = parse_idl(
      "enum E { a, b }; struct S { octet o; short s; E e; long long l; string t; sequence<float> "
      "f; };");
  const Json expected = {{"o", 7}, {"s", -2}, {"e", "b"}, {"l", 3}, {"t", "hi"}, {"f", {1.5}}};
  const Bytes little = bytes_of({0, 1, 0, 0, 7, 0, 0xfe, 0xff, 1, 0, 0, 0, 3, 0, 0, 0, 0,    0,
                                 0, 0, 3, 0, 0, 0, 'h',  'i',  0, 0, 1, 0, 0, 0, 0, 0, 0xc0, 0x3f});
  const Bytes big = bytes_of({0, 0, 0, 0, 7, 0, 0xff, 0xfe, 0, 0, 0, 1, 0, 0, 0,    0,    0, 0,
                              0, 3, 0, 0, 0, 3, 'h',  'i',  0, 0, 0, 0, 0, 1, 0x3f, 0xc0, 0, 0});
  EXPECT_EQ(decode(idl, "S", little), expected);
  EXPECT_EQ(decode(idl, "S", big), expected);
}

CdrError error_of(const Idl& idl, std::string_view type, const Bytes& payload) {
  try {
    decode(idl, type, payload);
  } catch (const CdrError& error) {
    return error;
  }
  return CdrError("", 0, "decoded");
}

TEST(SchemaCdr, ErrorNamesFieldAndByte) {
  const Idl idl = parse_idl(
      "enum E { a, b }; struct P { E e; boolean b; }; struct S { sequence<P, 3> list; string<4> t; "
      "long n; };");
  const auto error_text = [&](std::initializer_list<int> bytes) {
    return std::string(error_of(idl, "S", bytes_of(bytes)).what());
  };
  EXPECT_EQ(error_text({0, 1}), "at byte 0: a payload of 2 bytes has no header");
  EXPECT_EQ(error_text({0, 3, 0, 0}), "at byte 0: representation 3 is not plain CDR (0 or 1)");
  EXPECT_EQ(error_text({1, 1, 0, 0}), "at byte 0: representation 257 is not plain CDR (0 or 1)");
  EXPECT_EQ(error_text({0, 1, 0, 0}), "list at byte 4: 4 bytes needed, 0 left");
  EXPECT_EQ(error_text({0, 1, 0, 0, 9, 0, 0, 0}),
            "list at byte 4: a sequence of 9, the bound is 3");
  EXPECT_EQ(error_text({0, 1, 0, 0, 2, 0, 0, 0}),
            "list at byte 4: a sequence of 2, only 0 bytes left");
  EXPECT_EQ(error_text({0, 1, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0}),
            "list[1].e at byte 16: E has no value 2");
  EXPECT_EQ(error_text({0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0}),
            "list[0].b at byte 12: a boolean is 2 instead of 0 or 1");
  EXPECT_EQ(error_text({0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}),
            "t at byte 8: a string of length 0 lacks its terminating zero");
  EXPECT_EQ(error_text({0, 1, 0, 0, 0, 0, 0, 0, 6, 0, 0, 0}),
            "t at byte 8: a string of 5 bytes, the bound is 4");
  EXPECT_EQ(error_text({0, 1, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 'a'}),
            "t at byte 8: a string of 3 bytes, only 1 bytes left");
  EXPECT_EQ(error_text({0, 1, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 'a', 'b'}),
            "t at byte 8: a string is not terminated by a zero");
  EXPECT_EQ(error_text({0, 1, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 'a', 0, 0}),
            "t at byte 8: a string contains a zero");
  EXPECT_EQ(error_text({0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0}),
            "n at byte 16: 4 bytes needed, 3 left");
  EXPECT_EQ(error_text({0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0}),
            "at byte 0: decoded")
      << "three bytes of padding";
  EXPECT_EQ(error_text({0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0}),
            "at byte 20: 4 bytes after the end of the message");
  EXPECT_THROW(decode(idl, "T", bytes_of({0, 1, 0, 0})), IdlError);
  const CdrError error = error_of(idl, "S", bytes_of({0, 1, 0, 0, 1, 0, 0, 0, 7, 0, 0, 0}));
  EXPECT_EQ(error.field, "list[0].e");
  EXPECT_EQ(error.offset, 8u);
}

TEST(SchemaCdr, ImpossibleLengthIsRejectedBeforeAllocation) {
  const Idl idl = parse_idl(
      "struct S { sequence<double> d; }; struct A { double d[1000000][4000]; }; struct N { string "
      "names[4000000000]; };");
  const auto error_text = [&](const char* type, std::initializer_list<int> bytes) {
    return std::string(error_of(idl, type, bytes_of(bytes)).what());
  };
  EXPECT_EQ(error_text("S", {0, 1, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}),
            "d at byte 12: 2 values of 8 bytes, only 4 bytes left");
  EXPECT_EQ(error_text("A", {0, 1, 0, 0}),
            "d[0] at byte 4: 4000 values of 8 bytes, only 0 bytes left");
  EXPECT_EQ(error_text("N", {0, 1, 0, 0}), "names[0] at byte 4: 4 bytes needed, 0 left");
}

TEST(SchemaCdr, EveryTruncationIsAnError) {
  for (const Struct& type : fivepipe_idl().structs)
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      const Bytes whole =
          test::PayloadMaker(fivepipe_idl(), seed == 2 ? std::endian::big : std::endian::little,
                             seed)
              .make(type.name)
              .bytes;
      const std::size_t padding = std::size_t(whole[3]);
      for (std::size_t length = 0; length < whole.size(); ++length) {
        // A copy of exactly that length, so that the address sanitizer detects reads beyond it.
        const Bytes cut(whole.begin(), whole.begin() + std::ptrdiff_t(length));
        if (length < whole.size() - padding)
          EXPECT_THROW(decode(fivepipe_idl(), type.name, cut), CdrError)
              << type.name << " cut to " << length;
        else
          EXPECT_NO_THROW(decode(fivepipe_idl(), type.name, cut))
              << type.name << " without its padding";
      }
    }
}

TEST(SchemaCdr, RandomBytesAreDecodedOrRejected) {
  std::mt19937 random(11);
  const auto try_decode = [&](const Idl& idl, const std::string& type, const Bytes& payload) {
    try {
      decode(idl, type, payload);
      return true;
    } catch (const CdrError&) {
      return false;
    }
  };
  int decoded = 0;
  for (int i = 0; i < 5000; ++i) {
    const std::string& type = fivepipe_idl().structs[random() % fivepipe_idl().structs.size()].name;
    Bytes noise(random() % 300);
    for (std::byte& b : noise) b = std::byte(random() % 3 ? 0 : random());
    if (noise.size() > 1 && random() % 8)
      noise[0] = std::byte{0}, noise[1] = std::byte(random() % 2);
    decoded += try_decode(fivepipe_idl(), type, noise);
    Bytes damaged = test::PayloadMaker(all_constructs(), std::endian::little, std::uint32_t(i))
                        .make("m::All")
                        .bytes;
    for (std::size_t left = 1 + random() % 4; left > 0; --left)
      damaged[random() % damaged.size()] = std::byte(random());
    decoded += try_decode(all_constructs(), "m::All", damaged);
  }
  EXPECT_GT(decoded, 100);
}

TEST(SchemaCdr, LongNumericSequencesAreSummarized) {
  const Idl idl =
      parse_idl("struct S { sequence<octet> o; octet a[3]; sequence<string> t; long last; };");
  const Bytes payload = bytes_of({0, 1, 0, 0, 3, 0, 0, 0, 1, 2, 3, 4, 5, 6, 0, 0,
                                  1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0});
  const Json whole = {{"o", {1, 2, 3}}, {"a", {4, 5, 6}}, {"t", Json::array({""})}, {"last", 9}};
  EXPECT_EQ(decode(idl, "S", payload, {.max_numeric_elements = 3}), whole);
  const Json counted = {{"o", {{"sequence<octet>", 3}}},
                        {"a", {{"array<octet>", 3}}},
                        {"t", Json::array({""})},
                        {"last", 9}};
  EXPECT_EQ(decode(idl, "S", payload, {.max_numeric_elements = 0}), counted);
}

TEST(SchemaCdr, NonFiniteNumbersArePreserved) {
  const Idl idl = parse_idl("struct S { float a; float b; double c; };");
  const Bytes payload =
      bytes_of({0, 1, 0, 0, 0, 0, 0xc0, 0x7f, 0, 0, 0x80, 0xff, 0, 0, 0, 0, 0, 0, 0xf0, 0x7f});
  const Json numbers = decode(idl, "S", payload);
  EXPECT_TRUE(std::isnan(numbers["a"].get<double>()));
  EXPECT_EQ(numbers["b"], -std::numeric_limits<double>::infinity());
  EXPECT_EQ(decode(idl, "S", payload, {.floats = FloatFormat::finite_number}),
            Json({{"a", "NaN"}, {"b", "-Infinity"}, {"c", "Infinity"}}));
  const Idl one = parse_idl("struct S { float a; };");
  EXPECT_EQ(decode(one, "S", bytes_of({0, 1, 0, 0, 0, 0, 0xc0, 0xbf}),
                   {.floats = FloatFormat::finite_number}),
            Json({{"a", -1.5}}));
}

TEST(SchemaCdr, HexadecimalFloatsAreExact) {
  const Idl idl = parse_idl("struct S { double longest; float negative; };");
  // The largest mantissa with the smallest exponent, as it is sent (little endian).
  const Bytes payload =
      bytes_of({0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x1f, 0x80, 0, 0, 0xc0, 0xbf});
  EXPECT_EQ(decode(idl, "S", payload, {.floats = FloatFormat::hexadecimal}),
            Json({{"longest", "-0x1.fffffffffffffp-1022"}, {"negative", "-0x1.8p+0"}}));
}

Json as_json(const FieldReader::Value& value) {
  return std::visit([](const auto& held) { return Json(held); }, value);
}

TEST(SchemaFieldReader, AgreesWithDecodeInEveryField) {
  std::vector<std::pair<const Idl*, std::string>> types = {{&all_constructs(), "m::All"}};
  for (const Struct& type : fivepipe_idl().structs) types.emplace_back(&fivepipe_idl(), type.name);
  int fields = 0;
  for (const auto& [idl, type] : types)
    for (const Member& member : idl->at(type).members) {
      const Kind kind = member.type.kind;
      const bool is_no_number =
          kind == Kind::character || kind == Kind::float32 || kind == Kind::float64;
      const bool is_no_field = !member.dimensions.empty() || is_no_number ||
                               kind == Kind::structure || kind == Kind::sequence;
      if (is_no_field) {
        EXPECT_THROW(FieldReader(*idl, type, member.name), IdlError);
        continue;
      }
      ++fields;
      const FieldReader reader(*idl, type, member.name);
      for (std::uint32_t seed = 1; seed <= 20; ++seed) {
        const test::Payload made =
            test::PayloadMaker(*idl, seed % 2 ? std::endian::little : std::endian::big, seed)
                .make(type);
        const auto value = reader.read(made.bytes);
        ASSERT_TRUE(value) << type << "." << member.name;
        EXPECT_EQ(as_json(*value).dump(), made.values[member.name].dump())
            << type << "." << member.name;
      }
    }
  EXPECT_GT(fields, 100);
  EXPECT_THROW(FieldReader(fivepipe_idl(), "fivepipe::v1::HullTile", "no_such_field"), IdlError);
  EXPECT_THROW(FieldReader(fivepipe_idl(), "NoSuchType", "frame"), IdlError);
}

TEST(SchemaFieldReader, NamesTheFieldThatItCannotRead) {
  const auto error_text = [](const char* field) {
    try {
      FieldReader(all_constructs(), "m::All", field);
    } catch (const IdlError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_EQ(error_text("last"), "none");
  EXPECT_EQ(error_text("absent"), "m::All has no field absent");
  EXPECT_EQ(error_text("f"), "m::All.f is not an integer, boolean, string or enum");
}

// A payload truncated before the field's end has no value; one truncated later has it.
TEST(SchemaFieldReader, NeedsThePayloadUpToItsFieldOnly) {
  const FieldReader reader(all_constructs(), "m::All", "last");
  const FieldReader frame(fivepipe_idl(), "fivepipe::v1::FrameComposited", "frame");
  const test::Payload all =
      test::PayloadMaker(all_constructs(), std::endian::little, 3).make("m::All");
  const test::Payload composited = test::PayloadMaker(fivepipe_idl(), std::endian::little, 3)
                                       .make("fivepipe::v1::FrameComposited");
  for (std::size_t length = 0; length < all.bytes.size(); ++length)
    EXPECT_EQ(reader.read(Bytes(all.bytes.begin(), all.bytes.begin() + std::ptrdiff_t(length)))
                  .has_value(),
              false)
        << length;
  for (std::size_t length = 0; length <= composited.bytes.size(); ++length) {
    const Bytes cut(composited.bytes.begin(), composited.bytes.begin() + std::ptrdiff_t(length));
    EXPECT_EQ(frame.read(cut).has_value(), length + 16 >= composited.bytes.size()) << length;
  }
}

// The limit is far above the expected cost, because machines are loaded and builds unoptimised.
TEST(SchemaFieldReader, CostsLessThanAMicrosecond) {
  for (const char* type : {"fivepipe::v1::HullTile", "fivepipe::v1::ObjectPixelMap"}) {
    const FieldReader reader(fivepipe_idl(), type, "frame");
    const test::Payload made =
        test::PayloadMaker(fivepipe_idl(), std::endian::little, 1).make(type);
    double best_ns = 1e9;
    for (int turn = 0; turn < 20; ++turn) {
      std::uint64_t sum = 0;
      const auto start = std::chrono::steady_clock::now();
      for (int i = 0; i < 1000; ++i) sum += std::get<std::uint64_t>(*reader.read(made.bytes));
      best_ns = std::min(best_ns, std::chrono::duration<double, std::nano>(
                                      std::chrono::steady_clock::now() - start)
                                          .count() /
                                      1000);
      EXPECT_EQ(sum, made.values["frame"].get<std::uint64_t>() * 1000);
    }
    std::printf("%s.frame: %.0f ns\n", type, best_ns);
    EXPECT_LT(best_ns, 1000 * test::kSlowdown);
  }
}

}  // namespace
}  // namespace fivepipe::schema
