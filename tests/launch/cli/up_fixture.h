// Runs `fivepipe up` as a process; small programs replace the nodes.
#pragma once
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/deployments.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"

namespace fivepipe::test {

class Up : public testing::Test {
 protected:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kTimeout{30};

  const std::vector<std::string> nodes_ = {"capture", "recon_a", "recon_b", "simulation",
                                           "rendering"};  // of demo.yaml
  const std::uint32_t domain_ = own_domain();
  const TestFolder test_folder_;
  const std::filesystem::path folder_ = test_folder_.path;

  // `up` finds the nodes in the folder of its own program.
  void SetUp() override {
    std::filesystem::copy_file(FIVEPIPE_BINARY_DIR "/fivepipe", folder_ / "fivepipe");
    write_nodes("echo pid $$ args \"$@\"\nexec sleep 1000\n");
  }

  void write_program(const std::string& name, const std::string& script) const {
    std::ofstream(folder_ / name) << "#!/bin/sh\n" << script;
    std::filesystem::permissions(folder_ / name, std::filesystem::perms::owner_all);
  }
  // The arguments of a node are --deployment $2 --node $4 --out $6 --domain $8.
  void write_nodes(const std::string& script) const {
    for (const char* program : {"capture_node", "recon_node", "sim_node", "render_node"})
      write_program(program, script);
  }
  // Nodes that publish statuses; render_node also composites.
  void write_publishing_nodes() const {
    const std::string script =
        "echo pid $$\nexec " FIVEPIPE_BINARY_DIR "/status_writer \"$4\" \"$8\"";
    write_nodes(script + "\n");
    write_program("render_node", script + " viewer\n");
  }

  std::vector<std::string> up_words(const std::string& out, std::uint32_t domain,
                                    const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {folder_ / "fivepipe",
                                      "up",
                                      FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml",
                                      "--out",
                                      folder_ / out,
                                      "--domain",
                                      std::to_string(domain)};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  // Starts `up` with the folder `out` below the fixture's; its output goes to the file `said`.
  Program& start_up(const std::string& out = "out", const std::vector<std::string>& more = {},
                    const std::string& said = "said") {
    return start(up_words(out, domain_, more), said);
  }
  Program& start(const std::vector<std::string>& words, const std::string& said) {
    started_.push_back(std::make_unique<Program>(words, folder_ / said));
    return *started_.back();
  }

  // Starts a program whose stdout and stderr go to `head -n 1`, which ends after a line. That line
  // is said().
  Program& start_into_head(const std::vector<std::string>& words, const std::string& said) {
    std::vector<std::string> all = {"/bin/bash", "-c", "exec \"$@\" > >(exec head -n 1) 2>&1",
                                    "bash"};
    all.insert(all.end(), words.begin(), words.end());
    return start(all, said);
  }

  static bool wait_for(const std::function<bool()>& condition) {
    const auto until = Clock::now() + kTimeout;
    while (!condition()) {
      if (Clock::now() > until) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }
  static bool says(const Program& program, const std::string& part) {
    return wait_for([&] { return program.said().find(part) != std::string::npos; });
  }

  std::string log_of(const std::string& node) const {
    return text_of(folder_ / "out" / "log" / (node + ".log"));
  }
  bool all_nodes_run() const {
    return wait_for([&] {
      return std::all_of(nodes_.begin(), nodes_.end(), [&](const std::string& node) {
        return log_of(node).find('\n') != std::string::npos;
      });
    });
  }
  pid_t pid_of(const std::string& node) const { return std::stoi(log_of(node).substr(4)); }
  nlohmann::json report(const std::string& out = "out") const {
    return nlohmann::json::parse(text_of(folder_ / out / "report.json"));
  }

 private:
  std::vector<std::unique_ptr<Program>> started_;
};

}  // namespace fivepipe::test
