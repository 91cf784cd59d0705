// The fuzzer finds each kind of finding, and repeats it by its seed.
#include "tests/fuzz/runner.h"
#include "tests/support/test_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <vector>

namespace fivepipe::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr double kDuration_s = 60;  // a finding ends the run earlier
constexpr Limits kLimits{0.5, 20, std::size_t{300} * test::kSlowdown << 20};

std::vector<File> random_number(Random& random) {
  return {{"number", std::to_string(random() % 10)}};
}

int number_in(const fs::path& folder) {
  int number = -1;
  std::ifstream(folder / "number") >> number;
  return number;
}

class FuzzRunner : public ::testing::Test {
 protected:
  // Runs a target whose check does something wrong with one number of ten.
  Report run_with(Verdict (*check)(const fs::path&), double duration_s = kDuration_s,
                  const Limits& limits = kLimits, std::uint32_t min_inputs = 1) {
    const Report report =
        run({"made_up", "", random_number, check}, duration_s, min_inputs, 1, folder_, limits);
    if (!report.finding.empty()) {
      Random random(report.seed);
      const std::string again = random_number(random).front().bytes;
      std::ifstream kept(folder_ / ("fuzz_made_up_" + std::to_string(report.seed)) / "number");
      EXPECT_EQ(std::string(std::istreambuf_iterator<char>(kept), {}), again);
      EXPECT_EQ(again, "7");
    }
    return report;
  }

  const test::TestFolder test_folder_;
  const fs::path folder_ = test_folder_.path;
};

TEST_F(FuzzRunner, ReadsTheLeastNumberOfInputsHoweverLongItTakes) {
  const Report report = run_with(
      [](const fs::path&) {
        return Verdict{true, ""};
      },
      0.001, kLimits, 40);
  EXPECT_EQ(report.inputs, 40u);
}

TEST_F(FuzzRunner, CountsWhatIsAccepted) {
  const Report report = run_with(
      [](const fs::path& folder) {
        return Verdict{number_in(folder) < 5, ""};
      },
      0.5);
  EXPECT_EQ(report.finding, "");
  EXPECT_GT(report.inputs, 20u);
  EXPECT_GT(report.accepted, report.inputs / 4);
  EXPECT_LT(report.accepted, 3 * report.inputs / 4);
}

TEST_F(FuzzRunner, FindsABrokenInvariant) {
  const Report report = run_with([](const fs::path& folder) {
    return Verdict{true, number_in(folder) == 7 ? "seven" : ""};
  });
  EXPECT_EQ(report.finding, "seven");
}

TEST_F(FuzzRunner, FindsAnException) {
  const Report report = run_with([](const fs::path& folder) {
    if (number_in(folder) == 7) throw std::runtime_error("seven");
    return Verdict{};
  });
  EXPECT_EQ(report.finding, "exception: seven");
}

TEST_F(FuzzRunner, FindsACrash) {
  const Report report = run_with([](const fs::path& folder) {
    if (number_in(folder) == 7) raise(SIGKILL);  // which no sanitizer catches
    return Verdict{};
  });
  EXPECT_EQ(report.finding, "ended by signal 9");
}

TEST_F(FuzzRunner, FindsAnEndlessLoop) {
  const Report report = run_with([](const fs::path& folder) {
    volatile bool is_endless = number_in(folder) == 7;
    while (is_endless) {
    }
    return Verdict{};
  });
  EXPECT_EQ(report.finding, "needs more than 0.5 s of CPU time");
}

TEST_F(FuzzRunner, FindsTooMuchMemory) {
  Limits limits = kLimits;
  limits.cpu_s = 20;  // the memory limit is reached first
  const Report report = run_with(
      [](const fs::path& folder) {
        static std::vector<std::vector<char>> kept;
        // Pauses, so that the runner sees the memory before the machine has none left.
        for (; number_in(folder) == 7; ::usleep(5000)) kept.emplace_back(10 << 20, 'x');
        return Verdict{};
      },
      kDuration_s, limits);
  EXPECT_TRUE(report.finding.ends_with(" MiB")) << report.finding;
}

}  // namespace
}  // namespace fivepipe::fuzz
