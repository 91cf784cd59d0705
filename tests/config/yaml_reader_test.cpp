#include "common/config/yaml/yaml_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "common/config/yaml/key_suggestion.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;
using Strings = std::vector<std::string>;

class YamlReader : public test::SceneFiles {
 protected:
  YamlMap load(const std::string& text) { return YamlMap::load(write("a.yaml", text), problems_); }
  Strings problems() {
    return problems_of([&] { problems_.throw_if_any(); });
  }
  Problems problems_;
};

enum class Fruit { apple, pear };
const std::vector<std::pair<std::string, Fruit>> kFruits{{"apple", Fruit::apple},
                                                         {"pear", Fruit::pear}};

TEST_F(YamlReader, ReadsEachKindOfValue) {
  YamlMap map = load(R"(
number: -2.5e3
integer: -7
large: 9007199254740992
yes: true
no: false
text: some words
name: a_9
vector: [1, 2.5, -3]
colour: [0, 0.5, 1]
matrix: [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
size: [16384, 1]
list: [3, -1, 2]
none: []
fruit: pear
path: below/../file.txt
absolute: /tmp/../x
map: {key: 4}
maps: [{key: 5}, {key: 6}]
)");
  EXPECT_FALSE(map.is_void());
  EXPECT_EQ(map.number("number", kAny), -2500);
  EXPECT_EQ(map.integer("integer", kAny), -7);
  EXPECT_EQ(map.integer64("large", kAny), std::int64_t(1) << 53);
  EXPECT_TRUE(map.flag("yes"));
  EXPECT_FALSE(map.flag("no", true));
  EXPECT_EQ(map.text("text"), "some words");
  EXPECT_EQ(map.name("name"), "a_9");
  EXPECT_EQ(map.vector3("vector", kAny), Eigen::Vector3d(1, 2.5, -3));
  EXPECT_EQ(map.rgb("colour", {1, 1, 1}), (std::array<double, 3>{0, 0.5, 1}));
  EXPECT_EQ(map.matrix3("matrix"), (Eigen::Matrix3d() << 1, 2, 3, 4, 5, 6, 7, 8, 9).finished());
  EXPECT_EQ(map.size_px("size"), (std::array<int, 2>{16384, 1}));
  EXPECT_EQ(map.integers("list", kAny), (std::vector<int>{3, -1, 2}));
  EXPECT_EQ(map.integers("none", kAny), std::vector<int>{});
  EXPECT_EQ(map.choice("fruit", kFruits), Fruit::pear);
  EXPECT_EQ(map.path("path"), folder() / "file.txt");
  EXPECT_EQ(map.path("absolute"), "/tmp/../x");
  EXPECT_EQ(map.map("map").integer("key", kAny), 4);
  std::vector<YamlMap> maps = map.maps("maps");
  ASSERT_EQ(maps.size(), 2u);
  EXPECT_EQ(maps[0].integer("key", kAny), 5);
  EXPECT_EQ(maps[1].integer("key", kAny), 6);
  EXPECT_TRUE(map.is_text("text"));
  EXPECT_FALSE(map.is_text("list"));
  EXPECT_FALSE(map.is_text("absent"));
  EXPECT_TRUE(map.has("no"));
  map.finish();
  EXPECT_EQ(problems(), Strings{});
}

TEST_F(YamlReader, AMissingKeyReadsAsItsDefault) {
  YamlMap map = load("name: a\n");
  EXPECT_EQ(map.number("number", kAny, 1.5), 1.5);
  EXPECT_EQ(map.integer("integer", kAny, 3), 3);
  EXPECT_EQ(map.integer64("large", kAny, 4), 4);
  EXPECT_TRUE(map.flag("flag", true));
  EXPECT_EQ(map.text("text", "x"), "x");
  EXPECT_EQ(map.name("label", "y"), "y");
  EXPECT_EQ(map.vector3("vector", kAny, Eigen::Vector3d(1, 2, 3)), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(map.rgb("colour", {1, 0.5, 0}), (std::array<double, 3>{1, 0.5, 0}));
  EXPECT_EQ(map.size_px("size", std::array<int, 2>{8, 6}), (std::array<int, 2>{8, 6}));
  EXPECT_EQ(map.integers("list", kAny), std::vector<int>{});
  EXPECT_EQ(map.choice("fruit", kFruits, std::optional(Fruit::pear)), Fruit::pear);
  EXPECT_FALSE(map.has("absent"));
  EXPECT_EQ(map.name("name"), "a");
  map.finish();
  EXPECT_EQ(problems(), Strings{});
}

TEST_F(YamlReader, AMissingKeyWithoutADefaultIsAProblemAndReadsAsZero) {
  YamlMap map = load("other: a\n");
  EXPECT_EQ(map.number("number", kAny), 0);
  EXPECT_EQ(map.integer("integer", kAny), 0);
  EXPECT_EQ(map.integer64("large", kAny), 0);
  EXPECT_FALSE(map.flag("flag"));
  EXPECT_EQ(map.text("text"), "");
  EXPECT_EQ(map.name("label"), "");
  EXPECT_EQ(map.vector3("vector", kAny), Eigen::Vector3d::Zero());
  EXPECT_EQ(map.matrix3("matrix"), Eigen::Matrix3d::Identity());
  EXPECT_EQ(map.size_px("size"), (std::array<int, 2>{0, 0}));
  EXPECT_EQ(map.choice("fruit", kFruits), Fruit::apple);
  EXPECT_EQ(map.path("path"), "");
  EXPECT_TRUE(map.map("map").is_void());
  EXPECT_TRUE(map.maps("maps").empty());
  EXPECT_EQ(map.text("other"), "a");
  map.finish();
  EXPECT_THAT(
      problems(),
      ElementsAre(
          "a.yaml:1:1: flag is missing in the file",
          "a.yaml:1:1: fruit is missing in the file: set it to one of apple, pear",
          "a.yaml:1:1: integer is missing in the file", "a.yaml:1:1: label is missing in the file",
          "a.yaml:1:1: large is missing in the file", "a.yaml:1:1: map is missing in the file",
          "a.yaml:1:1: maps is missing in the file", "a.yaml:1:1: matrix is missing in the file",
          "a.yaml:1:1: number is missing in the file", "a.yaml:1:1: path is missing in the file",
          "a.yaml:1:1: size is missing in the file", "a.yaml:1:1: text is missing in the file",
          "a.yaml:1:1: vector is missing in the file"));
}

TEST_F(YamlReader, UnusableValuesAreProblemsAndReadAsTheirDefault) {
  YamlMap map = load(R"(
number: [1]
word: five
integer: 2147483648
negative: -2147483649
half: 1.5
large: 9007199254740994
small: -9007199254740994
flag: yes
flag_2: 1
text: {a: b}
name: A-b
empty: ""
long: abcdef
vector: [1, x, 3]
range: [1, 2, 30]
row: [[1, 0, 0], [0, 1], [0, 0, 2]]
rows: [1, 2]
size: [16385, 4]
size_2: 7
list: 4
list_2: [1, x, 3]
fruit: plum
path: ""
map: 3
maps: []
maps_2: [{a: 1}, 5]
nothing:
)");
  EXPECT_EQ(map.number("number", kAny, 5.0), 5);
  EXPECT_EQ(map.number("word", kAny), 0);
  EXPECT_EQ(map.integer("integer", kAny, 3), 3);
  EXPECT_EQ(map.integer("negative", kAny, 3), 3);
  EXPECT_EQ(map.integer("half", kAny), 0);
  EXPECT_EQ(map.integer64("large", kAny), 0);
  EXPECT_EQ(map.integer64("small", kAny), 0);
  EXPECT_FALSE(map.flag("flag"));
  EXPECT_TRUE(map.flag("flag_2", true));
  EXPECT_EQ(map.text("text", "z"), "z");
  map.name("name");
  map.name("empty");
  map.name("long", {}, 5);
  EXPECT_EQ(map.name("long", {}, 6), "abcdef");
  EXPECT_EQ(map.vector3("vector", kAny, Eigen::Vector3d(7, 8, 9)), Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(map.vector3("range", {1, 3}), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(map.matrix3("row"), (Eigen::Matrix3d() << 1, 0, 0, 0, 1, 0, 0, 0, 2).finished());
  EXPECT_EQ(map.matrix3("rows"), Eigen::Matrix3d::Identity());
  EXPECT_EQ(map.size_px("size"), (std::array<int, 2>{0, 4}));
  EXPECT_EQ(map.size_px("size_2", std::array<int, 2>{5, 6}), (std::array<int, 2>{5, 6}));
  EXPECT_EQ(map.integers("list", kAny), std::vector<int>{});
  EXPECT_EQ(map.integers("list_2", kAny), (std::vector<int>{1, 3}));
  EXPECT_EQ(map.choice("fruit", kFruits, std::optional(Fruit::pear)), Fruit::pear);
  EXPECT_EQ(map.path("path"), "");
  EXPECT_TRUE(map.map("map").is_void());
  EXPECT_TRUE(map.maps("maps").empty());
  EXPECT_EQ(map.maps("maps_2").size(), 2u);
  EXPECT_EQ(map.number("nothing", kAny, 6.0), 6);
  map.finish();
  EXPECT_THAT(
      problems(),
      ElementsAre(
          "a.yaml:1:9: number must be a single value, is a list of 1",
          "a.yaml:2:7: word must be a number, is \"five\"",
          "a.yaml:3:10: integer must be from -2147483648 to 2147483647, is 2147483648",
          "a.yaml:4:11: negative must be from -2147483648 to 2147483647, is -2147483649",
          "a.yaml:5:7: half must be a whole number, is 1.5",
          "a.yaml:6:8: large must be from -9.007199255e+15 to 9.007199255e+15, is 9007199254740994",
          "a.yaml:7:8: small must be from -9.007199255e+15 to 9.007199255e+15, is "
          "-9007199254740994",
          "a.yaml:8:7: flag must be true or false, is \"yes\"",
          "a.yaml:9:9: flag_2 must be true or false, is \"1\"",
          "a.yaml:10:7: text must be a single value, is a mapping",
          "a.yaml:11:7: name must consist of a-z, 0-9 and _, is \"A-b\"",
          "a.yaml:12:8: empty must consist of a-z, 0-9 and _, is \"\"",
          "a.yaml:13:7: long has 6 characters, the limit is 5",
          "a.yaml:14:13: vector[1] must be a number, is \"x\"",
          "a.yaml:15:15: range[2] must be from 1 to 3, is 30",
          "a.yaml:16:18: row[1] must be a list of 3, is a list of 2",
          "a.yaml:17:7: rows must be a list of 3, is a list of 2",
          "a.yaml:18:8: size[0] must be from 1 to 16384, is 16385",
          "a.yaml:19:9: size_2 must be a list of 2, is \"7\"",
          "a.yaml:20:7: list must be a list, is \"4\"",
          "a.yaml:21:13: list_2[1] must be a number, is \"x\"",
          "a.yaml:22:8: fruit must be one of apple, pear; is \"plum\"",
          "a.yaml:23:7: path must be a path, is empty",
          "a.yaml:24:6: map must be a mapping of keys to values, is \"3\"",
          "a.yaml:25:7: maps must be a list of at least one, is a list of 0",
          "a.yaml:26:18: maps_2[1] must be a mapping of keys to values, is \"5\"",
          "a.yaml:27:1: nothing has no value"));
}

TEST_F(YamlReader, KeysAreReportedWithTheirPlaces) {
  YamlMap map = load("a: 1\nb: 2\na: 3\n[x, y]: 4\nlengthy: 5\nzzzzzzzzzz: 6\nd:\n");
  map.number("a", kAny);
  map.number("b", kAny);
  map.number("lenghty", kAny);
  map.number("c_m", kAny);
  EXPECT_EQ(map.keys(), (Strings{"a", "b", "lengthy", "zzzzzzzzzz", "d"}));
  EXPECT_EQ(map.location_of("b").line, 2);
  EXPECT_EQ(map.location_of("b").column, 4);
  EXPECT_EQ(map.location_of("d").line, 7);
  EXPECT_EQ(map.location_of("d").column, 1);
  EXPECT_EQ(map.location_of("absent").line, 1);
  map.finish();
  EXPECT_THAT(problems(),
              ElementsAre("a.yaml:1:1: c_m is missing in the file",
                          "a.yaml:3:1: duplicate key a, already set in line 1",
                          "a.yaml:4:1: a key must be a single word, is a list of 2",
                          "a.yaml:5:1: unknown key lengthy: did you mean lenghty?",
                          "a.yaml:6:1: unknown key zzzzzzzzzz; known keys: a, b, lenghty, c_m",
                          "a.yaml:7:1: unknown key d; known keys: a, b, lenghty, c_m"));
}

TEST_F(YamlReader, FilesThatAreNoMappingsAreVoid) {
  const auto problem = [&](const std::string& text) {
    Problems problems;
    const YamlMap map = YamlMap::load(write("b.yaml", text), problems);
    EXPECT_TRUE(map.is_void());
    EXPECT_EQ(map.location().line, 0);
    const Strings found = problems_of([&] { problems.throw_if_any(); });
    return found.size() == 1 ? found[0] : std::to_string(found.size()) + " problems";
  };
  EXPECT_EQ(problem("- a\n"), "b.yaml:1:1: the file must contain a mapping of keys to values");
  EXPECT_EQ(problem(""), "b.yaml:1:1: the file must contain a mapping of keys to values");
  EXPECT_EQ(problem("a: 1\n---\nb: 2\n"),
            "b.yaml:2:1: the file contains a second YAML document: remove it");
  EXPECT_EQ(problem("a: [1\n").substr(0, 21), "b.yaml:2:1: not YAML:");
  EXPECT_EQ(problem(",\n"), "b.yaml:1:1: not YAML: a value cannot start with a comma");
  EXPECT_EQ(problem("a:\n  b: 1\n \tc: 2\n"),
            "b.yaml:3:2: not YAML: a tab cannot indent a line, use spaces");
  EXPECT_EQ(problem("a: [1,\n\t2]\nb: 1\nc: 2\nd: [3\n").find("a tab"), std::string::npos)
      << "the error is elsewhere";
}

// A mapping that is missing or has another type is one problem, whatever is read from it.
TEST_F(YamlReader, AVoidMappingReadsAsEmptyWithoutFurtherProblems) {
  YamlMap file = load("list: [a, {b: 1}]\ntext: c\nnothing:\nmaps: [[1, 2]]\n");
  std::vector<YamlMap> maps = file.maps("maps");
  for (const std::string key : {"list", "text", "nothing", "absent"}) maps.push_back(file.map(key));
  for (YamlMap& map : maps) {
    EXPECT_TRUE(map.is_void());
    EXPECT_EQ(map.number("a", kAny), 0);
    EXPECT_EQ(map.maps("b").size(), 0u);
    EXPECT_FALSE(map.has("a"));
    EXPECT_FALSE(map.is_text("a"));
    EXPECT_EQ(map.keys(), Strings{});
    EXPECT_EQ(map.location().line, 0);
    EXPECT_EQ(map.location().column, 0);
    EXPECT_EQ(map.location_of("a").line, 0);
    map.finish();
    map.report_missing();
  }
  file.finish();
  EXPECT_THAT(problems(),
              ElementsAre("a.yaml:1:1: absent is missing in the file",
                          "a.yaml:1:7: list must be a mapping of keys to values, is a list of 2",
                          "a.yaml:2:7: text must be a mapping of keys to values, is \"c\"",
                          "a.yaml:3:1: nothing has no value",
                          "a.yaml:4:8: maps[0] must be a mapping of keys to values, is a list of "
                          "2"));
}

class SettingsOfAFile : public test::SceneFiles {
 protected:
  Settings settings(const std::map<std::string, std::string>& overrides) {
    return Settings("d.yaml", {1, 1},
                    {{"rate", {"12", false, {2, 3}}},
                     {"place", {"sub", false, {3, 3}}},
                     {"data", {"", false, {4, 3}}},
                     {"name", {"", false, {5, 3}}},
                     {"tag", {"", false, {6, 3}}}},
                    overrides, problems_);
  }
  Strings problems() {
    return problems_of([&] { problems_.throw_if_any(); });
  }
  Problems problems_;
};

TEST_F(SettingsOfAFile, AreReplacedWhereverTheyAppear) {
  Settings of_file = settings({{"place", "here"}});
  const auto expanded = [&](const std::string& text) {
    const Settings::Expanded result = of_file.expand(text, {7, 8}, problems_);
    EXPECT_TRUE(result.usable) << text;
    return std::pair(result.text, result.starts_on_command_line);
  };
  using Result = std::pair<std::string, bool>;
  EXPECT_EQ(expanded(""), Result("", false));
  EXPECT_EQ(expanded("none"), Result("none", false));
  EXPECT_EQ(expanded("${rate}"), Result("12", false));
  EXPECT_EQ(expanded("${place}/${rate}"), Result("here/12", true));
  EXPECT_EQ(expanded("${rate}${place}x"), Result("12herex", false));
  EXPECT_EQ(expanded("a ${place} b $ {} }"), Result("a here b $ {} }", false));
  EXPECT_EQ(problems(), Strings{});
}

TEST_F(SettingsOfAFile, UnusableOnesAreProblems) {
  Settings of_file = settings({{"speed", "3"}});
  for (const std::string text :
       {"${data}/x", "${data}/y", "a/${name}", "${tag}.png", "${where}", "x${rate"})
    EXPECT_FALSE(of_file.expand(text, {7, 8}, problems_).usable) << text;
  const std::string known = "unknown setting; known settings: data, name, place, rate, tag";
  EXPECT_THAT(problems(),
              ElementsAre("d.yaml:1:1: --set speed: " + known,
                          "d.yaml:4:3: data is not set: pass --set data=FOLDER",
                          "d.yaml:5:3: name is not set: pass --set name=VALUE",
                          "d.yaml:6:3: tag is not set: pass --set tag=VALUE",
                          "d.yaml:7:8: ${where}: " + known, "d.yaml:7:8: ${ without a closing }"));
}

TEST(ProblemList, IsSortedByPlaceInTheOrderOfTheFiles) {
  Problems problems;
  EXPECT_NO_THROW(problems.throw_if_any());
  problems.add("b", {3, 1}, "third");
  problems.add("a", {1, 1}, "of the second file");
  problems.add("b", {2, 5}, "second");
  problems.add("b", {2, 4}, "first");
  problems.add("b", {2, 5}, "second");
  problems.add("b", {2, 5}, "another one there");
  problems.add("c", {}, "without a place");
  EXPECT_EQ(problems.count(), 6u);
  try {
    problems.throw_if_any();
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(),
                 "b:2:4: first\nb:2:5: second\nb:2:5: another one there\nb:3:1: third\n"
                 "a:1:1: of the second file\nc: without a place");
    EXPECT_EQ(error.problems().back().line, 0);
    EXPECT_EQ(error.problems().back().column, 0);
  }
}

TEST(ProblemList, AProblemWithoutAPlaceNamesItsFileOnly) {
  const ConfigProblem problem{.file = "a", .what = "b"};
  const ConfigError error(std::vector<ConfigProblem>{problem});
  EXPECT_STREQ(error.what(), "a: b");
  EXPECT_EQ(error.problems().at(0).column, 0);
}

TEST(KeySuggestionOfUnits, AUnitAloneIsNoQuantity) {
  const auto suggestion = suggest_key("_m", {"_s"});
  ASSERT_TRUE(suggestion);
  EXPECT_FALSE(suggestion->unit_differs);
  EXPECT_EQ(suggest_key("x_m", {"x_m_s2", "y_m"})->key, "x_m_s2");
  EXPECT_TRUE(suggest_key("x_m", {"x_m_s2", "y_m"})->unit_differs);
}

TEST(NearestWord, IsWithinTwoEditsOrAThirdOfTheLength) {
  const auto nearest = [](const std::string& word, const Strings& known) {
    return nearest_word(word, known).value_or("none");
  };
  EXPECT_EQ(nearest("abcd", {"abxy"}), "abxy");
  EXPECT_EQ(nearest("abcd", {"axyz"}), "none");
  EXPECT_EQ(nearest("abcdefghijkl", {"abcdefgh1234"}), "abcdefgh1234");
  EXPECT_EQ(nearest("abcdefghijkl", {"abcdefg12345"}), "none");
  EXPECT_EQ(nearest("abcd", {"abxy", "abcx", "abxd"}), "abcx") << "the first of the nearest";
  EXPECT_EQ(nearest("abcd", {"bcd", "abcde"}), "bcd");
  EXPECT_EQ(nearest("kitten", {"sitting"}), "none");
  EXPECT_EQ(nearest("kittens", {"sitten"}), "sitten");
  EXPECT_EQ(nearest("a", {"b", "bc"}), "none") << "no letter is the same";
  EXPECT_EQ(nearest("xyz", {"ab", "xz"}), "xz");
}

TEST(Numbers, AreParsedInYamlsForms) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const auto& [text, value] : {std::pair<std::string, double>{"1.5", 1.5},
                                    {"+2", 2},
                                    {"-3e2", -300},
                                    {".inf", infinity},
                                    {"-.INF", infinity},
                                    {"inf", infinity},
                                    {"Infinity", infinity},
                                    {"1e999", infinity}}) {
    const ParsedNumber number = parse_number(text);
    EXPECT_TRUE(number.is_number) << text;
    // The reader refuses infinity, so its sign does not matter.
    EXPECT_EQ(std::isfinite(value) ? number.value : std::abs(number.value), value) << text;
  }
  for (const std::string text : {".nan", "NaN", "-nan"}) {
    EXPECT_TRUE(parse_number(text).is_number) << text;
    EXPECT_TRUE(std::isnan(parse_number(text).value)) << text;
  }
  for (const std::string text : {"", "-", "+", "--1", "+-1", "1x", "x", "0x10", "1 2", ".infx"})
    EXPECT_FALSE(parse_number(text).is_number) << text;
}

TEST(Numbers, RangesDescribeAndTestTheirBounds) {
  EXPECT_EQ(text_of({-kUnbounded, 3}), "at most 3");
  EXPECT_EQ(text_of({2, kUnbounded}), "at least 2");
  EXPECT_EQ(text_of({2, kUnbounded, true}), "greater than 2");
  EXPECT_EQ(text_of({2, 3}), "from 2 to 3");
  EXPECT_EQ(text_of({2, 3, true}), "greater than 2 and at most 3");
  EXPECT_TRUE(contains({2, 3}, 2) && contains({2, 3}, 3) && contains({2, 3, true}, 3));
  EXPECT_FALSE(contains({2, 3}, 1.999) || contains({2, 3}, 3.001) || contains({2, 3, true}, 2));
  EXPECT_FALSE(contains(kAny, std::nan("")));
}

}  // namespace
}  // namespace fivepipe::config
