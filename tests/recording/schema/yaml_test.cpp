#include "common/recording/schema/yaml_text.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <limits>

#include "common/recording/schema/cdr.h"
#include "common/recording/schema/wire_types.h"
#include "tests/support/recording/schema_payloads.h"

namespace fivepipe::schema {
namespace {

using Json = nlohmann::ordered_json;

TEST(SchemaYaml, WritesALinePerFieldAndFlatValuesOnOneLine) {
  const Json message = {
      {"viewer", "eye"},
      {"frame", 18446744073709551615ull},
      {"pose", {{"at", {{"x", 1.0}, {"y", -2.5}}}, {"turned", false}}},
      {"tiles", {1, 2, 3}},
      {"none", Json::array()},
      {"note", "a: \"b\"\n"},
      {"word", "no"},
      {"counts", Json::array({{{"name", "frames"}, {"count", 3}}})},
      {"parts", Json::array({{{"id", 1}, {"from", {4, 5}}}, {{"id", 2}, {"from", Json::array()}}})},
      {"bgr", {{"sequence<octet>", 44123}}}};
  EXPECT_EQ(to_yaml(message), R"(---
viewer: eye
frame: 18446744073709551615
pose:
  at: {x: 1.0, y: -2.5}
  turned: false
tiles: [1, 2, 3]
none: []
note: "a: \"b\"\n"
word: "no"
counts:
  - {name: frames, count: 3}
parts:
  - id: 1
    from: [4, 5]
  - id: 2
    from: []
bgr: {sequence<octet>: 44123}
)");
}

TEST(SchemaYaml, WritesNonFiniteNumbersAndInvalidUtf8) {
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(to_yaml({{"a", std::nan("")}, {"b", infinite}, {"c", -infinite}, {"d", "\xff"}}),
            "---\na: .nan\nb: .inf\nc: -.inf\nd: \"\xEF\xBF\xBD\"\n");
}

// A YAML reader takes these for booleans, numbers or syntax unless they are quoted.
TEST(SchemaYaml, QuotesTextsThatYamlWouldReadAsSomethingElse) {
  for (const char* plain : {"a", "Z", "word_1", "sequence<octet>", "nothing"})
    EXPECT_EQ(to_yaml({{"k", plain}}), "---\nk: " + std::string(plain) + "\n");
  for (const char* quoted : {"", "true", "False", "NULL", "yes", "no", "on", "Off", "1a", "_a",
                             "a-b", "a b", "a{", "a;", "a="})
    EXPECT_EQ(to_yaml({{"k", quoted}}), "---\nk: \"" + std::string(quoted) + "\"\n");
  EXPECT_EQ(to_yaml({{"k", nullptr}, {"no", 0}}), "---\nk: null\n\"no\": 0\n");
  EXPECT_EQ(to_yaml(Json::object()), "---\n{}\n");
}

// Compares with the values that an independent YAML parser reads.
void expect_same(const YAML::Node& read, const Json& message, const std::string& path) {
  if (message.is_object()) {
    ASSERT_TRUE(read.IsMap()) << path;
    ASSERT_EQ(read.size(), message.size()) << path;
    for (const auto& [key, value] : message.items())
      expect_same(read[key], value, path + "." + key);
  } else if (message.is_array()) {
    ASSERT_TRUE(read.IsSequence()) << path;
    ASSERT_EQ(read.size(), message.size()) << path;
    for (std::size_t i = 0; i < message.size(); ++i) expect_same(read[i], message[i], path + "[]");
  } else if (message.is_string()) {
    EXPECT_EQ(read.as<std::string>(), message.get<std::string>()) << path;
  } else if (message.is_number_float()) {
    EXPECT_EQ(read.as<double>(), message.get<double>()) << path;
  } else {
    EXPECT_EQ(read.as<std::string>(), message.dump()) << path;
  }
}

TEST(SchemaYaml, YamlCppReadsTheSameValues) {
  for (const Struct& type : fivepipe_idl().structs)
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      const Json message =
          test::PayloadMaker(fivepipe_idl(), std::endian::little, seed).make(type.name).values;
      expect_same(YAML::Load(to_yaml(message)), message, type.name);
    }
}

}  // namespace
}  // namespace fivepipe::schema
