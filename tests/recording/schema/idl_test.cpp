#include "common/recording/schema/idl.h"

#include <gtest/gtest.h>

#include <random>

#include "common/recording/schema/wire_types.h"
#include "tests/support/text.h"

namespace fivepipe::schema {
namespace {

// Members of a struct S in module m: the source text and the type after parsing.
std::string understood(const std::string& member) {
  const Idl idl = parse_idl("module m { enum E { a, b }; struct Inner { long x; }; struct S { " +
                            member + "; }; };");
  const Member& found = idl.at("m::S").members.at(0);
  std::string text = type_text(idl, found.type);
  for (std::uint32_t size : found.dimensions) text += "[" + std::to_string(size) + "]";
  return (found.is_key ? "key " : "") + text + " " + found.name;
}

TEST(SchemaIdl, ReadsEveryType) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"boolean x", "boolean x"},
      {"octet x", "octet x"},
      {"char x", "char x"},
      {"int8 x", "int8 x"},
      {"uint8 x", "uint8 x"},
      {"short x", "short x"},
      {"int16 x", "short x"},
      {"unsigned short x", "unsigned short x"},
      {"uint16 x", "unsigned short x"},
      {"long x", "long x"},
      {"int32 x", "long x"},
      {"unsigned long x", "unsigned long x"},
      {"uint32 x", "unsigned long x"},
      {"long long x", "long long x"},
      {"int64 x", "long long x"},
      {"unsigned  long /* */ long x", "unsigned long long x"},
      {"uint64 x", "unsigned long long x"},
      {"float x", "float x"},
      {"double x", "double x"},
      {"string x", "string x"},
      {"string<32> x", "string<32> x"},
      {"sequence<octet> x", "sequence<octet> x"},
      {"sequence<long long, 7> x", "sequence<long long, 7> x"},
      {"sequence<string<32>> x", "sequence<string<32> > x"},
      {"sequence<sequence<E>, 4> x", "sequence<sequence<m::E>, 4> x"},
      {"E x", "m::E x"},
      {"Inner x", "m::Inner x"},
      {"m::Inner x", "m::Inner x"},
      {"::m::Inner x", "m::Inner x"},
      {"float x[3]", "float[3] x"},
      {"Inner x[2][4294967]", "m::Inner[2][4294967] x"},
      {"@key string<8> x", "key string<8> x"}};
  for (const auto& [written, expected] : cases) EXPECT_EQ(understood(written), expected);
}

TEST(SchemaIdl, ReadsSeveralFieldsOfOneTypeAndReopenedModules) {
  const Idl idl = parse_idl(
      "module a { @final struct P { double x, y[2]; }; }; module a { module b { struct Q { P p; }; "
      "}; };\nstruct Top { a::b::Q q; };");
  ASSERT_EQ(idl.structs.size(), 3u);
  EXPECT_EQ(idl.at("a::P").members.at(1).name, "y");
  EXPECT_EQ(idl.at("a::P").members.at(0).dimensions.size(), 0u);
  EXPECT_EQ(idl.at("a::P").members.at(1).dimensions, std::vector<std::uint32_t>{2});
  EXPECT_EQ(idl.structs[idl.at("a::b::Q").members.at(0).type.definition].name, "a::P");
  EXPECT_EQ(idl.find("P"), nullptr);
  EXPECT_THROW(idl.at("P"), IdlError);
}

TEST(SchemaIdl, AnInnerModulesTypeHidesTheOuterOne) {
  const Idl idl = parse_idl(
      "module a { struct P { long x; }; module b { struct P { float y; }; struct Q { P p; a::P q; "
      "}; }; };");
  const auto& members = idl.at("a::b::Q").members;
  EXPECT_EQ(idl.structs[members.at(0).type.definition].name, "a::b::P");
  EXPECT_EQ(idl.structs[members.at(1).type.definition].name, "a::P");
  EXPECT_EQ(difference(parse_idl(self_contained(idl, "a::b::Q")), idl, "a::b::Q"), "");
}

std::string refusal(const std::string& text) {
  try {
    parse_idl(text);
  } catch (const IdlError& error) {
    return error.what();
  }
  return "parsed";
}

TEST(SchemaIdl, RejectsUnsupportedIdlWithLocation) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"union U switch (long) { case 1: long x; };",
       "line 1, column 1: 'union' is not supported here"},
      {"module m {\n  bitmask B { a };\n};", "line 2, column 3: 'bitmask' is not supported here"},
      {"typedef long T;", "line 1, column 1: 'typedef' is not supported here"},
      {"const long n = 3;", "line 1, column 1: 'const' is not supported here"},
      {"struct S { map<long, long> x; };", "line 1, column 12: 'map' is not supported here"},
      {"struct S { wstring x; };", "line 1, column 12: 'wstring' is not supported here"},
      {"struct S { long double x; };", "line 1, column 17: 'long double' is not supported"},
      {"struct S { unsigned char x; };",
       "line 1, column 21: expected short or long after unsigned, found 'char'"},
      {"@appendable struct S { long x; };",
       "line 1, column 2: @appendable is not supported: its layout on the wire differs"},
      {"@mutable struct S { long x; };",
       "line 1, column 2: @mutable is not supported: its layout on the wire differs"},
      {"struct S { @optional long x; };",
       "line 1, column 13: the annotation @optional is not supported here"},
      {"enum E { @value(3) a };", "line 1, column 11: the annotation @value is not supported here"},
      {"#include \"x.idl\"", "line 1, column 1: preprocessor lines are not supported"},
      {"struct A { long x; }; struct S : A { long y; };",
       "line 1, column 32: inheritance is not supported"},
      {"struct S;", "line 1, column 9: a declaration of struct S without members is not supported"},
      {"struct S { };", "line 1, column 12: expected a type, found '}'"},
      {"enum E { };", "line 1, column 10: expected an enumerator, found '}'"},
      {"struct S { long x };", "line 1, column 19: expected ';', found '}'"},
      {"struct S { long x; }", "line 1, column 21: expected ';', found the end of the text"},
      {"module m { struct S { long x; };",
       "line 1, column 33: expected '}' of module m, found the end of the text"},
      {"struct S { long long; };", "line 1, column 21: expected a field's name, found ';'"},
      {"struct S { long octet; };",
       "line 1, column 17: expected a field's name, found the keyword 'octet'"},
      {"struct S { Other x; };", "line 1, column 12: type Other is not defined before its use"},
      {"struct S { sequence<S> x; };", "line 1, column 21: type S is not defined before its use"},
      {"struct S { long x; float x; };", "line 1, column 26: field 'x' is defined twice"},
      {"struct S { long x; }; struct S { long x; };", "line 1, column 30: S is defined twice"},
      {"enum E { a, b, a };", "line 1, column 16: enumerator 'a' is defined twice"},
      {"struct S { string<0> x; };",
       "line 1, column 19: expected the string's bound, a decimal number from 1 to 4294967295, "
       "found '0'"},
      {"struct S { octet x[4294967296]; };",
       "line 1, column 20: expected an array's size, a decimal number from 1 to 4294967295, found "
       "'4294967296'"},
      {"struct S { octet x[010]; };",
       "line 1, column 20: expected an array's size, a decimal number from 1 to 4294967295, found "
       "'010'"},
      {"struct S { octet x[N]; };",
       "line 1, column 20: expected an array's size, a decimal number from 1 to 4294967295, found "
       "'N'"},
      {"struct S { octet x[65536][65536]; };",
       "line 1, column 26: an array of more than 4294967295 elements"},
      {"\n  /* not closed", "line 2, column 3: the comment is not closed"},
      {"struct S { long x = 3; };", "line 1, column 19: expected ';', found '='"},
      {"struct S { long $; };", "line 1, column 17: unexpected character '$'"},
      {"hello", "line 1, column 1: expected module, struct or enum, found 'hello'"}};
  for (const auto& [text, expected] : cases) EXPECT_EQ(refusal(text), expected) << text;
}

std::string repeated(const std::string& text, std::size_t times) {
  std::string result;
  for (std::size_t i = 0; i < times; ++i) result += text;
  return result;
}

TEST(SchemaIdl, ExcessiveDepthAndLengthAreRejected) {
  EXPECT_EQ(refusal(repeated("module m { ", 50'000)),
            "line 1, column 1878: the names of the enclosing modules exceed 512 characters");
  EXPECT_EQ(refusal("struct S { " + repeated("sequence<", 100'000)),
            "line 1, column 84: sequences nested more than 8 deep");
  EXPECT_EQ(refusal("struct S { octet x" + repeated("[1]", 100'000)),
            "line 1, column 43: an array of more than 8 dimensions");
  EXPECT_EQ(refusal("struct S { a" + repeated("::a", 100'000) + " x; };").substr(0, 40),
            "line 1, column 12: type a::a::a::a::a::a");
  EXPECT_EQ(refusal("struct " + repeated("S", 100'000)),
            "line 1, column 8: a name has 100000 characters; the limit is 256");
  EXPECT_EQ(refusal(repeated(" ", 2'000'000)),
            "the IDL text has 2000000 bytes; the limit is 1048576");
  std::string chain = "struct S0 { long x; };";
  for (int i = 1; i < 1000; ++i)
    chain += "struct S" + std::to_string(i) + " { S" + std::to_string(i - 1) + " a, b; };";
  EXPECT_NE(refusal(chain).find("structs nested more than 64 deep"), std::string::npos)
      << refusal(chain);
}

TEST(SchemaIdl, LimitsAreInclusive) {
  const auto parses = [](const std::string& text) {
    EXPECT_EQ(refusal(text), "parsed") << text.substr(0, 200);
  };
  parses(std::string(1 << 20, ' '));
  EXPECT_NE(refusal(std::string((1 << 20) + 1, ' ')), "parsed");
  parses("struct " + std::string(256, 'S') + " { long x; };");
  EXPECT_NE(refusal("struct " + std::string(257, 'S') + " { long x; };"), "parsed");
  const std::string inner = " { struct S { long x; }; }; };";
  parses("module " + std::string(254, 'm') + " { module " + std::string(254, 'n') + inner);
  EXPECT_NE(
      refusal("module " + std::string(254, 'm') + " { module " + std::string(255, 'n') + inner),
      "parsed");
  parses("struct S { octet x[4294967295]; };");
  parses("struct S { string<4294967295> x; };");
  parses("struct S { octet x[1][1][1][1][1][1][1][2]; };");
  parses("struct S { " + repeated("sequence<", 8) + "octet" + repeated(" >", 8) + " x; };");
  EXPECT_NE(
      refusal("struct S { " + repeated("sequence<", 9) + "octet" + repeated(" >", 9) + " x; };"),
      "parsed");
  // A sequence is as deep as a struct, and the deepest field counts.
  std::string chain = "struct S0 { long x; };";
  for (int i = 1; i <= 31; ++i)
    chain += "struct S" + std::to_string(i) + " { sequence<S" + std::to_string(i - 1) +
             "> a; long x; };";
  parses(chain);
  EXPECT_EQ(refusal(chain + "struct S { sequence<S31> a; };").substr(0, 10), "line 1, co");
}

TEST(SchemaIdl, ReadsEveryLetterDigitAndBlank) {
  const Idl idl = parse_idl(
      "struct\taz\n{\rlong\vAZ\f; long a09, z, A, Z, a; };// the end\n/**/struct b{long x;};//");
  const std::vector<Member>& members = idl.at("az").members;
  std::string names;
  for (const Member& member : members) names += member.name + " ";
  EXPECT_EQ(names, "AZ a09 z A Z a ");
  EXPECT_EQ(idl.structs.size(), 2u);
  for (const char* character : {"`", "{", "@", "[", "/", ":"})
    EXPECT_NE(refusal("struct a" + std::string(character) + "b { long x; };"), "parsed")
        << character;
}

TEST(SchemaIdl, ErrorsShowUnprintableAndLongTextsShortened) {
  const std::string unexpected = "line 1, column 1: unexpected character ";
  EXPECT_EQ(refusal("~"), unexpected + "'~'");
  EXPECT_EQ(refusal("!"), unexpected + "'!'");
  for (const char* unprintable : {"\x7f", "\x1f", "\xff"})
    EXPECT_EQ(refusal(unprintable), unexpected + "'?'");
  const std::string expected = "line 1, column 1: expected module, struct or enum, found '";
  EXPECT_EQ(refusal(std::string(40, 'x')), expected + std::string(40, 'x') + "'");
  EXPECT_EQ(refusal(std::string(41, 'x')), expected + std::string(40, 'x') + "...'");
  EXPECT_EQ(refusal("/*/"), "line 1, column 1: the comment is not closed");
  EXPECT_EQ(refusal("struct S :"), "line 1, column 10: inheritance is not supported");
  EXPECT_EQ(refusal("struct S { octet x[1a]; };").substr(0, 38),
            "line 1, column 20: expected an array's");
}

TEST(SchemaIdl, ANameFromOutsideIsNotSearchedInInnerModules) {
  const Idl idl = parse_idl(
      "module a { struct P { long x; }; module a { struct P { float x; }; struct Q { ::a::P p; "
      "a::P "
      "q; }; }; };");
  const auto& members = idl.at("a::a::Q").members;
  EXPECT_EQ(idl.structs[members.at(0).type.definition].name, "a::P");
  EXPECT_EQ(idl.structs[members.at(1).type.definition].name, "a::a::P");
}

// Each struct contains the previous one twice, so that all paths together lead to 2^60 fields.
TEST(SchemaIdl, SharedTypesAreVisitedOnce) {
  std::string doubling = "struct S0 { long x; };";
  for (int i = 1; i <= 60; ++i)
    doubling += "struct S" + std::to_string(i) + " { S" + std::to_string(i - 1) + " a, b; };";
  const Idl idl = parse_idl(doubling);
  EXPECT_EQ(difference(idl, parse_idl(self_contained(idl, "S60")), "S60"), "");
}

TEST(SchemaIdl, RandomTextIsParsedOrRejected) {
  const std::vector<std::string> words = {"module", "struct",
                                          "enum",   "m",
                                          "S",      "E",
                                          "{",      "}",
                                          ";",      "};",
                                          ",",      "<",
                                          ">",      "[",
                                          "]",      "::",
                                          "@",      "key",
                                          "final",  "sequence",
                                          "string", "unsigned",
                                          "long",   "octet",
                                          "x",      "y",
                                          "3",      "0",
                                          "//",     "\n",
                                          "/*",     "*/",
                                          "\xff",   std::string(1, '\0'),
                                          "(",      ")"};
  std::mt19937 random(5);
  int read = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string text;
    for (std::size_t left = random() % 12; left > 0; --left) {
      text += words[random() % words.size()];
      if (random() % 4) text += ' ';
    }
    read += refusal(text) == "parsed";
    refusal("module m { struct S { " + text + "long z; }; };");
  }
  EXPECT_GT(read, 0);
}

TEST(SchemaIdl, EveryTruncationIsParsedOrRejected) {
  const std::string text = fivepipe_schema("fivepipe::v1::CollisionResult");
  for (std::size_t length = 1; length < text.size(); ++length)
    EXPECT_EQ(refusal(text.substr(0, length)) == "parsed", length == text.size() - 1) << length;
}

TEST(SchemaIdl, EveryStructOfThisBuildIsWrittenSelfContained) {
  EXPECT_GT(fivepipe_idl().structs.size(), 30u);
  for (const Struct& type : fivepipe_idl().structs) {
    const std::string text = fivepipe_schema(type.name);
    const Idl parsed = parse_idl(text);
    EXPECT_EQ(difference(parsed, fivepipe_idl(), type.name), "");
    EXPECT_EQ(self_contained(parsed, type.name), text);
    // The text has no unused definition: a later struct uses each of the others.
    EXPECT_EQ(parsed.structs.back().name, type.name);
    for (std::size_t i = 0; i + 1 < parsed.structs.size(); ++i) {
      const std::string use = parsed.structs[i].name.substr(std::string("fivepipe::v1::").size());
      EXPECT_TRUE(text.find(" " + use + " ", text.find("struct " + use) + 8) != std::string::npos ||
                  text.find("<" + use + ">") != std::string::npos)
          << use;
    }
  }
}

constexpr const char* kTile = R"(module a { module b {
  enum Kind { near, far };
  @final struct Point { double x; double y; };
  @final struct Tile {
    @key string<8> viewer; unsigned long long frame; Kind kind; sequence<Point> points;
  };
}; };)";

TEST(SchemaIdl, SelfContainedTextDependsOnlyOnTheTypes) {
  const std::string other = R"(// Another file.
module a { struct Unused { long x; };
  module b { struct Point { double x /* m */, y; }; };
  module b { enum Kind { near, // metres
     far }; struct Tile { @key string< 8 > viewer; uint64 frame; a::b::Kind kind;
     sequence < Point > points; }; }; };)";
  const std::string text = self_contained(parse_idl(kTile), "a::b::Tile");
  EXPECT_EQ(self_contained(parse_idl(other), "a::b::Tile"), text);
  EXPECT_EQ(text, R"(module a {
  module b {
    enum Kind { near, far };
    @final struct Point {
      double x;
      double y;
    };
    @final struct Tile {
      @key string<8> viewer;
      unsigned long long frame;
      Kind kind;
      sequence<Point> points;
    };
  };
};
)");
}

TEST(SchemaIdl, TypesOfOtherModulesAreWrittenScoped) {
  const Idl idl = parse_idl(R"(struct Free { long x; };
    module a { struct P { Free x; }; module b { struct Q { P p; }; }; };
    module c { struct R { a::b::Q q; Free f; }; };)");
  const std::string text = self_contained(idl, "c::R");
  EXPECT_EQ(difference(idl, parse_idl(text), "c::R"), "") << text;
  EXPECT_NE(text.find("a::b::Q q;"), std::string::npos) << text;
}

TEST(SchemaIdl, DifferencesAreReportedByField) {
  const Idl now = parse_idl(kTile);
  const auto difference_text = [&](const std::string& what, const std::string& by) {
    return difference(now, parse_idl(test::replaced(kTile, what, by)), "a::b::Tile");
  };
  EXPECT_EQ(difference_text("", ""), "");
  EXPECT_EQ(difference_text("unsigned long long", "long"),
            "field frame: unsigned long long instead of long");
  EXPECT_EQ(difference_text("string<8>", "string<9>"),
            "field viewer: string<8> instead of string<9>");
  EXPECT_EQ(difference_text("@key ", ""), "field viewer is a key");
  EXPECT_EQ(difference_text("unsigned long long", "@key unsigned long long"),
            "field frame is not a key");
  EXPECT_EQ(difference_text("frame;", "number;"), "field frame instead of number");
  EXPECT_EQ(difference_text("double y", "float y"), "field points.y: double instead of float");
  EXPECT_EQ(difference_text("double y;", ""), "field points.y is new");
  EXPECT_EQ(difference_text("double y;", "double y; double z;"), "field points.z is missing");
  EXPECT_EQ(difference_text("near, far", "far, near"),
            "field kind: near instead of far in a::b::Kind");
  EXPECT_EQ(difference_text("near, far", "near"), "field kind: far of a::b::Kind is new");
  EXPECT_EQ(difference_text("near, far", "near, far, farther"),
            "field kind: farther of a::b::Kind is missing");
  EXPECT_EQ(difference_text("sequence<Point> points", "sequence<Point, 5> points"),
            "field points: sequence<a::b::Point> instead of sequence<a::b::Point, 5>");
  EXPECT_EQ(difference_text("double x", "double x[2]"),
            "field points.x: double instead of double[2]");
  EXPECT_EQ(difference_text("struct Point { double x; double y; };", "enum Point { x, y };"),
            "field points: a struct instead of an enum, or an enum instead of a struct");
}

}  // namespace
}  // namespace fivepipe::schema
