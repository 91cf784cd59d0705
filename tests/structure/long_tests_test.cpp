// A test source that reads FIVEPIPE_LONG has a long test that sets it, and each long test has a
// source that reads it. Compares the sources with what CMake generated for the compiler and ctest.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/support/source_text.h"

namespace fivepipe::test {
namespace {

namespace fs = std::filesystem;

const fs::path kTests = kRoot / "tests", kBuild = fs::path(FIVEPIPE_BINARY_DIR).parent_path();

bool reads_long(const fs::path& file) {
  static const std::regex kRead(R"(getenv\(\s*"FIVEPIPE_LONG"\s*\))");
  return std::regex_search(text_of(file), kRead);
}

// Returns the sources that a generated file of the unity build includes, or else `file` itself.
std::vector<fs::path> sources_of(const fs::path& file) {
  if (!file.filename().string().starts_with("unity_")) return {file};
  static const std::regex kInclude("#include \"([^\"]+)\"");
  const std::string text = text_of(file);
  std::vector<fs::path> sources;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), kInclude);
       it != std::sregex_iterator(); ++it)
    sources.emplace_back((*it)[1].str());
  return sources;
}

// The programs that compile each source.
std::map<fs::path, std::set<std::string>> programs_by_source() {
  static const std::regex kProgram(R"(CMakeFiles/([\w]+)\.dir/)");
  std::map<fs::path, std::set<std::string>> programs;
  for (const auto& command : nlohmann::json::parse(text_of(kBuild / "compile_commands.json"))) {
    const std::string text = command.at("command");
    std::smatch program;
    const std::size_t object = text.rfind(" -o ");
    if (object == std::string::npos) continue;
    const std::string output = text.substr(object);
    if (std::regex_search(output, program, kProgram))
      for (const fs::path& source : sources_of(command.at("file").get<std::string>()))
        programs[source].insert(program[1]);
  }
  return programs;
}

struct LongTest {
  std::string program;
  bool sets_long = false, has_label = false, has_timeout = false;
};

// The tests of ctest whose name begins with Long_.
std::map<std::string, LongTest> long_tests() {
  static const std::regex kTest(R"re(add_test\(\[=\[(Long_\w+)\]=\] "[^"]*/(\w+)"\))re"),
      kProperties(R"(set_tests_properties\(\[=\[(Long_\w+)\]=\] PROPERTIES ([^\n]*))");
  std::map<std::string, LongTest> tests;
  for (const auto& entry : fs::recursive_directory_iterator(kBuild / "tests")) {
    if (entry.path().filename() != "CTestTestfile.cmake") continue;
    const std::string text = text_of(entry.path());
    for (auto it = std::sregex_iterator(text.begin(), text.end(), kTest);
         it != std::sregex_iterator(); ++it)
      tests[(*it)[1]].program = (*it)[2];
    for (auto it = std::sregex_iterator(text.begin(), text.end(), kProperties);
         it != std::sregex_iterator(); ++it) {
      const std::string properties = (*it)[2];
      LongTest& test = tests[(*it)[1]];
      test.sets_long = properties.find("\"FIVEPIPE_LONG=1\"") != std::string::npos;
      test.has_label = properties.find("LABELS \"long\"") != std::string::npos;
      test.has_timeout = properties.find("TIMEOUT ") != std::string::npos;
    }
  }
  return tests;
}

TEST(LongTests, RunEveryProgramThatReadsFivepipeLong) {
  std::set<std::string> readers, run;
  const auto programs = programs_by_source();
  for (const auto& entry : fs::recursive_directory_iterator(kTests)) {
    const fs::path& file = entry.path();
    if (file.extension() == ".h") {
      EXPECT_FALSE(reads_long(file)) << file << ": read FIVEPIPE_LONG in the test's source";
    }
    if (file.extension() != ".cpp" || !reads_long(file)) continue;
    // Without the nodes, CMake compiles only a part of the tests.
    if (const auto found = programs.find(file); found != programs.end())
      readers.insert(found->second.begin(), found->second.end());
  }
  EXPECT_GE(readers.size(), 5u);
  for (const auto& [name, test] : long_tests()) {
    EXPECT_TRUE(test.sets_long && test.has_label && test.has_timeout)
        << name << " needs ENVIRONMENT FIVEPIPE_LONG=1, LABELS long and a TIMEOUT";
    EXPECT_TRUE(readers.contains(test.program))
        << name << " runs what the quick tests run: no source of " << test.program
        << " reads FIVEPIPE_LONG";
    run.insert(test.program);
  }
  for (const std::string& program : readers)
    EXPECT_TRUE(run.contains(program))
        << program << " reads FIVEPIPE_LONG, but no long test runs it; add it by "
        << "fivepipe_long_test() beside its fivepipe_test()";
}

}  // namespace
}  // namespace fivepipe::test
