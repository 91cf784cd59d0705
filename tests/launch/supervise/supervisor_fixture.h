// Runs the supervisor with real processes: small shell scripts replace the nodes.
#pragma once
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "launch/supervise/supervisor.h"
#include "tests/support/test_folder.h"

namespace fivepipe::test {

using Clock = std::chrono::steady_clock;
// Maximum wait for events that should happen immediately. It is long because test machines are
// busy.
inline constexpr std::chrono::seconds kTimeout{30};

class SupervisorTest : public testing::Test {
 protected:
  const TestFolder test_folder;
  const std::filesystem::path folder = test_folder.path;
  std::vector<std::string> events, lines;

  launch::Program node(const std::string& name, const std::string& script) {
    return {name, {"/bin/sh", "-c", script}, {}, folder / "log" / (name + ".log")};
  }

  launch::SupervisorOutput output() {
    return {.line = [this](const std::string& name,
                           const std::string& line) { lines.push_back(name + ": " + line); },
            .event = [this](const std::string& text) { events.push_back(text); }};
  }

  bool said(const std::string& part) const {
    return std::any_of(events.begin(), events.end(), [&](const std::string& text) {
      return text.find(part) != std::string::npos;
    });
  }
  bool printed(const std::string& line) const {
    return std::find(lines.begin(), lines.end(), line) != lines.end();
  }

  // Steps until the condition holds. Returns false after kTimeout.
  template <class Condition>
  static bool step_until(launch::Supervisor& supervisor, Condition condition) {
    const auto until = Clock::now() + kTimeout;
    while (!condition()) {
      if (Clock::now() > until) return false;
      supervisor.step(std::chrono::milliseconds(20));
    }
    return true;
  }
};

// exec replaces the shell, so that signals reach the sleep and no process outlives it.
inline const std::string kRunsForever = "echo up; exec sleep 1000";
inline const std::string kIgnoresSigterm = "trap '' TERM; echo up; exec sleep 1000";

inline bool exists(pid_t pid) { return kill(pid, 0) == 0; }

}  // namespace fivepipe::test
