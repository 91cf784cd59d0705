// A deployment run by the real `fivepipe up`, for tests: started in a domain of its own, watched through the bus, always ended.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/bus.h"

namespace fivepipe::test {

class Deployed {
 public:
  // Starts `fivepipe up DEPLOYMENT --domain DOMAIN --out OUT` with more arguments.
  Deployed(const std::string& deployment, std::uint32_t domain, const std::filesystem::path& out, const std::vector<std::string>& more = {});
  ~Deployed();  // ends it, hard if need be
  Deployed(const Deployed&) = delete;
  Deployed& operator=(const Deployed&) = delete;

  // The node's process now; nothing while it is down.
  std::optional<pid_t> pid_of(const std::string& node) const;
  std::vector<pid_t> all_children() const;
  pid_t pid() const { return pid_; }

  void signal(int number) const;
  // Exit code once it has ended, within the time; nothing otherwise.
  std::optional<int> wait_for_end(std::chrono::milliseconds timeout);

 private:
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

// Waits on the bus until the condition holds; false when the time is up.
bool eventually(Bus& bus, std::chrono::milliseconds timeout, const std::function<bool()>& condition);

bool is_alive(pid_t pid);  // exists and is no zombie

}  // namespace fivepipe::test
