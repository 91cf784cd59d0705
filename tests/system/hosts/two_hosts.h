// Two hosts with the small deployment, for tests with real processes.
#pragma once
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/base/realtime.h"
#include "common/pipeline/bus/profile.h"
#include "tests/support/deployments.h"
#include "tests/support/optional_package.h"
#include "tests/support/process/test_hosts.h"
#include "tests/support/recording/recordings.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::test {

class TwoHosts : public testing::Test {
 protected:
  void SetUp() override {
    if (!hosts_.why_not().empty()) FIVEPIPE_SKIP_WITHOUT_PACKAGE(hosts_.why_not());
  }
  // The small deployment with these nodes on alpha and the others on beta.
  std::string deployment(const std::string& alpha_interface = "",
                         const std::string& profile = "lan",
                         const std::set<std::string>& on_alpha = {"capture"}) {
    std::string text = text_of(changed_deployment(
        folder_.path / "files", "nodes:\n",
        "network_profile: " + profile + "\nhosts:\n  alpha: {address: " + TestHosts::address(0) +
            alpha_interface + "}\n  beta: {address: " + TestHosts::address(1) + "}\nnodes:\n"));
    for (const std::string& node : kNodes)
      text = replaced(
          text, "{name: " + node + ",",
          "{name: " + node + ", host: " + (on_alpha.contains(node) ? "alpha" : "beta") + ",");
    const std::filesystem::path file = folder_.path / "files" / "lab.yaml";
    std::ofstream(file) << text;
    return file.string();
  }
  // Runs `fivepipe` on a host whose clock is ahead by clock_ms. The log has the name of the host.
  std::unique_ptr<Program> fivepipe(int host, const std::vector<std::string>& arguments,
                                    int clock_ms = 0) {
    std::vector<std::string> words{"/usr/bin/env",
                                   base::kTestClockVariable + ("=" + std::to_string(clock_ms)),
                                   FIVEPIPE_BINARY_DIR "/fivepipe"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return std::make_unique<Program>(hosts_.in(host, words), folder_.path / (name(host) + ".log"));
  }
  std::unique_ptr<Program> up(int host, const std::string& file,
                              const std::vector<std::string>& more = {}, int clock_ms = 0) {
    std::vector<std::string> words{"up", file,    "--domain",
                                   "0",  "--out", (folder_.path / name(host)).string()};
    words.insert(words.end(), more.begin(), more.end());
    return fivepipe(host, words, clock_ms);
  }
  // Of a program that listens from outside the hosts.
  static bus::Network observer_network() {
    bus::Network network("lan");
    network.interface = TestHosts::kObserver;
    network.peers = {TestHosts::address(0), TestHosts::address(1), TestHosts::kObserver};
    return network;
  }
  static std::string name(int host) { return host == 0 ? "alpha" : "beta"; }
  static bool holds(std::chrono::seconds timeout, const std::function<bool()>& condition) {
    const auto until = std::chrono::steady_clock::now() + timeout * kSlowdown;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > until) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return true;
  }

  // Runs the deployment for this time; returns the report of the host that composites.
  nlohmann::json report_of_run(const std::string& file, int duration_s) {
    const auto alpha = up(0, file), beta = up(1, file, {"--duration", std::to_string(duration_s)});
    EXPECT_EQ(beta->wait_for_end(std::chrono::seconds(90) * kSlowdown), 0)
        << beta->said() << alpha->said();
    alpha->signal(SIGINT);
    EXPECT_EQ(alpha->wait_for_end(std::chrono::seconds(5) * kSlowdown), 130) << alpha->said();
    return nlohmann::json::parse(std::ifstream(folder_.path / "beta/report.json"));
  }

  const TestFolder folder_;
  TestHosts hosts_{2, folder_.path};
};

}  // namespace fivepipe::test
