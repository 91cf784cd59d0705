// Opens pages in headless Chromium, for tests.
#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/process/shell.h"

namespace fivepipe::test {

// Returns the program's path, or nothing if it is not installed.
inline std::string program_in_path(const std::string& name) {
  std::istringstream folders(std::getenv("PATH") != nullptr ? std::getenv("PATH") : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (std::filesystem::exists(folder + "/" + name)) return folder + "/" + name;
  return "";
}
inline std::string chromium() { return program_in_path("chromium"); }

// Returns what the command prints. The test fails if the command does.
inline std::string output_of(const std::string& command) {
  const ShellAnswer answer = shell(command);
  EXPECT_EQ(answer.exit_code, 0) << command;
  return answer.text;
}

// Runs browser.py with these options on the pages.
inline std::string browse(const std::string& options,
                          const std::vector<std::filesystem::path>& pages) {
  std::string command = "python3 " FIVEPIPE_SOURCE_DIR
                        "/tests/study/report/browser.py --timeout 100 --chromium " +
                        chromium() + " " + options;
  for (const std::filesystem::path& page : pages) command += " '" + page.string() + "'";
  return output_of(command);
}

// Returns what browser.py and checks.js found on each of the pages.
inline std::vector<nlohmann::json> visits(const std::vector<std::filesystem::path>& pages) {
  std::istringstream lines(
      browse("--size 1000,800 --run " FIVEPIPE_SOURCE_DIR "/tests/study/report/checks.js", pages));
  std::vector<nlohmann::json> found;
  for (std::string line; std::getline(lines, line);) found.push_back(nlohmann::json::parse(line));
  EXPECT_EQ(found.size(), pages.size());
  found.resize(pages.size());
  return found;
}

// Checks that the page needed no other file and that no script of it failed.
inline void expect_no_request_or_error(const nlohmann::json& visit) {
  for (const std::string url : visit["requests"])
    EXPECT_TRUE(url.starts_with("file:///") || url.starts_with("data:image/png")) << url;
  EXPECT_EQ(visit["errors"], nlohmann::json::array()) << visit["errors"];
  EXPECT_EQ(visit["value"]["error"], "");
}

}  // namespace fivepipe::test
