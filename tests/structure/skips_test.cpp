// A test that needs something of its machine skips by FIVEPIPE_SKIP_WITHOUT_PACKAGE, so that it
// fails in CI. GTEST_SKIP is only for what CI cannot have.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <string>

#include "tests/support/source_text.h"

namespace fivepipe::test {
namespace {

namespace fs = std::filesystem;

// Conditions under which a test may be skipped in CI: recorded footage, which the repository does
// not contain; a run with a sanitizer, which also runs without one; the long run, which is a test
// of its own; and a driver's limit.
bool may_skip_in_ci(const std::string& condition) {
  static const std::regex kAllowed(
      R"re(!(std::filesystem|fs)::exists\((kRecording|recording|kData|kFootage)\))re"
      R"re(|(test::)?kHasSanitizer|!(test::)?kCanThrowWithoutFiles)re"
      R"re(|!std::getenv\("FIVEPIPE_LONG"\)|max_bytes > GLint64\{1\} << 28)re");
  return std::regex_match(condition, kAllowed);
}

TEST(Skips, NoTestIsSkippedInCiForWantOfSomething) {
  static const std::regex kSkip(R"((?:if \((.*)\)\s+)?GTEST_SKIP\(\))");
  int skips = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "tests")) {
    const std::string name = entry.path().filename();
    if (!name.ends_with(".cpp") && !name.ends_with(".h")) continue;
    if (name == "optional_package.h" || name == "skips_test.cpp") continue;
    const std::string text = text_of(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), kSkip), end; at != end; ++at) {
      ++skips;
      EXPECT_TRUE(may_skip_in_ci((*at)[1]))
          << entry.path() << ": use FIVEPIPE_SKIP_WITHOUT_PACKAGE: " << at->str();
    }
  }
  EXPECT_GT(skips, 5);
}

TEST(Skips, ConditionsOfTheMachineAreNone) {
  EXPECT_TRUE(may_skip_in_ci("kHasSanitizer"));
  for (const char* condition : {"geteuid() != 0", "", "std::thread::hardware_concurrency() < 2",
                                "kHasSanitizer || geteuid() != 0"})
    EXPECT_FALSE(may_skip_in_ci(condition)) << condition;
}

}  // namespace
}  // namespace fivepipe::test
