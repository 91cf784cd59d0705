// Each pattern of PAIRED_TESTS, ALONE_TESTS and LONG_TESTS matches a test: a test that was renamed
// must not lose the machine that it needs for itself. A program with LONG_TESTS has a long test,
// which runs them.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/support/source_text.h"

namespace fivepipe::test {
namespace {

namespace fs = std::filesystem;

// The patterns of a CMakeLists.txt. `Suite.Name`, where `*` is any text.
std::vector<std::string> patterns_of(const std::string& cmake) {
  static const std::regex kList(
      R"((?:PAIRED|ALONE|LONG)_TESTS\s+([^()]*?)\s+(?=LINK|\w+_TESTS\b))"),
      kPattern(R"(\S+)");
  std::vector<std::string> patterns;
  for (auto list = std::sregex_iterator(cmake.begin(), cmake.end(), kList);
       list != std::sregex_iterator(); ++list) {
    const std::string text = (*list)[1];
    for (auto it = std::sregex_iterator(text.begin(), text.end(), kPattern);
         it != std::sregex_iterator(); ++it)
      patterns.push_back(it->str());
  }
  return patterns;
}

std::regex regex_of(const std::string& pattern) {
  std::string text;
  for (const char c : pattern) text += c == '.' ? "\\." : c == '*' ? ".*" : std::string(1, c);
  return std::regex(text);
}

// The tests of the sources in a folder, as GoogleTest names them.
std::vector<std::string> tests_in(const fs::path& folder) {
  static const std::regex kTest(R"(\nTEST(?:_F)?\(\s*(\w+),\s*(\w+)\))");
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".cpp") continue;
    const std::string text = text_of(entry.path());
    for (auto it = std::sregex_iterator(text.begin(), text.end(), kTest);
         it != std::sregex_iterator(); ++it)
      names.push_back((*it)[1].str() + "." + (*it)[2].str());
  }
  return names;
}

TEST(AloneTests, EachPatternMatchesATestOfItsFolder) {
  std::size_t patterns = 0;
  std::set<std::string> seen;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "tests")) {
    if (entry.path().filename() != "CMakeLists.txt") continue;
    const std::vector<std::string> tests = tests_in(entry.path().parent_path());
    for (const std::string& pattern : patterns_of(text_of(entry.path()))) {
      ++patterns;
      EXPECT_TRUE(seen.insert(pattern).second) << pattern << " is in two lists";
      EXPECT_TRUE(std::ranges::any_of(
          tests,
          [regex = regex_of(pattern)](const auto& test) { return regex_match(test, regex); }))
          << entry.path() << ": " << pattern << " matches no test of this folder";
    }
  }
  EXPECT_GE(patterns, 10u);
}

TEST(LongTestsOfAProgram, AreRunByItsLongTest) {
  static const std::regex kProgram(R"(fivepipe_test\((\w+)[^()]*LONG_TESTS)");
  static const std::regex kList(R"(\bLONG_TESTS\b)");
  std::size_t programs = 0, lists = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "tests")) {
    if (entry.path().filename() != "CMakeLists.txt") continue;
    const std::string cmake = text_of(entry.path());
    lists +=
        std::size_t(std::distance(std::sregex_iterator(cmake.begin(), cmake.end(), kList), {}));
    for (auto it = std::sregex_iterator(cmake.begin(), cmake.end(), kProgram);
         it != std::sregex_iterator(); ++it) {
      ++programs;
      const std::string program = (*it)[1], name = program.substr(0, program.rfind("_test"));
      // By its own name, or that of a loop over programs.
      const std::regex by_name("fivepipe_long_test\\(" + name + "\\b"),
          in_loop("foreach\\(test[^()]*\\b" + name.substr(name.find('_') + 1) +
                  "\\b[^()]*\\)\\s*fivepipe_long_test\\(\\$\\{test\\}");
      EXPECT_TRUE(std::regex_search(cmake, by_name) || std::regex_search(cmake, in_loop))
          << entry.path() << ": " << program << " needs fivepipe_long_test()";
    }
  }
  EXPECT_EQ(programs, lists) << "each list is that of a program that this test has found";
  EXPECT_GE(programs, 3u);
}

}  // namespace
}  // namespace fivepipe::test
