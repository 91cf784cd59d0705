#include "common/base/result_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/machine.h"
#include "common/base/version.h"
#include "tests/support/source_text.h"

namespace fivepipe::base {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

std::filesystem::path test_folder() {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) /
      testing::UnitTest::GetInstance()->current_test_info()->name();
  std::filesystem::remove_all(folder);
  return folder;
}

TEST(ResultFile, HoldsMachineCommitAndResults) {
  const std::filesystem::path file = test_folder() / "new" / "results.json";
  const ordered_json results =
      ordered_json::array({{{"name", "a \"quoted\"\nname"}, {"time_ms", times_json({3, 1, 2})}}});
  write_json(file, suite_json("hull", "llvmpipe", results));
  const json read = json::parse(test::text_of(file));
  EXPECT_EQ(read["suite"], "hull");
  EXPECT_EQ(read["commit"], commit());
  EXPECT_EQ(read["machine"]["cpu"], cpu_name());
  EXPECT_EQ(read["machine"]["gl_renderer"], "llvmpipe");
  EXPECT_EQ(read["machine"]["build_type"], build_type());
  EXPECT_TRUE(read["machine"]["cores"].is_number_unsigned());
  ASSERT_EQ(read["results"].size(), 1u);
  EXPECT_EQ(read["results"][0]["name"], "a \"quoted\"\nname");
  EXPECT_EQ(read["results"][0]["time_ms"],
            json({{"best", 1.0}, {"median", 2.0}, {"p95", 3.0}, {"p99", 3.0}, {"runs", 3}}));
}

TEST(ResultFile, TimesAreTheNearestRanksOfAThousand) {
  std::vector<double> time_ms;
  for (int i = 1000; i > 0; --i) time_ms.push_back(i);
  EXPECT_EQ(
      json(times_json(time_ms)),
      json({{"best", 1.0}, {"median", 500.0}, {"p95", 950.0}, {"p99", 990.0}, {"runs", 1000}}));
}

TEST(ResultFile, JsonIsIndentedByOneAndEndsWithANewline) {
  const std::filesystem::path file = test_folder() / "indented.json";
  write_json(file, ordered_json{{"b", {{"c", 1}}}, {"a", 2}});
  EXPECT_EQ(test::text_of(file), "{\n \"b\": {\n  \"c\": 1\n },\n \"a\": 2\n}\n");
}

TEST(ResultFile, MachineLineNamesCpuCoresRendererAndBuild) {
  EXPECT_EQ(machine_line("llvmpipe"), cpu_name() + ", " + std::to_string(core_count()) +
                                          " cores, llvmpipe, build " + build_type() + " " +
                                          commit());
  EXPECT_EQ(machine_line(""), cpu_name() + ", " + std::to_string(core_count()) + " cores, build " +
                                  build_type() + " " + commit());
}

TEST(ResultFile, AFileNameAloneIsInTheWorkingDirectory) {
  const std::filesystem::path folder = test_folder(), before = std::filesystem::current_path();
  std::filesystem::create_directories(folder);
  std::filesystem::current_path(folder);
  EXPECT_NO_THROW(write_file("alone", "text"));
  std::filesystem::current_path(before);
  EXPECT_EQ(std::filesystem::file_size(folder / "alone"), 4u);
}

TEST(ResultFile, ReportsAFileThatCannotBeWritten) {
  const std::filesystem::path folder = test_folder();
  std::filesystem::create_directories(folder);
  EXPECT_THROW(write_file(folder, "text"), std::runtime_error);
  write_file(folder / "file", "text");
  EXPECT_THROW(write_file(folder / "file" / "below", "text"), std::runtime_error);
}

}  // namespace
}  // namespace fivepipe::base
